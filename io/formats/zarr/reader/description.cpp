#include "io/formats/zarr/reader/description.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "io/bytes/little_endian.h"
#include "io/formats/axes/axes.h"
#include "io/formats/axes/geometry_words.h"
#include "io/formats/zarr/reader/json.h"
#include "io/formats/zarr/reader/n5.h"
#include "io/formats/zarr/reader/pieces.h"
#include "io/metadata/lengths.h"
#include "io/metadata/loss.h"
#include "io/metadata/rescale.h"
#include "io/metadata/text.h"
#include "io/programs/stored_samples.h"
#include "io/programs/words.h"
#include "io/text/foreign_number.h"
#include "io/text/text.h"

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
  if (!array.type && !is_long) throw BrokenInput("it has {} numbers", array.type_name);
  for (const char* packed : {"scale_factor", "add_offset"})
    if (!member(array.attributes, packed).is_null())
      throw BrokenInput("it has the attribute {}, and packed positions are not supported", packed);
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
    if (array.type != SampleType::uint8) throw BrokenInput("it has {} samples", array.type_name);
    const NumberList list = list_in(store, array, 1);
    const std::string_view bytes(reinterpret_cast<const char*>(list.bytes.data()), list.bytes.size());
    if (bytes.size() < 348 || !begins_nifti(bytes))
      throw BrokenInput("it does not begin with a header of NIfTI");
    NiftiHeader header = parse_nifti_header(bytes.substr(0, max_nifti_header_bytes));
    if (header.info.dims != dims)
      throw BrokenInput("it describes {} x {} x {} samples", header.info.dims.x, header.info.dims.y,
                        header.info.dims.z);
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
      if (looks_like_geometry(name) && std::ranges::find(known, name) == known.end() && !value.is_null() &&
          !(image.array.is_n5 && is_n5_scale(name)))
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

namespace {

/// Attributes that are kept as pairs; more would be a file of its own.
constexpr std::size_t most_attributes = std::size_t{1} << 18;

class Describing {
 public:
  Describing(const ZarrStore& store, const ZarrImage& image, const SpaceAxes& space, ServedVolume& volume)
      : store_(store), image_(image), space_(space), volume_(volume) {}

  void run() {
    volume_.pairs = {{"zarr_dataset", "/" + image_.array.path}};
    if (!image_.name.empty()) volume_.pairs.emplace_back("zarr_name", image_.name);
    add_attributes("zarr_attributes", image_.attributes);
    if (image_.array.attributes != image_.attributes)
      add_attributes("zarr_array_attributes", image_.array.attributes);
    for (std::size_t i = 0; i < 3; ++i)
      if (space_[i]) volume_.geometry.units[i] = image_.axes[*space_[i]].unit;
    if (image_.has_scale) set_spacing();
    if (image_.has_translation) {
      for (std::size_t i = 0; i < 3; ++i)
        if (space_[i]) volume_.geometry.origin[i] = image_.axes[*space_[i]].translation;
      volume_.geometry.has_origin = true;
    }
    set_scale();
    look_beside();
    if (std::string lost = lost_by_mixed_units(volume_.geometry); !lost.empty())
      volume_.warnings.push_back(fmt::format("{}: OME-Zarr: {}", store_.path(), lost));
    volume_.geometry = in_one_unit(volume_.geometry);
    auto header = recorded_metadata();
    if (header && has_places_of(header->geometry())) {
      volume_.metadata = std::move(header);
      // Without any line, these would count.
      volume_.geometry = {};
      volume_.pairs.clear();
      return;
    }
    add_rescale(volume_.rescale,
                volume_.pairs);  // which a reader's "rescale" would not do beside lines of NRRD
    if (header) keep_pairs_of(*header);
    std::string loss;
    for (const auto& [attribute, words] : lossy_attributes)
      if (image_.array.attributes.contains(attribute)) loss = loss_after(loss, words);
    volume_.metadata = metadata_of_places(volume_.geometry, volume_.pairs);
    add_loss(loss, *volume_.metadata);
  }

