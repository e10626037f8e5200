#include "io/formats/amira/byte_runs.h"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "io/errors/errors.h"

namespace tagrid {
namespace {

constexpr std::uint64_t longest_run = 127;
constexpr std::uint64_t block = std::uint64_t{1} << 16;  // bytes that are read at once

SourceFacts with_traits(SourceFacts facts, const FileBytes& file, const PlaceOfRuns& place,
                        const std::string& plain_header) {
  facts.traits = {
      .again = file.size().has_value(), .any_rows = false, .whole_slices = false, .memory = block};
  if (!file.size() || facts.files.back() == "-") return facts;
  const Index3 dims = facts.info.dims;
  const std::uint64_t samples = *sample_bytes(dims, facts.info.type);
  facts.plain_form = [path = facts.files.back(), end = std::pair(place.start + place.bytes, *file.size()),
                      dims, samples, plain_header,
                      slice = *sample_bytes({dims.x, dims.y, 1}, facts.info.type)] {
    PlainForm form;
    form.compression = "HxByteRLE";
    form.files = {{path,
                   true,
                   {PlainPiece::given(plain_header), PlainPiece::samples(samples),
                    PlainPiece::stretch(0, std::min(end.first, end.second), end.second)}}};
    form.places = {{.file = 0, .offset = plain_header.size(), .slices = dims.z, .step = slice}};
    return form;
  };
  return facts;
}

class ByteRuns final : public VolumeSource {
 public:
  ByteRuns(SourceFacts facts, std::unique_ptr<FileBytes> file, const PlaceOfRuns& place,
           const std::string& plain_header)
      : VolumeSource(with_traits(std::move(facts), *file, place, plain_header)),
        place_(place),
        file_(std::move(file)) {
    const std::uint64_t expected = *sample_bytes(info().dims, info().type);
    const std::uint64_t present =
        file_->size() ? std::min(place_.bytes, *file_->size() - std::min(place_.start, *file_->size()))
                      : place_.bytes;
    if (expected / longest_run > present / 2 + 1)
      throw BrokenInput("{}: {} bytes of runs cannot hold the samples ({})", file_->name(), present,
                        described(info().dims, info().type));
    restart();
  }

  std::uint64_t bytes_read() const override { return file_->position(); }
  void stop_when(const std::atomic<bool>& stop) override { file_->stop_when(stop); }

 private:
  void restart() {
    if (file_->size()) file_->seek(place_.start);
    left_ = place_.bytes;
    run_ = 0;
    buffer_.clear();
    at_ = 0;
  }

  std::byte next() {
    if (at_ == buffer_.size()) {
      const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(left_, block));
      buffer_.resize(wanted);
      buffer_.resize(file_->read(buffer_.data(), wanted));
      at_ = 0;
      left_ -= buffer_.size();
      if (buffer_.empty())
        throw BrokenInput("{}: its runs end before its samples ({})", file_->name(),
                          described(info().dims, info().type));
    }
    return buffer_[at_++];
  }

  /// Fills `out`, or skips `count` samples if it is nullptr.
  void decode(std::byte* out, std::uint64_t count) {
    while (count > 0) {
      if (run_ == 0) {
        const auto control = std::to_integer<std::uint64_t>(next());
        repeats_ = control <= longest_run;
        run_ = repeats_ ? control : control - longest_run - 1;
        if (run_ == 0) throw BrokenInput(file_->name() + ": its runs are damaged: one of them is empty");
        if (repeats_) value_ = next();
      }
      const std::uint64_t part = std::min(run_, count);
      for (std::uint64_t i = 0; i < part; ++i) {
        const std::byte sample = repeats_ ? value_ : next();
        if (out != nullptr) *out++ = sample;
      }
      run_ -= part;
      count -= part;
    }
  }

  void read(std::byte* out, std::int64_t, std::int64_t count) override {
    decode(out, static_cast<std::uint64_t>(count));
  }
  void seek(std::int64_t z) override {
    restart();
    decode(nullptr, static_cast<std::uint64_t>(z * slice_samples()));
  }
  void end() override {
    if (run_ != 0 || left_ != 0 || at_ != buffer_.size())
      throw BrokenInput("{}: its runs hold more than its samples ({})", file_->name(),
                        described(info().dims, info().type));
  }

  PlaceOfRuns place_;
  std::unique_ptr<FileBytes> file_;
  std::uint64_t left_ = 0, run_ = 0;  ///< bytes that were not yet read, and samples of the current run
  std::vector<std::byte> buffer_;     ///< those that were, from at_ on not yet decoded
  std::size_t at_ = 0;
  bool repeats_ = false;
  std::byte value_{};
};

}  // namespace

std::unique_ptr<VolumeSource> byte_runs(SourceFacts facts, std::unique_ptr<FileBytes> file,
                                        const PlaceOfRuns& place, const std::string& plain_header) {
  return std::make_unique<ByteRuns>(std::move(facts), std::move(file), place, plain_header);
}

}  // namespace tagrid
