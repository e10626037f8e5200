#include "io/programs/volumes.h"

#include <algorithm>
#include <cassert>
#include <stdexcept>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/files/output_file.h"
#include "io/programs/filled_file.h"

namespace tagrid {
namespace {

class ProgramSink final : public VolumeSink {
 public:
  ProgramSink(const std::string& program, const std::string& path, const VolumeInfo& info,
              const SinkOptions& options, const WriterOptions& wishes, std::uint64_t first_memory)
      : VolumeSink(info),
        file_(path, options.overwrite, {.like = options.like}),
        filled_(file_, path, options.spool),
        conversation_(program, {.memory = first_memory}),
        ready_(conversation_.begin(filled_.path(), filled_.name(), info, wishes)) {}

  bool any_order() const override { return false; }
  Place place() const override { throw std::logic_error("a program writes the samples"); }
  std::uint64_t memory() const override { return ready_.memory; }
  std::vector<std::string> warnings() const override { return ready_.warnings; }
  std::string facts() const override { return facts_; }
  void publish() override {
    assert(bytes_left() == 0);
    file_.publish();
  }
  void keep() override { file_.keep(); }
  std::uint64_t bytes_written() const override { return bytes_; }

 private:
  void write(std::int64_t first, std::span<const std::byte> samples) override {
    const std::size_t size = size_of(info().type);
    const std::uint64_t slice = *sample_bytes({info().dims.x, info().dims.y, 1}, info().type);
    std::vector<std::byte> swapped;
    samples = little_endian_samples(samples, size, swapped);
    for (std::uint64_t place = static_cast<std::uint64_t>(first) * size; !samples.empty();) {
      const std::uint64_t within = place % slice;
      if (within == 0) {
        const auto z = static_cast<std::int64_t>(place / slice);
        conversation_.announce_slices(z, z + 1);
      }
      const auto part = samples.first(std::min<std::uint64_t>(samples.size(), slice - within));
      conversation_.write(part.data(), part.size());
      samples = samples.subspan(part.size());
      place += part.size();
    }
    if (bytes_left() == 0) complete();
  }

  void complete() {
    facts_ = conversation_.finish();
    bytes_ = filled_.complete();
  }

  OutputFile file_;
  FilledFile filled_;
  WriterConversation conversation_;
  WriterReady ready_;
  std::string facts_;
  std::uint64_t bytes_ = 0;
};

}  // namespace

std::unique_ptr<VolumeSink> create_with_writer(const std::string& program, const std::string& path,
                                               const VolumeInfo& info, const SinkOptions& options,
                                               const WriterOptions& wishes, std::uint64_t first_memory) {
  return std::make_unique<ProgramSink>(program, path, info, options, wishes, first_memory);
}

}  // namespace tagrid