 private:
  /// The geometry that is stored next to the array. OME-Zarr has no directions, but the header of
  /// NIfTI has them.
  void look_beside() {
    std::string why_not;
    const auto nifti = nifti_header_of(store_, image_, volume_.dims, why_not);
    if (!why_not.empty()) volume_.not_understood.push_back(std::move(why_not));
    if (nifti) {
      say_other_spacing(nifti->info.geometry());
      volume_.geometry = nifti->info.geometry();
      // No samples follow this header.
      for (const std::string& warning : nifti->warnings)
        if (warning.find("vox_offset") == warning.npos)
          volume_.warnings.push_back(fmt::format("{}: {}", store_.path(), warning));
      volume_.not_understood.insert(volume_.not_understood.end(), nifti->not_understood.begin(),
                                    nifti->not_understood.end());
      if (volume_.rescale == Rescale{}) volume_.rescale = nifti->rescale;
      if (volume_.scale_doubt.empty()) volume_.scale_doubt = nifti->scale_doubt;
    } else if (auto places =
                   image_.has_scale ? std::nullopt : coordinates_of(store_, image_, space_, volume_.dims)) {
      volume_.geometry = std::move(places->geometry);
      volume_.pairs.insert(volume_.pairs.end(), places->pairs.begin(), places->pairs.end());
      volume_.warnings.insert(volume_.warnings.end(), places->warnings.begin(), places->warnings.end());
    }
    if (const auto names = unread_geometry(store_, image_); !names.empty())
      volume_.not_understood.push_back(
          about_unread_geometry(fmt::format("{}: Zarr: {}", store_.path(), shown_path(image_)), names));
  }

  void say_other_spacing(const Geometry& nifti) {
    constexpr double rounding = 1e-3;  // of numbers of 32 bits, and of programs that divide
    const Geometry scale = in_one_unit(volume_.geometry), header = in_one_unit(nifti);
    const auto unit = length_unit(scale.units[0]), other = length_unit(header.units[0]);
    for (std::size_t i = 0; i < 3 && image_.has_scale; ++i) {
      const double length = unit && other ? converted(scale.spacing[i], *unit, *other) : scale.spacing[i];
      if (std::abs(length - header.spacing[i]) <= rounding * std::abs(length)) continue;
      volume_.warnings.push_back(fmt::format(
          "{}: the scale of OME-Zarr is {} along {}, but the header of NIfTI states {}; the header is used",
          store_.path(), length, "xyz"[i], header.spacing[i]));
    }
  }

  /// The number of an attribute, which may be a text or a list of one.
  ForeignNumber number_at(const char* name) const {
    const Json* value = &member(image_.array.attributes, name);
    if (value->is_array() && value->size() == 1) value = &value->front();
    if (value->is_null()) return {};
    if (value->is_number()) return foreign_number(value->get<double>());
    const std::string text = value->is_string() ? value->get<std::string>() : value->dump();
    if (const auto number = is_float_type(volume_.type) ? number_of_base64(text) : std::nullopt)
      return foreign_number(*number);
    return foreign_number(std::optional<std::string_view>(text));
  }

  /// The attributes of netCDF, as xarray writes them (https://cfconventions.org).
  void set_scale() {
    const std::string object = fmt::format("{}: Zarr: {}", store_.path(), shown_path(image_));
    ForeignNumber slope = number_at("scale_factor"), intercept = number_at("add_offset");
    if (slope.is_number() && slope.value == 0) slope.outcome = ForeignNumber::Outcome::unreadable;
    constexpr const char* unknown = "how values follow from samples is not known";
    for (const auto& [name, number] :
         {std::pair("scale_factor", &slope), std::pair("add_offset", &intercept)}) {
      const std::string remark = remark_on(*number, name, unknown);
      if (number->is_unreadable() && volume_.scale_doubt.empty())
        volume_.scale_doubt = fmt::format("{}: {}", object, remark);
      else if (!remark.empty() && number->is_number())
        volume_.warnings.push_back(fmt::format("{}: {}", object, remark));
    }
    if (const std::string text = text_of_flag("_Unsigned");
        !is_float_type(volume_.type) && volume_.scale_doubt.empty())
      volume_.scale_doubt = about_other_sign(object, text, name_of(volume_.type).starts_with('i'));
    if (volume_.scale_doubt.empty() && (slope.is_number() || intercept.is_number()))
      volume_.rescale = {slope.value_or(1), intercept.value_or(0), text_at(image_.array.attributes, "units")};
    for (const char* name : {"_FillValue", "missing_value"})
      if (const ForeignNumber missing = number_at(name); missing.is_number())
        volume_.not_understood.push_back(
            about_missing_samples(object, fmt::format("{}", missing.value), name));
  }
  std::string text_of_flag(const char* name) const {
    const Json& value = member(image_.array.attributes, name);
    return value.is_boolean() ? (value.get<bool>() ? "true" : "false")
                              : text_at(image_.array.attributes, name);
  }

