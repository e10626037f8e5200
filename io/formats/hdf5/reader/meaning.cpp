#include "io/formats/hdf5/reader/meaning.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "io/errors/errors.h"
#include "io/formats/hdf5/attributes.h"
#include "io/formats/hdf5/handle.h"
#include "io/formats/hdf5/reader/axis.h"
#include "io/formats/hdf5/reader/conventions.h"
#include "io/formats/hdf5/reader/datasets.h"
#include "io/formats/hdf5/reader/fields.h"
#include "io/formats/hdf5/reader/links.h"
#include "io/formats/hdf5/reader/nexus.h"
#include "io/programs/words.h"
#include "io/text/foreign_number.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// "xyz" is three names, if there are three axes.
std::vector<std::string> letters_of(std::vector<std::string> names, std::size_t axes) {
  if (names.size() != 1 || names[0].size() != axes || axes < 2) return names;
  std::vector<std::string> letters;
  for (const char letter : names[0]) letters.emplace_back(1, letter);
  return letters;
}

/// The names of axes that HDF5 dimensions have as labels, otherwise those of NeXus, of EMD, of MINC, of Velox,
/// or of vigra and ilastik. `source` becomes the one that has them.
std::vector<std::string> names_of_axes(hid_t group, hid_t dataset, const std::string& path,
                                       std::string& source) {
  source = "DIMENSION_LABELS";
  if (std::vector<std::string> labels = text_list_attribute(dataset, source); !labels.empty()) return labels;
  source = "axes";
  if (std::vector<std::string> names = names_of_nexus_axes(group, dataset); !names.empty())
    return letters_of(std::move(names), dims_of(dataset).size());
  source = "EMD";
  if (std::vector<std::string> names =
          names_of_emd_axes(group, group_and_name(path).second, dims_of(dataset).size());
      !names.empty())
    return names;
  std::vector<std::string> names;
  for (const char* attribute : {"dimorder", "axis_order", "dimension_order"}) {
    source = attribute;
    std::string order = text_attribute(dataset, source).value_or("");
    std::ranges::replace(order, ',', ' ');
    for (const std::string_view name : words_of(order))
      names.emplace_back(name.substr(0, name.find("space")));
    if (names.empty()) names = text_list_attribute(dataset, source);
    if (!names.empty()) return letters_of(std::move(names), dims_of(dataset).size());
  }
  source = "DIMENSION_LIST";
  if (std::vector<std::string> scales = names_of_scales(dataset); !scales.empty()) return scales;
  source = "Velox";
  if (path.starts_with("/Data/Image/") && path.ends_with("/Data")) return {"y", "x", "frame"};
  source = "axistags";
  const auto tags = nlohmann::json::parse(text_attribute(dataset, source).value_or(""), nullptr, false);
  if (!tags.is_object() || !tags.contains("axes")) return {};
  for (const auto& axis : tags["axes"])
    if (axis.is_object() && axis.contains("key") && axis["key"].is_string())
      names.push_back(axis["key"].get<std::string>());
  return names;
}

/// True if an axis is called like another one of a volume, the slowest one first.
bool are_in_another_order(const std::vector<std::string>& names) {
  constexpr std::string_view space = "xyz";
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string name = lower_case(names[i]);
    const std::size_t from_end = names.size() - 1 - i;
    if (name == "c" || name == "t" || name == "channel" || name == "time") return true;
    if (name.size() == 1 && space.find(name) != space.npos && space.find(name) != from_end) return true;
  }
  return false;
}

}  // namespace

bool has_names_of_axes(hid_t file, const std::string& name) {
  const Hdf5Handle dataset = opened_dataset(file, name);
  const Hdf5Handle group = object_at(file, group_and_name(inside("/", name)).first);
  std::string source;
  return names_of_axes(group.get(), dataset.get(), inside("/", name), source).size() ==
         dims_of(dataset.get()).size();
}

