#include "io/samples/spooled.h"

#include <bit>
#include <cassert>

#include "io/files/spool_file.h"
#include "io/samples/file_samples.h"

namespace tagrid {
namespace {

class SpooledSamples final : public PlainSamples {
 public:
  SpooledSamples(const SourceFacts& facts, std::unique_ptr<FileBytes> file, std::uint64_t bytes_read)
      : PlainSamples(facts, std::move(file), {0, std::endian::native == std::endian::big, 0}),
        bytes_read_(bytes_read) {}

  std::uint64_t bytes_read() const override { return bytes_read_; }

 private:
  std::uint64_t bytes_read_;  ///< of the original source
};

}  // namespace

std::unique_ptr<VolumeSource> spooled(std::unique_ptr<VolumeSource> source, const std::string& folder) {
  assert(source->next_sample() == 0);
  SpoolFile file = SpoolFile::in(folder, source->name());
  read_to_end(*source, [&](std::span<const std::byte> samples) { file.write(samples); });
  return std::make_unique<SpooledSamples>(
      source->facts(), std::make_unique<FileBytes>(file.release(), source->name()), source->bytes_read());
}

}  // namespace tagrid
