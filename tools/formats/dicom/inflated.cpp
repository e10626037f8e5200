#include "tools/formats/dicom/inflated.h"

#include <zlib.h>

#include <algorithm>
#include <cstddef>
#include <new>
#include <span>
#include <vector>

namespace tagrid {
namespace {

constexpr std::size_t most_kept = std::size_t{4} << 20;

/// A stream without the head and the checksum of zlib.
class RawDeflate {
 public:
  RawDeflate() {
    if (inflateInit2(&z_, -MAX_WBITS) != Z_OK) throw std::bad_alloc();
  }
  ~RawDeflate() { inflateEnd(&z_); }
  RawDeflate(const RawDeflate&) = delete;
  RawDeflate& operator=(const RawDeflate&) = delete;

  /// Inflates `input`, and calls `use` with all that it gives. Returns false if the stream is damaged.
  template <class Use>
  bool inflate_all(std::span<std::byte> input, Use use) {
    z_.next_in = reinterpret_cast<Bytef*>(input.data());
    z_.avail_in = static_cast<uInt>(input.size());
    while (!is_done_) {
      z_.next_out = reinterpret_cast<Bytef*>(output_.data());
      z_.avail_out = static_cast<uInt>(output_.size());
      const int result = inflate(&z_, Z_NO_FLUSH);
      if (result == Z_BUF_ERROR) return true;  // it needs more input
      if (result != Z_OK && result != Z_STREAM_END) return false;
      use(std::span<const char>(output_).first(output_.size() - z_.avail_out));
      is_done_ = result == Z_STREAM_END;
    }
    return true;
  }
  bool is_done() const { return is_done_; }

 private:
  z_stream z_ = {};
  std::vector<char> output_ = std::vector<char>(std::size_t{1} << 16);
  bool is_done_ = false;
};

}  // namespace

InflatedDataset inflated_dataset(const ByteSource& file, std::uint64_t begin, std::uint64_t at,
                                 std::uint64_t samples) {
  InflatedDataset dataset;
  RawDeflate stream;
  std::uint64_t position = 0;
  const auto take = [&](std::span<const char> bytes) {
    for (; !bytes.empty() && dataset.why_not.empty();) {
      const bool is_before = position < at, is_behind = position >= at + samples;
      const std::uint64_t end = is_before ? at : is_behind ? position + bytes.size() : at + samples;
      const std::size_t n = std::min<std::uint64_t>(bytes.size(), end - position);
      if (is_before) dataset.before.append(bytes.data(), n);
      if (is_behind) dataset.behind.append(bytes.data(), n);
      if (dataset.before.size() + dataset.behind.size() > most_kept)
        dataset.why_not = "its attributes are too many";
      position += n;
      bytes = bytes.subspan(n);
    }
  };
  std::vector<std::byte> input;
  for (std::uint64_t from = begin; from < file.size() && !stream.is_done(); from += input.size()) {
    input.resize(std::min<std::uint64_t>(file.size() - from, 1 << 16));
    file.read_at(from, input);
    if (!stream.inflate_all(input, take)) dataset.why_not = "its deflated data set is damaged";
    if (!dataset.why_not.empty()) return dataset;
  }
  if (!stream.is_done() || position < at + samples) dataset.why_not = "its deflated data set ends too soon";
  return dataset;
}

}  // namespace tagrid