std::vector<std::string> other_meanings(hid_t file, const std::string& name, const std::string& object,
                                        Index3 dims, bool are_axes_placed) {
  std::vector<std::string> sentences;
  const auto say = [&](const std::string& what) { sentences.push_back(object + ": " + what); };
  const Hdf5Handle dataset = opened_dataset(file, name);
  const Hdf5Handle type(H5Dget_type(dataset.get()), H5Tclose);
  const std::string path = inside("/", name);
  const Hdf5Handle group = object_at(file, group_and_name(path).first);
  std::string source;
  auto names = names_of_axes(group.get(), dataset.get(), path, source);
  // Axes in front with one sample are left out.
  const auto lengths = dims_of(dataset.get());
  if (names.size() == lengths.size())
    names.erase(
        names.begin(),
        names.begin() + (std::ranges::find_if(lengths, [](hsize_t n) { return n > 1; }) - lengths.begin()));
  if (!are_axes_placed && are_in_another_order(names))
    say(fmt::format("its axes are called {} ({}), the slowest one first, but are read as z, y, x",
                    fmt::join(names, ", "), source));
  const std::string subclass = text_attribute(dataset.get(), "IMAGE_SUBCLASS").value_or("");
  if (subclass == "IMAGE_TRUECOLOR")
    throw BrokenInput(object + " has colors (IMAGE_SUBCLASS is IMAGE_TRUECOLOR), not one value a sample");
  for (const double components : number_attribute(dataset.get(), "ComponentDimensions"))
    if (components > 1)
      throw BrokenInput("{} has {} values a sample (ComponentDimensions), not one", object, components);
  if (subclass == "IMAGE_INDEXED")
    say("its samples are numbers of colors (IMAGE_SUBCLASS is IMAGE_INDEXED), but are read as values");
  if (const auto white = number_attribute(dataset.get(), "IMAGE_WHITE_IS_ZERO");
      !white.empty() && white[0] == 1)
    say("small numbers mean white (IMAGE_WHITE_IS_ZERO); numbers are kept as they are");
  for (const auto& [scale, neutral] : {std::pair("RescaleSlope", 1.0), std::pair("RescaleIntercept", 0.0)})
    if (H5Aexists(dataset.get(), scale) > 0 &&
        number_attribute(dataset.get(), scale) != std::vector<double>{neutral})
      say(fmt::format("{} is {}, which is not applied; numbers are kept as they are", scale,
                      tagrid::quoted(attribute_in_words(dataset.get(), scale))));
  // "/t00000/s00/0/cells"
  if (path.starts_with("/t") && path.ends_with("/cells"))
    say("BigDataViewer keeps the positions of samples in an XML file, which is not read; set the spacing "
        "with --override-spacing");
  if (path.starts_with("/t") && path.ends_with("/cells") && H5Tequal(type.get(), H5T_STD_I16LE) > 0)
    say("BigDataViewer takes these numbers for unsigned ones; they are read as signed ones, as they are "
        "stored");
  const std::array sizes = {dims.x, dims.y, dims.z};
  for (std::size_t axis = 0; group && axis < 3; ++axis) {
    const std::string size = fmt::format("ImageSize{}", "XYZ"[axis]);
    const ForeignNumber number = number_of_letters(group.get(), size);
    if (number.is_number() && number.value != static_cast<double>(sizes[axis]))
      say(fmt::format("{} is {}, but the data set has {}; what is beyond it may be no part of the image",
                      size, number.value, sizes[axis]));
  }
  return sentences;
}

namespace {

/// A slope and an intercept of one convention.
struct NamedScale {
  std::string slope_name, intercept_name;
  AttributeNumbers slope = {}, intercept = {};

  bool is_there() const { return !slope.is_absent() || !intercept.is_absent(); }
  double slope_value() const { return slope.is_number() ? slope.values[0] : 1; }
  double intercept_value() const { return intercept.is_number() ? intercept.values[0] : 0; }
};

bool is_slope(const std::vector<double>& numbers) { return std::isfinite(numbers[0]) && numbers[0] != 0; }

class Scale {
 public:
  Scale(hid_t file, const std::string& path, const std::string& name, ServedVolume& volume)
      : volume_(volume),
        file_(file),
        name_(name),
        path_(path),
        dataset_(opened_dataset(file, name)),
        object_name_(fmt::format("{}: HDF5 file: {}", path, name)) {}

  std::vector<std::string> take() {
    Fields fields(dataset_.get(), object_name_);
    use(attributes(fields, "rescale_slope", "rescale_intercept"), fields);
    use(attributes(fields, "scale_factor", "add_offset"), fields);
    if (is_nexus_signal(file_, name_))
      for (const std::string& prefix : {name_ + "_", name_.substr(0, name_.rfind('/') + 1)})
        use(fields_of_group(prefix), fields);
    if (volume_.rescale != Rescale{}) volume_.rescale.units = units(fields);
    look_at_signs(fields);
    look_at_minc();
    look_at_missing("_FillValue");
    look_at_missing("missing_value");
    if (volume_.rescale == Rescale{}) attributes_.clear();
    volume_.warnings.insert(volume_.warnings.end(), fields.warnings.begin(), fields.warnings.end());
    return std::move(attributes_);
  }

 private:
  static constexpr const char* unknown_values = "how values follow from samples is not known";

  /// Slopes that cannot be read are a doubt, not a warning.
  NamedScale attributes(Fields& fields, const char* slope, const char* intercept) const {
    NamedScale scale = {slope, intercept, foreign_numbers(dataset_.get(), slope, 1),
                        foreign_numbers(dataset_.get(), intercept, 1)};
    // In NRRD, from which this attribute comes, a slope of 0 is none.
    if (std::string_view(slope) == "rescale_slope" && scale.slope.is_number() && scale.slope.values[0] == 0)
      return {slope, intercept};
    if (scale.slope.is_number() && !is_slope(scale.slope.values))
      scale.slope.outcome = ForeignNumber::Outcome::unreadable;
    if (scale.intercept.is_number() && !are_finite(scale.intercept.values))
      scale.intercept.outcome = ForeignNumber::Outcome::unreadable;
    for (const auto& [name, number] :
         {std::pair(slope, &scale.slope), std::pair(intercept, &scale.intercept)})
      if (number->decimal_comma && number->is_number())
        fields.warnings.push_back(fields.remark(name, *number, 1, unknown_values));
    return scale;
  }

