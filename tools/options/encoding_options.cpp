#include "tools/options/encoding_options.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/metadata/lengths.h"
#include "io/text/text.h"
#include "pipeline/raw/likelier_reading.h"
#include "tools/options/command_line.h"
#include "tools/report/human_bytes.h"
#include "tools/report/process.h"
#include "tools/report/report.h"

namespace tagrid {
namespace {

/// Nothing if no layout was given.
std::optional<RawDescription> layout_of(const SourceOptions& source) {
  std::vector<std::string_view> given;
  for (const auto& [name, value] : {std::pair("--dims", &source.dims),
                                    {"--type", &source.type},
                                    {"--endian", &source.endian},
                                    {"--offset", &source.offset}})
    if (!value->empty()) given.emplace_back(name);
  if (given.empty()) return std::nullopt;
  if (source.dims.empty() || source.type.empty())
    throw UsageError(
        "{0}: only for samples without a header, and {1} missing: give both --dims and --type; a file of any "
        "other format describes its samples itself: leave out {0}",
        fmt::join(given, ", "),
        source.dims.empty() ? source.type.empty() ? "--dims and --type are" : "--dims is" : "--type is");
  RawDescription raw;
  raw.dims = dims_option(source.dims);
  raw.type = sample_type_option(source.type);
  if (!source.endian.empty()) raw.big_endian = source.endian == "big";
  if (const std::string& offset = source.offset; !offset.empty()) {
    const auto bytes = byte_count(offset);
    if (!bytes || offset.find('.') != offset.npos)
      throw UsageError("--offset: {}: must be a whole number of bytes, optionally with K, M, G or T", offset);
    raw.offset = *bytes;
  }
  return raw;
}

std::optional<GivenSpacing> spacing_of(const SourceOptions& source) {
  const bool overrides = !source.override_spacing.empty();
  const std::string& text = overrides ? source.override_spacing : source.spacing;
  if (text.empty()) return std::nullopt;
  require(!overrides || source.spacing.empty(), "--spacing and --override-spacing: give only one of them");
  auto given = given_spacing(text);
  if (!given)
    throw UsageError(
        "--{} {}: must be one number above 0, or three of them (X,Y,Z), optionally with a unit: 10um, "
        "or 0.5,0.5,1.25mm{}",
        overrides ? "override-spacing" : "spacing", text, hint_of_decimal_comma(text, given_spacing));
  given->overrides = overrides;
  return given;
}

const OptionRow& row_named(const std::string& name) {
  std::vector<std::string> names;
  for (const OptionRow& row : encoding_rows()) {
    if (row.name == name) return row;
    names.push_back(row.name);
  }
  if (const auto meant = nearest(name, names))
    throw UsageError("unknown option --{}; did you mean --{}?", name, *meant);
  throw UsageError("unknown option --{}; the options of a volume are --{}", name, fmt::join(names, ", --"));
}

std::string in_words(SampleType type, bool big_endian) {
  const char* order = size_of(type) == 1 ? "" : big_endian ? " --endian big" : " --endian little";
  return fmt::format("--type {}{}", name_of(type), order);
}

std::string doubt(const RawDescription& given, const LikelierReading& likelier) {
  const std::string as_given = in_words(given.type, given.big_endian.value_or(false));
  if (likelier.sample_bytes == size_of(given.type))
    return fmt::format("looks far more like a volume with {} than with {}; check the type and the byte order",
                       in_words(likelier.type, likelier.big_endian), as_given);
  return fmt::format("looks far more like samples of {} than like {}; check the type and the dims",
                     counted(likelier.sample_bytes, "byte"), as_given);
}

// Errors of integers are integers. Where a slope is known, EncodeResult::reason_of_bound says what is kept.
std::vector<std::string> rounded_bounds(const EncodeOptions& asked, const EncodeResult& result) {
  const CodingParameters& p = result.header.parameters;
  std::vector<std::string> warnings;
  if (is_float_type(p.type) || std::abs(result.header.metadata.rescale_of_bounds().slope) != 1)
    return warnings;
  for (const auto& [bound, given] : {std::pair(&setting::max_error, asked.max_error),
                                     {&setting::surface_error, asked.surface_error},
                                     {&setting::mesh_error, asked.mesh_error}}) {
    if (!given || *given == kept_bound(*given, p.type)) continue;
    const bool is_lossless = bound == &setting::max_error && p.is_exact();
    warnings.push_back(fmt::format("--{} {}: samples are integers, so this is {}{}", bound->name, *given,
                                   kept_bound(*given, p.type), is_lossless ? " (lossless)" : ""));
  }
  return warnings;
}

// Which distances between samples are missing, and how to add them; "" if none is. The example
// contains the known distances, because --spacing must agree with them.
std::string doubt_of_voxel_size(const EncodeResult& result) {
  if (result.missing_of_voxel_size.empty()) return "";
  const Geometry geometry = in_one_unit(result.header.metadata.geometry());
  const CommonUnit unit = common_unit(geometry);
  std::string example, letters;
  for (std::size_t axis = 0; axis < 3 && geometry.has_spacing; ++axis) {
    const char letter = "XYZ"[axis];
    const bool is_known = !std::isnan(geometry.spacing[axis]);
    if (!is_known) letters += (letters.empty() ? "" : " and ") + std::string(1, letter);
    example += (example.empty() ? "" : ",") +
               (is_known ? fmt::format("{}", std::abs(geometry.spacing[axis])) : std::string(1, letter));
  }
  example = example.empty() ? "10um" : example + (unit.name.empty() ? "um" : unit.name);
  const bool lacks_unit = geometry.has_spacing && letters.empty();
  return fmt::format("{}; {}add it with --spacing, such as --spacing {}{}", result.missing_of_voxel_size,
                     lacks_unit ? "" : "meshes and other programs assume 1; ", example,
                     letters.empty() ? "" : fmt::format(" with a number for {}", letters));
}

std::string doubt_of_lossy_source(const EncodeResult& result) {
  if (result.lossy_source.empty() || result.bytes_in == 0 || result.file_bytes <= result.bytes_in) return "";
  const double more = static_cast<double>(result.file_bytes) / static_cast<double>(result.bytes_in) - 1;
  return fmt::format(
      "the source was already compressed with loss ({}), and the .tag file is {:.{}f} % larger; keep the "
      "source instead, or give a bound with --max-error",
      result.lossy_source, 100 * more, more < 0.1 ? 1 : 0);
}

/// The value of an option, if it was given.
std::optional<std::string> given(const std::string& value) {
  return value.empty() ? std::nullopt : std::optional(value);
}

}  // namespace

TellOfCopy tell_of_copy(const RunOptions& run) {
  if (run.quiet) return {};
  return [](const SampleCopy& copy) {
    say("tagrid: {}: is read more than once, so its samples ({}) are first copied to {}; to use another "
        "directory, add --spool DIR",
        copy.volume, human_bytes(copy.bytes), copy.folder);
  };
}

std::string_view plain_ratio(std::string_view text) {
  return text.ends_with(":1") ? text.substr(0, text.size() - 2) : text;
}

std::optional<std::uint32_t> parity_option(const std::string& option, const std::string& text) {
  if (text == "none") return std::nullopt;
  const auto number = finite_number(text.ends_with('%') ? text.substr(0, text.size() - 1) : text);
  if (!number || !(*number >= 0.1 && *number <= 100))
    throw UsageError("{}: {}: must be a share from 0.1% to 100%, such as 5%, or none", option, text);
  return static_cast<std::uint32_t>(std::lround(*number * 1000));
}

Index3 dims_option(const std::string& dims) {
  const auto sizes = three_sizes(dims);
  if (!sizes) throw UsageError("--dims {}: must be three whole numbers from 1 to 2^31: X,Y,Z", dims);
  return *sizes;
}

SampleType sample_type_option(const std::string& name) {
  if (const auto type = sample_type_named(name)) return *type;
  throw UsageError("--type {}: must be uint8, int8, uint16, int16, uint32, int32, float32 or float64", name);
}

SourceDescription SourceOptions::description() const {
  SourceDescription description(layout_of(*this), given(vdb_grid));
  description.spacing = spacing_of(*this);
  description.from = given(from);
  description.series = given(series);
  description.dataset = given(dataset);
  description.gaps_ok = gaps_ok;
  description.data_outside = data_outside;
  return description;
}

Encoding EncodingOptions::checked(const RunOptions& run) const {
  Encoding encoding{options, run.limited(source.description())};
  if (range == "auto") {
    encoding.options.range_from_data = true;
  } else if (!range.empty()) {
    encoding.options.range = value_range(range);
    if (!encoding.options.range)
      throw UsageError("--range {}: must be lo:hi or auto{}", range,
                       hint_of_decimal_comma(range, [](auto given) { return value_range(given); }));
  }
  const bool both_hold = options.max_error && rules.contains(ErrorRule::Kind::psnr);
  require(rules.size() + options.max_error.has_value() - both_hold <= 1,
          "--max-error, --relative-error, --psnr, --ratio and --bits all set the errors; give only one, or "
          "--psnr with a number as --max-error");
  for (const auto& [kind, value] : rules) encoding.options.error_rule = ErrorRule{kind, value};
  encoding.options.validate();
  return encoding;
}

OptionTexts encoding_options_given(const CLI::App& command) {
  OptionTexts texts;
  for (const OptionRow& row : encoding_rows()) {
    const CLI::Option* given = command.get_option_no_throw("--" + row.name);
    if (given != nullptr && given->count() > 0) texts[row.name] = given->results().back();
  }
  return texts;
}

Encoding encoding_of(const OptionTexts& texts, const RunOptions& run) {
  EncodingOptions options;
  for (const auto& [name, value] : texts) set_row(row_named(name), options, value);
  Encoding encoding = options.checked(run);
  encoding.source.all_volumes = true;
  return encoding;
}

std::string doubt_of_description(const std::string& input, const RawDescription& description) {
  if (!is_regular_input(input)) return "";  // a pipe can be read once
  // If samples are misread, no order of dims looks better than another.
  if (const auto reading = likelier_reading(input, description))
    return input + ": " + doubt(description, *reading);
  const auto likelier = likelier_dims(input, description);
  if (!likelier) return "";
  const Index3 &given = description.dims, &other = *likelier;
  return fmt::format(
      "{}: looks far smoother with --dims {},{},{} than with {},{},{}; check their order (x is the fastest)",
      input, other.x, other.y, other.z, given.x, given.y, given.z);
}

std::string lost_structure(const TagHeader& header, const Statistics& total) {
  const double bound = header.parameters.max_error;
  if (!(total.max_error > 0 && bound >= total.high - total.low)) return "";
  return fmt::format(
      "a maximum error of {} is not below the range of the samples, so structure, such as that of a mask, "
      "may be lost",
      bound);
}

std::vector<std::string> warnings_of_encoding(const std::string& input, const EncodeOptions& asked,
                                              const EncodeResult& result) {
  std::vector<std::string> warnings = result.warnings;
  const auto add = [&](const std::string& warning) {
    if (!warning.empty()) warnings.push_back(fmt::format("{}: {}", shown_input(input), warning));
  };
  add(doubt_of_voxel_size(result));
  for (const std::string& warning : rounded_bounds(asked, result)) add(warning);
  // Other files have a grid as well, but few users need a mesh; the commands that make one warn.
  const bool is_chosen = asked.range || asked.range_from_data || asked.field_scale;
  if (result.header.parameters.mode == FileMode::grid && !is_chosen)
    add(doubt_of_range(result.header, result.index.total));
  add(doubt_of_lossy_source(result));
  add(lost_structure(result.header, result.index.total));
  return warnings;
}

}  // namespace tagrid
