// JPEG-LS, slice by slice, for the benchmark: CharLS is only a library.
//   bench_jpegls encode WIDTH HEIGHT BITS NEAR INPUT OUTPUT
//   bench_jpegls decode INPUT OUTPUT
//   bench_jpegls version
// Samples are unsigned and x fastest: one byte each up to 8 bits, otherwise two, little endian. The output of
// `encode` is the slices one after the other, each after its size in bytes (4 of them).

#include <charls/charls.h>
#include <fmt/format.h>

#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using Arguments = std::vector<std::string>;
using Bytes = std::vector<std::uint8_t>;

struct Files {
  std::ifstream in;
  std::ofstream out;

  Files(const std::string& input, const std::string& output)
      : in(input, std::ios::binary), out(output, std::ios::binary) {
    if (!in) throw std::runtime_error(input + ": cannot open");
    if (!out) throw std::runtime_error(output + ": cannot create");
  }
  /// False at the end of the input.
  bool read(void* bytes, std::size_t size) {
    in.read(static_cast<char*>(bytes), static_cast<std::streamsize>(size));
    return static_cast<std::size_t>(in.gcount()) == size;
  }
  void write(const void* bytes, std::size_t size) {
    if (!out.write(static_cast<const char*>(bytes), static_cast<std::streamsize>(size)))
      throw std::runtime_error("cannot write");
  }
};

void encode(const Arguments& a) {
  const charls::frame_info frame{static_cast<std::uint32_t>(std::stoul(a.at(1))),
                                 static_cast<std::uint32_t>(std::stoul(a.at(2))), std::stoi(a.at(3)), 1};
  Files files(a.at(5), a.at(6));
  Bytes slice(std::size_t{frame.width} * frame.height * (frame.bits_per_sample <= 8 ? 1 : 2)), coded;
  while (files.read(slice.data(), slice.size())) {
    charls::jpegls_encoder encoder;
    encoder.frame_info(frame).near_lossless(std::stoi(a.at(4)));
    coded.resize(encoder.estimated_destination_size());
    encoder.destination(coded);
    const auto size = static_cast<std::uint32_t>(encoder.encode(slice));
    files.write(&size, sizeof size);
    files.write(coded.data(), size);
  }
}

void decode(const Arguments& a) {
  Files files(a.at(1), a.at(2));
  Bytes slice, coded;
  for (std::uint32_t size = 0; files.read(&size, sizeof size);) {
    coded.resize(size);
    if (!files.read(coded.data(), size)) throw std::runtime_error("the input ends too soon");
    charls::jpegls_decoder decoder(coded, true);
    slice.resize(decoder.destination_size());
    decoder.decode(slice);
    files.write(slice.data(), slice.size());
  }
}

}  // namespace

int main(int count, char** values) {
  try {
    const Arguments arguments(values + 1, values + count);
    const std::string& what = arguments.at(0);
    if (what == "version") fmt::print("{}\n", charls_get_version_string());
    if (what == "encode") encode(arguments);
    if (what == "decode") decode(arguments);
    return 0;
  } catch (const std::out_of_range&) {
    fmt::print(stderr, "usage: bench_jpegls encode|decode ARGUMENTS, see the source\n");
    return 64;
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_jpegls: {}\n", error.what());
    return 74;
  }
}