  /// NeXus has them as fields beside the data set.
  NamedScale fields_of_group(const std::string& prefix) const {
    return {prefix + "scaling_factor", prefix + "offset", field(prefix + "scaling_factor", is_slope),
            field(prefix + "offset", are_finite)};
  }
  AttributeNumbers field(const std::string& name, bool (*is_good)(const std::vector<double>&)) const {
    AttributeNumbers found;
    if (!has_link(file_, name)) return found;
    const Hdf5Handle dataset = opened_dataset(file_, name);
    const Hdf5Handle space = dataset ? space_of(dataset.get()) : Hdf5Handle();
    found.outcome = ForeignNumber::Outcome::unreadable;
    found.text = dataset ? "no number" : why_missing(file_, name);
    double number = 0;
    if (!space || H5Sget_simple_extent_npoints(space.get()) != 1 || !has_own_samples(path_, dataset.get()) ||
        H5Dread(dataset.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, &number) < 0)
      return found;
    found.text = fmt::format("{}", number);
    found.values = {number};
    if (is_good(found.values)) found.outcome = ForeignNumber::Outcome::number;
    return found;
  }

  void use(const NamedScale& scale, const Fields& fields) {
    if (!scale.is_there()) return;
    for (const auto& [name, number] :
         {std::pair(&scale.slope_name, &scale.slope), std::pair(&scale.intercept_name, &scale.intercept)})
      if (number->is_unreadable()) return doubt(fields.remark(*name, *number, 1, unknown_values));
    const Rescale rescale = {scale.slope_value(), scale.intercept_value()};
    if (scale.slope_name.starts_with('/') && rescale.slope != 1 && rescale.intercept != 0)
      return doubt(fmt::format("{}: {} is {} and {} is {}, and NeXus does not say which comes first; {}",
                               object_name_, scale.slope_name, rescale.slope, scale.intercept_name,
                               rescale.intercept, unknown_values));
    if (has_scale_ && rescale != volume_.rescale)
      return doubt(fmt::format("{}: {} and {} say another scale than its other fields; {}", object_name_,
                               scale.slope_name, scale.intercept_name, unknown_values));
    has_scale_ = true;
    volume_.rescale = rescale;
    for (const std::string& name : {scale.slope_name, scale.intercept_name})
      if (!name.starts_with('/')) attributes_.push_back(name);
  }

  void doubt(std::string sentence) {
    if (volume_.scale_doubt.empty()) volume_.scale_doubt = std::move(sentence);
    volume_.rescale = {};
    attributes_.clear();
    has_scale_ = true;
  }

  std::string units(Fields& fields) {
    if (fields.has("rescale_units")) attributes_.emplace_back("rescale_units");
    const std::string units = fields.text("rescale_units", "the unit of values is not known");
    return units.empty() ? fields.text("units", "the unit of values is not known") : units;
  }

  /// netCDF stores unsigned numbers as signed ones of the same bits.
  void look_at_signs(const Fields& fields) {
    if (!fields.has("_Unsigned")) return;
    const Hdf5Handle type(H5Dget_type(dataset_.get()), H5Tclose);
    const bool is_signed = H5Tget_class(type.get()) == H5T_INTEGER && H5Tget_sign(type.get()) == H5T_SGN_2;
    const std::string text = attribute_in_words(dataset_.get(), "_Unsigned");
    if (H5Tget_class(type.get()) != H5T_INTEGER) return;
    if (std::string why = about_other_sign(object_name_, text, is_signed); !why.empty())
      doubt(std::move(why));
  }

  /// MINC 2 gives the values of each slice a range of their own, beside the data set.
  void look_at_minc() {
    const std::string range = name_ + "-max";
    if (name_.ends_with("/image") && has_link(file_, range))
      doubt(fmt::format("{}: {} gives slices ranges of values (MINC), which is not supported; {}",
                        object_name_, range, unknown_values));
  }

  void look_at_missing(const char* attribute) {
    const AttributeNumbers missing = foreign_numbers(dataset_.get(), attribute, 1);
    // No program takes NaN for a value.
    if (missing.is_absent() || missing.text == "nan") return;
    volume_.not_understood.push_back(about_missing_samples(
        object_name_, missing.text.empty() ? "a certain number" : tagrid::quoted(missing.text), attribute));
  }

  ServedVolume& volume_;
  hid_t file_;
  std::string name_, path_;
  Hdf5Handle dataset_;
  std::string object_name_;
  std::vector<std::string> attributes_ = {};
  bool has_scale_ = false;
};

}  // namespace

std::vector<std::string> set_scale(hid_t file, const std::string& path, const std::string& name,
                                   ServedVolume& volume) {
  return Scale(file, path, inside("/", name), volume).take();
}

}  // namespace tagrid
