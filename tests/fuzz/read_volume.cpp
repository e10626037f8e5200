#include "tests/fuzz/read_volume.h"

#include <vector>

#include "io/errors/errors.h"
#include "io/formats/table/open_volume.h"
#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {
namespace {

constexpr std::uint64_t most_sample_bytes = 1 << 16;

}  // namespace

void read_volume(const std::string& path) {
  try {
    const auto volume = open_volume(path);
    const auto bytes = sample_bytes(volume->info().dims, volume->info().type);
    claim(bytes.has_value(), "a volume that was accepted has a size");
    if (*bytes > most_sample_bytes) return;
    std::vector<std::byte> once(*bytes), again(*bytes);
    volume->read_slices(once.data(), volume->info().dims.z);
    volume->finish();
    if (!volume->traits().again) return;
    volume->rewind();
    volume->read_slices(again.data(), volume->info().dims.z);
    claim(once == again, "a volume that is read twice is the same");
  } catch (const BrokenInput&) {
  } catch (const WorldError&) {
  } catch (const UsageError&) {
    // Several volumes, of which none was chosen.
  }
}

}  // namespace tagrid::fuzz
