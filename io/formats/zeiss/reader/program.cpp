// tagrid-read-zeiss: reads reconstructed volumes (.txm) and projections (.txrm, .xrm) of Zeiss X-ray microscopes
// with libgsf.

#include <fmt/format.h>
#include <gsf/gsf-utils.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/formats/zeiss/reader/compound_file.h"
#include "io/programs/serve_reader.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {
namespace {

/// The numbers of types of samples. 8 and 9 are integers of 64 bits.
constexpr std::array types = {std::pair{2U, SampleType::int8},     std::pair{3U, SampleType::uint8},
                              std::pair{4U, SampleType::int16},    std::pair{5U, SampleType::uint16},
                              std::pair{6U, SampleType::int32},    std::pair{7U, SampleType::uint32},
                              std::pair{10U, SampleType::float32}, std::pair{11U, SampleType::float64}};

/// The shortest decimal number that is this float: 0.65, not 0.64999998.
double decimal(float number) { return number_of(fmt::format("{}", number)).value_or(number); }

class ZeissImages final : public ServedVolume {
 public:
  explicit ZeissImages(const std::string& path) : file_(path) {
    files = {path};
    type = type_of_samples();
    dims = {count("ImageInfo/ImageWidth"), count("ImageInfo/ImageHeight"), count_of_images()};
    if (!is_volume_size(dims) || !sample_bytes(dims, type))
      refuse(fmt::format("a volume cannot have {} samples", described(dims, type)));
    const std::uint64_t slice = *sample_bytes({dims.x, dims.y, 1}, type);
    for (std::int64_t z = 0; z < dims.z; ++z) {
      say_working();
      if (const std::uint64_t size = file_.at(name_of_image(z)).size(); size != slice)
        refuse(fmt::format("{} has {} bytes, but {} x {} samples of {} have {}", name_of_image(z), size,
                           dims.x, dims.y, name_of(type), slice));
    }
    // Programs that append images need not change the number.
    if (file_.find(name_of_image(dims.z)))
      not_understood.push_back(
          fmt::format("{}: has more images than the {} of {}; those from image {} on are not read", path,
                      dims.z, name_of_count_, dims.z + 1));
    describe();
    // The table of sectors, and which of them an image has, both with room to grow.
    memory = 2 * slice + std::filesystem::file_size(path) / 32;
  }

  void read_slice(std::int64_t z, std::byte* out) override {
    // As in the file: little endian.
    file_.at(name_of_image(z)).read({out, *sample_bytes({dims.x, dims.y, 1}, type)});
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw BrokenInput("{}: Zeiss file: {}", files.front(), why);
  }

  /// Storages have 100 images each; both are numbered from 1 on.
  static std::string name_of_image(std::int64_t z) {
    return fmt::format("ImageData{}/Image{}", z / 100 + 1, z + 1);
  }

  std::optional<std::uint32_t> number(const char* name) const {
    const auto bytes = file_.content(name, 8);
    if (!bytes || bytes->size() < 4) return std::nullopt;
    return load_little_endian<std::uint32_t>(bytes->data());
  }

  std::int64_t count(const char* name) const {
    const auto found = number(name);
    if (!found) refuse(fmt::format("has no {}, so it is not one of an X-ray microscope", name));
    constexpr std::uint32_t most = std::uint32_t{1} << 31;
    if (*found == 0 || *found >= most) refuse(fmt::format("its {} is {}", name, *found));
    return *found;
  }

  SampleType type_of_samples() const {
    const std::int64_t found = count("ImageInfo/DataType");
    const auto* const known =
        std::ranges::find(types, found, [](const auto& one) { return std::int64_t{one.first}; });
    if (known == types.end())
      refuse(fmt::format("its samples are of the type {} (DataType), which is not supported", found));
    return known->second;
  }

  /// A scan that was stopped has fewer than were planned.
  std::int64_t count_of_images() {
    const std::int64_t planned = count("ImageInfo/NoOfImages");
    const auto taken = number("ImageInfo/ImagesTaken");
    if (!taken || *taken == 0 || *taken >= planned) return planned;
    warnings.push_back(fmt::format("{}: {} of {} planned images were taken", files.front(), *taken, planned));
    name_of_count_ = "ImagesTaken";
    return *taken;
  }

  /// Numbers of 4 bytes, as many as there are images.
  std::vector<float> one_an_image(const char* name) const {
    constexpr std::size_t most = std::size_t{1} << 24;
    const auto bytes = file_.content(name, most);
    const auto images = static_cast<std::size_t>(dims.z);
    if (!bytes || bytes->size() < images * sizeof(float)) return {};
    std::vector<float> numbers;
    for (std::size_t i = 0; i < images; ++i)
      numbers.push_back(load_little_endian<float>(bytes->data() + i * sizeof(float)));
    return numbers;
  }

  /// In micrometers; nothing if it is not stated.
  std::optional<double> pixel_size() const {
    const auto bytes = file_.content("ImageInfo/PixelSize", 8);
    if (!bytes || (bytes->size() != 4 && bytes->size() != 8)) return std::nullopt;
    const double size = bytes->size() == 4 ? decimal(load_little_endian<float>(bytes->data()))
                                           : load_little_endian<double>(bytes->data());
    return std::isfinite(size) && size > 0 ? std::optional(size) : std::nullopt;
  }

  void describe() {
    const std::string extension = extension_of(files.front());
    const std::vector<float> angles = one_an_image("ImageInfo/Angles");
    const bool differ = std::ranges::any_of(angles, [&](float angle) { return angle != angles.front(); });
    const bool are_projections =
        extension != ".txm" && (differ || extension == ".txrm" || extension == ".xrm");
    if (const auto size = pixel_size()) {
      geometry.spacing = {*size, *size, are_projections ? Geometry::unknown : *size};
      geometry.has_spacing = true;
      geometry.units.fill("um");
    } else {
      warnings.push_back(files.front() + ": does not state its pixel size, so its spacing is unknown");
    }
    if (!are_projections) return;
    warnings.push_back(files.front() + ": its slices are projections, not those of a reconstructed volume");
    std::string degrees;
    for (const float angle : angles) degrees += fmt::format("{}{}", degrees.empty() ? "" : " ", angle);
    if (!degrees.empty()) pairs.emplace_back("zeiss_angles", degrees);
    if (file_.find("ReferenceData/Image"))
      warnings.push_back(files.front() + ": its reference image (flat field) is not part of the volume");
  }

  CompoundFile file_;
  const char* name_of_count_ = "NoOfImages";  ///< of the field that states the number of images
};

}  // namespace
}  // namespace tagrid

int main() {
  gsf_init();
  return tagrid::serve_volumes("zeiss", [](const std::string& path, const tagrid::ReaderOptions&) {
    return std::unique_ptr<tagrid::ServedVolume>(std::make_unique<tagrid::ZeissImages>(path));
  });
}
