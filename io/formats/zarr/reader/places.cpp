#include "io/formats/zarr/reader/places.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "io/bytes/little_endian.h"
#include "io/formats/axes/geometry_words.h"
#include "io/formats/zarr/reader/json.h"
#include "io/formats/zarr/reader/pieces.h"
#include "io/programs/stored_samples.h"

namespace tagrid {
namespace {

/// A list of numbers that is an array of one axis.
struct NumberList {
  std::vector<std::byte> bytes;  ///< little endian
  std::size_t size = 1;          ///< bytes of a number
  bool is_big_endian = false;

  std::span<const std::byte> at(std::size_t i) const { return std::span(bytes).subspan(i * size, size); }
};

/// Throws BrokenInput if the array is not a short list, or has chunks that are missing.
NumberList list_in(const ZarrStore& store, const ZarrArray& array, std::size_t size) {
  const auto refuse = [&](const char* why) { throw BrokenInput(why); };
  if (array.shape.size() != 1) refuse("it is not a list");
  const std::int64_t length = array.shape[0], piece = array.piece[0];
  if (length > static_cast<std::int64_t>(most_places_of_axis) ||
      piece > static_cast<std::int64_t>(most_places_of_axis))
    refuse("it is too long");
  NumberList list = {{}, size, array.big_endian};
  ZarrPieces pieces(store, array);
  for (std::int64_t first = 0; first < length; first += piece) {
    const auto part = pieces.read({first / piece});
    if (!part) refuse("some of its chunks are missing");
    list.bytes.insert(list.bytes.end(), part->begin(),
                      part->begin() + static_cast<std::ptrdiff_t>(
                                          static_cast<std::size_t>(std::min(piece, length - first)) * size));
  }
  return list;
}

/// The numbers of an array, which may also have integers of 64 bits. Throws BrokenInput.
std::vector<double> numbers_in(const ZarrStore& store, ZarrArray array, double& epsilon) {
  const bool is_long = array.type_name == "int64" || array.type_name == "uint64";
  if (!array.type && !is_long) throw BrokenInput(fmt::format("it has {} numbers", array.type_name));
  for (const char* packed : {"scale_factor", "add_offset"})
    if (!member(array.attributes, packed).is_null())
      throw BrokenInput(
          fmt::format("it has the attribute {}, and packed positions are not supported", packed));
  if (is_long) array.type = SampleType::float64;  // of the same size
  const NumberList list = list_in(store, array, size_of(*array.type));
  std::vector<double> numbers;
  for (std::size_t i = 0; i * list.size < list.bytes.size(); ++i) {
    std::array<std::byte, 8> bytes = {};
    store_little_endian(bytes.data(), number_in(list.at(i), list.is_big_endian));
    if (array.type_name == "int64")
      numbers.push_back(static_cast<double>(load_little_endian<std::int64_t>(bytes.data())));
    else if (array.type_name == "uint64")
      numbers.push_back(static_cast<double>(load_little_endian<std::uint64_t>(bytes.data())));
    else
      with_sample_type(*array.type, [&]<class T>(T) {
        numbers.push_back(static_cast<double>(load_little_endian<T>(bytes.data())));
      });
  }
  epsilon = array.type == SampleType::float32               ? std::numeric_limits<float>::epsilon()
            : array.type == SampleType::float64 && !is_long ? std::numeric_limits<double>::epsilon()
                                                            : 0;
  return numbers;
}

}  // namespace

std::optional<PlacesOfAxes> coordinates_of(const ZarrStore& store, const ZarrImage& image,
                                           const SpaceAxes& space, const Index3& dims) {
  if (image.array.path.empty()) return std::nullopt;
  const std::size_t slash = image.array.path.rfind('/');
  const std::string group = slash == std::string::npos ? "" : image.array.path.substr(0, slash);
  AxesOfVolume axes(store.path(), "zarr_");
  bool has_any = false;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto samples = static_cast<std::uint64_t>(dims[static_cast<int>(i)]);
    const std::string name = space[i] ? image.axes[*space[i]].name : "";
    const auto node = name.empty() || joined(group, name) == image.array.path
                          ? std::nullopt
                          : zarr_node(store, joined(group, name));
    if (!node || !node->is_array) {
      if (samples == 1) axes.add_none(i);
      continue;
    }
    has_any = true;
    try {
      const ZarrArray array = zarr_array(store, *node);
      double epsilon = 0;
      AxisReading found = axis_of_numbers(numbers_in(store, array, epsilon), samples, epsilon);
      if (!found.axis) throw BrokenInput(found.why_not);
      found.axis->unit = text_at(array.attributes, "units");
      axes.add(i, name, std::move(*found.axis));
    } catch (const BrokenInput& why) {
      axes.add_missing(i, name, samples, why.what());
    }
  }
  if (!has_any) return std::nullopt;
  return axes.finish();
}

std::optional<NiftiHeader> nifti_header_of(const ZarrStore& store, const ZarrImage& image, const Index3& dims,
                                           std::string& why_not) {
  const std::string path = joined(image.group, "nifti");
  if (path == image.array.path) return std::nullopt;
  try {
    const auto node = zarr_node(store, path);
    if (!node) return std::nullopt;
    if (!node->is_array) throw BrokenInput("it is a group");
    const ZarrArray array = zarr_array(store, *node);
    if (array.type != SampleType::uint8) throw BrokenInput(fmt::format("it has {} samples", array.type_name));
    const NumberList list = list_in(store, array, 1);
    const std::string_view bytes(reinterpret_cast<const char*>(list.bytes.data()), list.bytes.size());
    if (bytes.size() < 348 || !begins_nifti(bytes))
      throw BrokenInput("it does not begin with a header of NIfTI");
    NiftiHeader header = parse_nifti_header(bytes.substr(0, max_nifti_header_bytes));
    if (header.info.dims != dims)
      throw BrokenInput(fmt::format("it describes {} x {} x {} samples", header.info.dims.x,
                                    header.info.dims.y, header.info.dims.z));
    return header;
  } catch (const BrokenInput& why) {
    why_not = fmt::format("{}: the header of NIfTI in {} is not read: {}", store.path(), tagrid::quoted(path),
                          why.what());
    return std::nullopt;
  }
}

std::vector<std::string> unread_geometry(const ZarrStore& store, const ZarrImage& image) {
  // What OME-Zarr and xarray write, and what is read as axes or kept as names.
  static constexpr std::array<std::string_view, 3> known = {"multiscales", "coordinates", "axis_names"};
  std::vector<std::string> names;
  const auto look = [&](const Json& attributes, const std::string& where) {
    for (const auto& [name, value] : attributes.items())
      if (looks_like_geometry(name) && std::ranges::find(known, name) == known.end() && !value.is_null())
        names.push_back(where.empty() ? name : fmt::format("{} (of {})", name, where));
  };
  look(image.array.attributes, "");
  for (std::string path = image.array.path; !path.empty();) {
    const std::size_t slash = path.rfind('/');
    path.resize(slash == std::string::npos ? 0 : slash);
    if (const auto group = zarr_node(store, path); group && !group->is_array)
      look(group->attributes, path.empty() ? "the root" : path);
  }
  return names;
}

}  // namespace tagrid
