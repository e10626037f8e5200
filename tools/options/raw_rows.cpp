#include "tools/options/raw_rows.h"

namespace tagrid {

const std::vector<OptionRow<RawOptions>>& raw_rows() {
  const auto row = [](const char* name, const char* value, const char* help, std::string RawOptions::*member,
                      const std::vector<std::string>& words = {}) {
    const auto set = [member](RawOptions& o, const std::string& text) { o.*member = text; };
    return OptionRow<RawOptions>{name, "Headerless input", value, help, set, words};
  };
  static const std::vector<OptionRow<RawOptions>> rows = {
      row("dims", "X,Y,Z", "Samples along x (fastest), y and z", &RawOptions::dims),
      row("type", "TYPE", "Sample type: uint8, int8, uint16, int16, uint32, int32, float32 or float64",
          &RawOptions::type),
      row("endian", "little|big", "Byte order of the samples (default: little)", &RawOptions::endian,
          {"little", "big"}),
      row("spacing", "X,Y,Z", "Distance between samples along x, y and z", &RawOptions::spacing),
      row("offset", "BYTES", "Bytes before the first sample; K, M, G and T are powers of 1024",
          &RawOptions::offset),
  };
  return rows;
}

}  // namespace tagrid
