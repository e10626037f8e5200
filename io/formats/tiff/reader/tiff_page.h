// An image in a TIFF file, and what users should know of it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/volume/volume_info.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

/// What users should know of TIFF files: sentences without names of files, each once; see SourceFacts.
struct TiffRemarks {
  std::vector<std::string> warnings, not_understood;
  std::string scale_doubt;

  void warn(const std::string& sentence) { add_once(warnings, sentence); }
  void miss(const std::string& sentence) { add_once(not_understood, sentence); }
  void doubt(const std::string& sentence) {
    if (scale_doubt.empty()) scale_doubt = sentence;
  }
  void add(const TiffRemarks& others) {
    for (const std::string& sentence : others.warnings) warn(sentence);
    for (const std::string& sentence : others.not_understood) miss(sentence);
    doubt(others.scale_doubt);
  }

 private:
  static void add_once(std::vector<std::string>& list, const std::string& sentence) {
    if (!sentence.empty() && std::ranges::find(list, sentence) == list.end()) list.push_back(sentence);
  }
};

/// An image in a TIFF file: one slice.
struct TiffPage {
  std::uint64_t directory = 0;  ///< byte of the file at which its description lies
  std::int64_t number = 0;      ///< of the directory among all of the file, counted from 0
  std::uint32_t width = 0, height = 0;
  SampleType type = SampleType::uint8;
  /// Of a sample, if they are packed: they are widened to `type`; 0 if samples have its size.
  int packed_bits = 0;
  bool is_lossy = false;            ///< compressed with a loss
  bool may_have_predictor = false;  ///< Its compression is one that stores differences of samples, too.
  /// A predictor of floats in a big-endian file: libtiff 4.5 and others swap the bytes of what they write.
  bool may_be_swapped = false;
  std::string storage;  ///< how its samples are stored, for users: "LZW"
  /// The byte at which its samples begin, if they lie there plainly, in raster order.
  std::optional<std::uint64_t> plain;
  std::string description;  ///< ImageDescription: text, in which programs keep what TIFF has no tags for
  /// Pixels per unit. TIFF files of volumes rarely name the unit. Values of 0 and less are invalid.
  std::optional<double> x_resolution, y_resolution;
  /// 1: none, only the ratio of both counts; 2: inch; 3: cm. The standard takes a missing one for inches, which
  /// those who leave it out do not mean.
  std::uint16_t resolution_unit = 1;
  Rescale rescale;  ///< what tags say that samples mean
  /// A sentence if tags of another program say which pages are channels and moments; "" if none do.
  std::string unread_order;
  bool zero_is_white = false;
  /// Where its first row and column are to be shown; 1: at the top and at the left.
  std::uint16_t orientation = 1;
  bool big_endian = false;
  std::uint32_t pieces = 0;     ///< strips or tiles
  std::uint32_t unwritten = 0;  ///< those with neither a place nor bytes: never written
  double fill = 0;              ///< what the samples of such pieces are
  std::uint64_t memory = 0;     ///< bytes that reading takes, besides the samples

  /// Bytes of a row as it is stored, uncompressed.
  std::uint64_t row_in_file() const {
    return packed_bits == 0 ? width * size_of(type)
                            : (std::uint64_t{width} * static_cast<std::uint64_t>(packed_bits) + 7) / 8;
  }
  std::uint64_t bytes() const { return std::uint64_t{width} * height * size_of(type); }
};

}  // namespace tagrid