  /// The metadata that tagrid keeps in its files; nothing if there is none, or only another program's.
  std::optional<Metadata> recorded_metadata() const try {
    const Json& header = member(member(image_.attributes, "tagrid"), "nrrd_header");
    if (!header.is_string()) return std::nullopt;
    return parse_metadata(header.get<std::string>());
  } catch (const BrokenInput&) {
    return std::nullopt;
  }

  /// True if the positions of samples are those that tagrid recorded. False for levels that are not the finest
  /// one, and if somebody changed the positions.
  bool has_places_of(const Geometry& recorded) const {
    if (!image_.is_finest) return false;
    const Geometry said = in_one_unit(recorded);
    for (std::size_t i = 0; i < 3; ++i)
      if (spacing_or_1(said, i) != spacing_or_1(volume_.geometry, i) ||
          said.origin[i] != volume_.geometry.origin[i] ||
          length_unit(said.units[i]) != length_unit(volume_.geometry.units[i]))
        return false;
    return true;
  }

  void keep_pairs_of(const Metadata& header) {
    const Geometry& said = header.geometry();
    const KeyValues kept = pairs_without_places(header);
    volume_.pairs.insert(volume_.pairs.begin(), kept.begin(),
                         kept.end());  // of equal keys, the last one counts
    if (said.has_directions || !said.space.empty())
      volume_.warnings.push_back(fmt::format(
          "{}: OME-Zarr: the header that tagrid wrote belongs to another level or to other positions; scale "
          "and translation are used instead, and its directions and coordinate system are left out",
          store_.path()));
  }

  /// A negative scale mirrors the volume, which directions can express. A scale of 0 is treated as
  /// unknown.
  void set_spacing() {
    for (std::size_t i = 0; i < 3; ++i) {
      const double scale = space_[i] ? image_.axes[*space_[i]].scale : Geometry::unknown;
      volume_.geometry.has_spacing = true;
      if (scale == 0)
        volume_.warnings.push_back(
            fmt::format("{}: OME-Zarr: the scale along {} is 0; the distance between samples is unknown",
                        store_.path(), "xyz"[i]));
      else
        volume_.geometry.spacing[i] = std::abs(scale);
      if (scale < 0) volume_.geometry.has_directions = true;
      if (space_[i]) volume_.geometry.directions[i][i] = scale == 0 ? 1 : scale;
    }
    if (!space_[axis_of_z]) volume_.geometry.directions[axis_of_z][axis_of_z] = 1;
  }

  void add_attributes(const std::string& key, const Json& attributes) {
    if (attributes.empty()) return;
    std::string text = attributes.dump(-1, ' ', false, Json::error_handler_t::replace);
    if (text.size() <= most_attributes)
      volume_.pairs.emplace_back(key, std::move(text));
    else
      volume_.warnings.push_back(
          fmt::format("{}: Zarr: its attributes are too long to be kept", store_.path()));
  }

  const ZarrStore& store_;
  const ZarrImage& image_;
  const SpaceAxes& space_;
  ServedVolume& volume_;
};

}  // namespace

std::string shown_path(const ZarrImage& image) {
  return image.array.path.empty() ? "the array" : tagrid::quoted(image.array.path);
}

void describe_image(const ZarrStore& store, const ZarrImage& image, const SpaceAxes& space,
                    ServedVolume& volume) {
  volume.warnings.insert(volume.warnings.end(), image.remarks.begin(), image.remarks.end());
  volume.not_understood.insert(volume.not_understood.end(), image.doubts.begin(), image.doubts.end());
  Describing(store, image, space, volume).run();
}

}  // namespace tagrid
