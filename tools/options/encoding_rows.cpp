// The table of the options of a volume: how to encode it, and how to read its input.
#include <algorithm>
#include <type_traits>

#include "io/text/text.h"
#include "tools/options/encoding_options.h"

namespace tagrid {
namespace {

using Set = decltype(OptionRow::set);

constexpr const char* kept = "Bounds and content";
constexpr const char* grid = "The grid";
constexpr const char* headerless = "Headerless input";
constexpr const char* voxels = "Voxel size";
constexpr const char* other_formats = "Other input formats";

template <class Value>
void read_value(const std::string& option, const std::string& text, Value& value) {
  if constexpr (std::is_same_v<Value, std::string>) {
    value = text;
  } else if constexpr (std::is_same_v<Value, bool>) {
    if (text != "true" && text != "false") throw UsageError(option + ": " + text + ": must be true or false");
    value = text == "true";
  } else {
    read_number(option, text, value);
  }
}

template <class Value>
Set to(Value EncodeOptions::*member) {
  return [member](EncodingOptions& o, const std::string& option, const std::string& text) {
    read_value(option, text, o.options.*member);
  };
}

template <class Value>
Set to(Value SourceOptions::*member) {
  return [member](EncodingOptions& o, const std::string& option, const std::string& text) {
    read_value(option, text, o.source.*member);
  };
}

Set to(ErrorRule::Kind kind) {
  return [kind](EncodingOptions& o, const std::string& option, const std::string& text) {
    const std::string_view number = kind == ErrorRule::Kind::ratio ? plain_ratio(text) : text;
    read_number(option, std::string(number), o.rules[kind]);
  };
}

/// For words that are among `names`, in the order of the values of Value.
template <class Value, class Member, class Names>
Set to(Member EncodeOptions::*member, const Names& names) {
  return [member, &names](EncodingOptions& o, const std::string&, const std::string& word) {
    o.options.*member = static_cast<Value>(std::ranges::find(names, word) - names.begin());
  };
}

// A number, or noise:K. Of several the last counts.
void set_max_error(EncodingOptions& o, const std::string& option, const std::string& text) {
  constexpr std::string_view noise = "noise:";
  o.options.max_error.reset();
  o.rules.erase(ErrorRule::Kind::noise);
  if (text.starts_with(noise))
    read_number(option + " noise", text.substr(noise.size()), o.rules[ErrorRule::Kind::noise]);
  else if (text.find("noise") != std::string::npos || text.ends_with('%'))
    throw UsageError(
        "{}: {}: must be a finite number, such as 0.5, or noise:K for K times the noise; a part of the range "
        "of the samples is --relative-error R",
        option, text);
  else
    read_number(option, text, o.options.max_error);
}

void set_overviews(EncodingOptions& o, const std::string& option, const std::string& text) {
  o.options.overviews.reset();
  if (text == "auto") return;
  std::vector<int>& factors = o.options.overviews.emplace();
  if (text == "none") return;
  for (const std::string_view part : split(text, ',')) {
    const auto factor = whole_number<int>(part);
    if (!factor)
      throw UsageError("{}: {}: must be auto, none, or factors with commas between them, such as 4,16",
                       option, text);
    factors.push_back(*factor);
  }
}

void set_range(EncodingOptions& o, const std::string&, const std::string& text) { o.range = text; }

void set_thresholds(EncodingOptions& o, const std::string& option, const std::string& text) {
  o.options.thresholds.clear();
  for (const std::string_view part : split(text, ',')) {
    const auto number = finite_number(part);
    if (!number) throw UsageError("{} {}: must be numbers, such as 300 or -500,300", option, text);
    o.options.thresholds.push_back(*number);
  }
  std::ranges::sort(o.options.thresholds);
}

void set_parity(EncodingOptions& o, const std::string& option, const std::string& text) {
  o.options.parity = parity_option(option, text);
}

OptionRow row(std::string_view name, const char* group, const char* value, const char* help, Set set,
              std::vector<std::string> words = {}) {
  return {std::string(name), group, value, help, std::move(set), std::move(words)};
}

std::vector<OptionRow> all_rows() {
  using E = EncodeOptions;
  using S = SourceOptions;
  return {
      row("max-error", kept, "E|noise:K",
          "Maximum error of any voxel; 0, the default, is lossless; noise:K is K times the noise",
          set_max_error),
      row(setting::relative_error.name, kept, "R", "Maximum error as a fraction of the range of the samples",
          to(ErrorRule::Kind::relative)),
      row(setting::psnr.name, kept, "D",
          "Smallest file with a PSNR of at least D dB; may be combined with --max-error E",
          to(ErrorRule::Kind::psnr)),
      row(setting::ratio.name, kept, "R", "Best PSNR in a file R times smaller than the samples: 40, or 40:1",
          to(ErrorRule::Kind::ratio)),
      row(setting::bits.name, kept, "B", "Best PSNR in a file of B bits per voxel",
          to(ErrorRule::Kind::bits)),
      row(setting::threshold.name, kept, "T[,T2,...]",
          "No voxel changes its side of these values (>= T, or < T), whatever the error allows",
          set_thresholds),
      row("effort", kept, "fast|default|best",
          "Trade time for size; no effect on bricks whose values span more than 65536 units",
          to<Effort>(&E::effort, effort_names), {"fast", "default", "best"}),
      row(setting::overviews.name, kept, "none|auto|4,16,...",
          "Downsampled copies for quick viewing, by factor (powers of 4, up to 1024); auto, the default: if "
          "an axis has more than 512 samples. For label maps, use none: means of labels have no meaning",
          set_overviews),
      row(setting::parity.name, kept, "P%|none",
          "Add parity, P % of the file, from which repair rebuilds damaged stretches (default: none)",
          set_parity),
      row("strip", kept, "", "Drop metadata except geometry: names, dates, ...", to(&E::strip)),
      row("grid", kept, "stored|derived",
          "stored, the default: that of the original; derived, the default with --psnr, --ratio and --bits: "
          "recomputed from decoded voxels",
          to<GridOrigin>(&E::grid, grid_origin_names), {"stored", "derived"}),
      row("grid-only", kept, "", "Store only the adaptive grid; voxels between its points are interpolated",
          to(&E::grid_only)),
      row(setting::mesh_error.name, kept, "E",
          "Refine the mesh until interpolating it is within E of every voxel (E >= --surface-error or "
          "--max-error)",
          to(&E::mesh_error)),
      row(setting::surface_error.name, kept, "F",
          "Smaller maximum error at the vertices of the mesh (needs --max-error)", to(&E::surface_error)),
      row(setting::accuracy.name, grid, "m",
          "How finely the mesh follows curved surfaces; larger is finer (default: 20)", to(&E::accuracy)),
      row(setting::range.name, grid, "lo:hi|auto",
          "Values that matter; a narrower range makes a finer mesh; auto: the range of the data", set_range),
      row(setting::max_level.name, grid, "n", "Refine no further than level n", to(&E::max_level)),
      row(setting::brick.name, grid, "N",
          "Edge of a brick in root cubes (default: 64/S, with --psnr, --ratio and --bits 128/S; at least 2)",
          to(&E::brick_edge)),
      row(setting::cube.name, grid, "S", "Edge of a root cube: a power of two from 4 to 256 (default: 32)",
          to(&E::cube_size)),
      row(setting::field_scale.name, grid, "lambda", "Voxels of height per unit of value, instead of --range",
          to(&E::field_scale)),
      row(setting::lead.name, grid, "0|1", "For experts: the first plane of the lattice, 1 (default) or 0",
          to(&E::lead)),
      row("dims", headerless, "X,Y,Z", "Samples along x (fastest), y and z", to(&S::dims)),
      row("type", headerless, "TYPE",
          "Sample type: uint8, int8, uint16, int16, uint32, int32, float32 or float64", to(&S::type)),
      row("endian", headerless, "little|big", "Byte order of the samples (default: little)", to(&S::endian),
          {"little", "big"}),
      row("offset", headerless, "BYTES", "Bytes before the first sample; K, M, G and T are powers of 1024",
          to(&S::offset)),
      row("spacing", voxels, "X[,Y,Z][UNIT]",
          "Distance of samples, where the input does not state it: 10um, 0.5,0.5,1.25mm", to(&S::spacing)),
      row("override-spacing", voxels, "X[,Y,Z][UNIT]", "The same, but replaces what the input states",
          to(&S::override_spacing)),
      row("from", other_formats, "FORMAT",
          "Format of the input (default: from its content, then its name); see tagrid formats", to(&S::from)),
      row("series", other_formats, "NAME|N",
          "One of several series or volumes, by name or number; all: the volumes of a file", to(&S::series)),
      row("dataset", other_formats, "PATH", "Data set of a file that has several", to(&S::dataset)),
      row("gaps-ok", other_formats, "",
          "Read a directory although slice numbers are missing or DICOM images are unreadable",
          to(&S::gaps_ok)),
      row("data-outside", other_formats, "",
          "Read data files outside the directory of the header that names them", to(&S::data_outside)),
      row("vdb-grid", other_formats, "NAME", "Grid of an OpenVDB file that has several", to(&S::vdb_grid)),
  };
}

void add_row(CLI::App& command, const OptionRow& row, EncodingOptions& options) {
  const std::string name = "--" + row.name;
  const auto set = [&row, &options, name](const std::string& text) { row.set(options, name, text); };
  CLI::Option* option = nullptr;
  if (row.value.empty())
    option = command.add_flag_function(
        name, [set](std::int64_t count) { set(count > 0 ? "true" : "false"); }, row.help);
  else
    option = command.add_option_function<std::string>(name, set, row.help)->option_text(row.value);
  if (!row.words.empty()) option->check(one_of(row.words));
  option->group(row.group);
}

}  // namespace

const std::vector<OptionRow>& encoding_rows() {
  static const std::vector<OptionRow> rows = all_rows();
  return rows;
}

void set_row(const OptionRow& row, EncodingOptions& options, const std::string& text) {
  if (!row.words.empty())
    if (const std::string wrong = one_of(row.words)(text); !wrong.empty())
      throw UsageError("--" + row.name + ": " + wrong);
  row.set(options, "--" + row.name, text);
}

void add_encoding_options(CLI::App& command, EncodingOptions& options, const std::vector<std::string>& but) {
  for (const OptionRow& row : encoding_rows())
    if (std::ranges::find(but, row.name) == but.end()) add_row(command, row, options);
}

void add_source_options(CLI::App& command, EncodingOptions& options) {
  for (const OptionRow& row : encoding_rows())
    if (row.group == headerless || row.group == voxels || row.group == other_formats)
      add_row(command, row, options);
}

CLI::Option* add_dims_option(CLI::App& command, std::string& dims) {
  const auto& rows = encoding_rows();
  const auto row = std::ranges::find(rows, "dims", &OptionRow::name);
  return command.add_option("--" + row->name, dims, row->help)->option_text(row->value);
}

}  // namespace tagrid
