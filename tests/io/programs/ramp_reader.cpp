// A reader program for tests. Its files say the size of a volume and how it is read: "5 4 3 any". Sample number i of the
// volume is i. Instead of "any", "broken" means that slice 2 cannot be read, and "greedy" that the description takes 200 MiB.

#include <fstream>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/files/errors.h"
#include "io/programs/serve_reader.h"

namespace tagrid {
namespace {

class Ramp final : public ServedVolume {
 public:
  explicit Ramp(const std::string& path) {
    std::string order;
    if (!(std::ifstream(path) >> dims.x >> dims.y >> dims.z >> order))
      throw BrokenInput(path + ": is no ramp");
    type = SampleType::uint32;
    files = {path};
    any_order = order != "next";
    is_broken_ = order == "broken";
    if (order == "greedy") much_.resize(std::size_t{200} << 20);
    pairs = {{"made by", "ramp"}};
    geometry.spacing = {1, 2, 3};
    geometry.has_spacing = true;
  }

  void read_slice(std::int64_t z, std::byte* out) override {
    if (!any_order && z != next_) throw BrokenInput("slice " + std::to_string(z) + " is not the next one");
    if (is_broken_ && z == 2) throw BrokenInput("slice 2 cannot be read");
    next_ = z + 1;
    for (std::int64_t i = 0; i < dims.x * dims.y; ++i)
      store_little_endian(out + i * 4, static_cast<std::uint32_t>(z * dims.x * dims.y + i));
  }

 private:
  std::vector<std::byte> much_;
  bool is_broken_ = false;
  std::int64_t next_ = 0;
};

}  // namespace
}  // namespace tagrid

int main() {
  return tagrid::serve_volumes("ramp", [](const std::string& path, const tagrid::ReaderOptions& options) {
    const auto series = options.find("series");
    if (series == options.end() || series->second != "both") return std::make_unique<tagrid::Ramp>(path);
    const std::vector<tagrid::Choice> list = {{"a", "the first"}, {"b", "the second"}};
    tagrid::chosen(path, "series", "", list);
    return std::unique_ptr<tagrid::Ramp>();
  });
}
