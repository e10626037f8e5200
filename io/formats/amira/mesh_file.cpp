#include "io/formats/amira/mesh_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/formats/amira/byte_runs.h"
#include "io/metadata/foreign_geometry.h"
#include "io/samples/file_samples.h"
#include "io/text/foreign_number.h"
#include "io/text/text.h"
#include "io/volume/given_spacing.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {
namespace {

using namespace std::string_view_literals;

constexpr std::size_t max_header_bytes = std::size_t{1} << 20;

constexpr std::array types = {
    std::pair{"byte"sv, SampleType::uint8},    std::pair{"sbyte"sv, SampleType::int8},
    std::pair{"ushort"sv, SampleType::uint16}, std::pair{"short"sv, SampleType::int16},
    std::pair{"uint"sv, SampleType::uint32},   std::pair{"int"sv, SampleType::int32},
    std::pair{"uint32"sv, SampleType::uint32}, std::pair{"int32"sv, SampleType::int32},
    std::pair{"float"sv, SampleType::float32}, std::pair{"double"sv, SampleType::float64}};

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

/// A word, a text between quotes, or one of { } = ,. Views of the text.
struct Tokens {
  std::vector<std::string_view> words;
  std::size_t at = 0;

  std::string_view peek(std::size_t ahead = 0) const {
    return at + ahead < words.size() ? words[at + ahead] : std::string_view();
  }
  std::string_view take() { return at < words.size() ? words[at++] : std::string_view(); }
};

Tokens tokens_of(std::string_view text) {
  constexpr std::string_view single = "{}=,";
  Tokens tokens;
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    std::size_t end = i + 1;
    if (is_space(c)) {
      ++i;
      continue;
    }
    if (c == '#') {
      i = std::min(text.find('\n', i), text.size());
      continue;
    }
    if (c == '"') {
      end = std::min(text.find('"', i + 1), text.size() - 1) + 1;
    } else if (single.find(c) == single.npos) {
      // "@1(HxZip,123)" is one word.
      const bool is_number_of_data = c == '@';
      while (end < text.size() && !is_space(text[end]) && text[end] != '{' && text[end] != '}' &&
             (is_number_of_data || single.find(text[end]) == single.npos))
        ++end;
    }
    tokens.words.push_back(text.substr(i, end - i));
    i = end;
  }
  return tokens;
}

std::string_view unquoted(std::string_view word) {
  if (word.size() >= 2 && word.starts_with('"') && word.ends_with('"'))
    return word.substr(1, word.size() - 2);
  return word;
}

/// What the text says, in its own words.
struct Statements {
  std::vector<std::string_view> lattice, box;
  std::string_view coordinates, unit, content;
  std::string_view type, data;  ///< of the samples: "float", and "@1(HxZip,123)"
  std::string_view parameters;  ///< the text of that section
  bool has_other_data = false;
  bool is_transformed = false;  ///< by a matrix that is not applied here
};

constexpr std::array identity = {1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.};

Statements statements_of(std::string_view text) {
  Statements said;
  Tokens tokens = tokens_of(text);
  int depth = 0;
  const char* parameters = nullptr;
  while (tokens.at < tokens.words.size()) {
    const std::string_view word = tokens.take();
    if (word == "{") {
      ++depth;
    } else if (word == "}") {
      if (--depth == 0 && parameters != nullptr) {
        said.parameters = {parameters, static_cast<std::size_t>(word.data() - parameters)};
        parameters = nullptr;
      }
    } else if (depth == 0 && word == "define") {
      std::vector<std::string_view> sizes;
      const std::string_view name = tokens.take();
      while (!tokens.peek().empty() && is_digit(tokens.peek()[0])) sizes.push_back(tokens.take());
      if (name == "Lattice") said.lattice = std::move(sizes);
    } else if (depth == 0 && word == "Parameters" && tokens.peek() == "{") {
      parameters = tokens.peek().data() + 1;
    } else if (depth == 0 && tokens.peek() == "{" && tokens.peek(3) == "}") {
      const std::string_view type = tokens.peek(1);
      tokens.at += 4;
      if (tokens.peek() == "=") tokens.take();
      const std::string_view data = tokens.take();
      said.has_other_data = said.has_other_data || !said.data.empty() || word != "Lattice";
      if (word != "Lattice" || !said.data.empty()) continue;
      said.type = type;
      said.data = data;
    } else if (depth == 1 && word == "BoundingBox") {
      said.box.clear();
      while (said.box.size() < 6 && !tokens.peek().empty() && tokens.peek() != "," && tokens.peek() != "}")
        said.box.push_back(tokens.take());
    } else if (depth == 1 && word == "TransformationMatrix") {
      for (const double one : identity)
        said.is_transformed = number_of(tokens.take()) != one || said.is_transformed;
    } else if (depth == 1 && word == "CoordType") {
      said.coordinates = unquoted(tokens.take());
    } else if (depth == 1 && word == "Content") {
      said.content = unquoted(tokens.take());
    } else if (depth == 2 && word == "Coordinates") {
      said.unit = unquoted(tokens.take());
    }
  }
  return said;
}

[[noreturn]] void refuse(std::string_view what, std::string_view value, std::string_view why) {
  throw BrokenInput("AmiraMesh header: {} {}: {}", what, quoted(value), why);
}

Index3 dims_of(const Statements& said) {
  std::array<std::int64_t, 3> sizes = {};
  if (said.lattice.size() != 3)
    throw BrokenInput(
        "AmiraMesh header: it has no lattice of three axes; only volumes with uniform coordinates are "
        "supported");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto size = whole_number_of(said.lattice[axis]);
    if (!size || *size < 1) refuse("Lattice", said.lattice[axis], "must be a positive number");
    sizes[axis] = *size;
  }
  return {sizes[0], sizes[1], sizes[2]};
}

bool is_big_endian(std::string_view first_line) {
  const auto words = words_of(first_line);
  if (std::ranges::find(words, "BINARY-LITTLE-ENDIAN"sv) != words.end()) return false;
  if (std::ranges::find(words, "BINARY"sv) != words.end() ||
      std::ranges::find(words, "BINARY-BIG-ENDIAN"sv) != words.end())
    return true;
  if (std::ranges::find(words, "ASCII"sv) != words.end())
    refuse("the first line", first_line, "samples as text are not supported; save the file as binary");
  refuse("the first line", first_line, "does not say how samples are stored");
}

/// "(HxZip,123)" after the number of the data.
void read_encoding(std::string_view data, AmiraHeader& header) {
  const std::size_t open = data.find('(');
  if (open == data.npos) return;
  header.encoding_text = data.substr(open);
  const std::size_t comma = data.find(','), end = data.find_first_of(",)", open);
  const std::string_view name = data.substr(open + 1, end - open - 1);
  const std::string_view number =
      comma == data.npos ? "" : data.substr(comma + 1, data.size() - comma - (data.ends_with(')') ? 2 : 1));
  if (name == "HxZip")
    header.encoding = AmiraEncoding::zip;
  else if (name == "HxByteRLE" && size_of(header.info.type) == 1)
    header.encoding = AmiraEncoding::byte_runs;
  else
    refuse("Lattice", data, "samples stored like this are not supported; save the file uncompressed");
  constexpr std::uint64_t too_many = std::uint64_t{1} << 62;
  header.encoded_bytes = entire<std::uint64_t>(trimmed(number)).value_or(too_many);
  if (header.encoded_bytes >= too_many) refuse("Lattice", data, "must have the number of its bytes");
}

/// The box reaches from the first sample to the last one.
Geometry geometry_of(const Statements& said, const Index3& dims, std::vector<std::string>& warnings) {
  Geometry geometry;
  if (said.box.empty()) return geometry;
  std::string text;
  for (const std::string_view word : said.box) text += fmt::format("{}{}", text.empty() ? "" : " ", word);
  const ForeignNumbers box = foreign_numbers(text, 6);
  if (const std::string remark = remark_on(box, "BoundingBox", "spacing is unknown"); !remark.empty())
    warnings.push_back("AmiraMesh header: " + remark);
  if (!box.are_numbers()) return geometry;
  const std::array<std::int64_t, 3> sizes = {dims.x, dims.y, dims.z};
  std::vector<ForeignNumber> distances(3);
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (sizes[axis] > 1)
      distances[axis] = foreign_number((box.numbers[2 * axis + 1].value - box.numbers[2 * axis].value) /
                                       static_cast<double>(sizes[axis] - 1));
  set_spacing(distances, {"AmiraMesh header: BoundingBox"}, NegativeSpacing::is_unknown, geometry, warnings);
  if (geometry.has_spacing) geometry.units.fill(std::string(said.unit));
  if (has_unknown_spacing(geometry)) return geometry;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    geometry.directions[axis][axis] = geometry.spacing[axis];
    geometry.origin[axis] = box.numbers[2 * axis].value;
  }
  geometry.has_directions = geometry.has_origin = true;
  return geometry;
}

/// The text up to the line with the number of the data that begin there.
std::string read_text(FileBytes& file) {
  std::string text;
  for (std::size_t line_start = 0;; line_start = text.size()) {
    if (!file.read_line(text, max_header_bytes - text.size()))
      throw BrokenInput("{}: its header does not end within {} bytes", file.name(), max_header_bytes);
    const std::string_view line = trimmed(std::string_view(text).substr(line_start));
    if (line.empty() && line_start == text.size())
      throw BrokenInput(file.name() + ": ends within its header");
    const std::string_view word = line.substr(0, line.find_last_not_of("\n\r ") + 1);
    if (word.size() > 1 && word[0] == '@' && std::ranges::all_of(word.substr(1), is_digit)) return text;
  }
}

/// True if nothing but an end of a line follows byte `end`.
bool ends_with_line(const FileBytes& file, std::uint64_t end) {
  if (!file.size() || *file.size() <= end || *file.size() - end > 2) return false;
  std::array<std::byte, 2> last = {std::byte{'\n'}, std::byte{'\n'}};
  file.read_at(end, last.data(), static_cast<std::size_t>(*file.size() - end));
  return std::ranges::all_of(last, [](std::byte b) { return b == std::byte{'\n'} || b == std::byte{'\r'}; });
}

}  // namespace

AmiraHeader parse_amira_header(std::string_view text) {
  AmiraHeader header;
  std::string_view rest = text;
  header.big_endian = is_big_endian(take_line(rest));
  const Statements said = statements_of(text.substr(0, text.rfind('@')));
  header.info.dims = dims_of(said);
  if (!said.coordinates.empty() && lower_case(said.coordinates) != "uniform")
    refuse("CoordType", said.coordinates, "only uniform coordinates are supported");
  if (said.has_other_data || said.data.empty())
    throw BrokenInput("AmiraMesh header: the file must have the samples of one volume, and has {}",
                      said.data.empty() ? "none" : "more data");
  const auto type = std::ranges::find(types, said.type, &std::pair<std::string_view, SampleType>::first);
  if (type == types.end())
    refuse("Lattice", said.type, "samples of this type are not supported, only scalars of 8, 16 and 32 bits");
  header.info.type = type->second;
  if (!sample_bytes(header.info.dims, header.info.type) || !is_volume_size(header.info.dims))
    throw BrokenInput("AmiraMesh header: a volume cannot have {} samples",
                      described(header.info.dims, header.info.type));
  const std::string_view begins = text.substr(std::min(text.rfind('@'), text.size()));
  if (said.data.substr(0, said.data.find('(')) != begins.substr(0, begins.find_last_not_of("\r\n ") + 1))
    refuse("Lattice", said.data, "its samples must come first");
  read_encoding(said.data, header);
  KeyValues pairs;
  if (!said.content.empty()) pairs.emplace_back("amira_content", said.content);
  if (!trimmed(said.parameters).empty()) pairs.emplace_back("amira_parameters", said.parameters);
  if (said.is_transformed)
    header.warnings.emplace_back("AmiraMesh header: its TransformationMatrix is not applied");
  header.info.metadata = Metadata(geometry_of(said, header.info.dims, header.warnings), pairs);
  return header;
}

std::unique_ptr<VolumeSource> open_amira(std::unique_ptr<FileBytes> file, const std::string& path,
                                         const SourceDescription&) {
  const std::string name = file->name();
  const std::string text = read_text(*file);
  AmiraHeader header;
  try {
    header = parse_amira_header(text);
  } catch (const BrokenInput& broken) {
    throw BrokenInput("{}: {}", name, broken.what());
  }
  SourceFacts facts;
  facts.info = header.info;
  facts.files = {path};
  for (const std::string& warning : header.warnings)
    facts.warnings.push_back(fmt::format("{}: {}", name, warning));
  facts.holds_other_bytes = true;
  facts.missing_of_voxel_size = missing_of_voxel_size(facts.info.geometry(), true);
  SamplesPlace place{.start = text.size(), .big_endian = header.big_endian};
  if (header.encoding == AmiraEncoding::plain) {
    const std::uint64_t end = place.start + *sample_bytes(facts.info.dims, facts.info.type);
    place.may_go_on = !file->size() || ends_with_line(*file, end);
    if (!place.may_go_on) allow_more(*file, place, facts);
    return plain_samples(std::move(facts), std::move(file), place);
  }
  // As its plain form has it.
  const auto at = static_cast<std::size_t>(header.encoding_text.data() - text.data());
  const std::string plain = text.substr(0, at) + text.substr(at + header.encoding_text.size());
  if (header.encoding == AmiraEncoding::byte_runs)
    return byte_runs(std::move(facts), std::move(file), {text.size(), header.encoded_bytes}, plain);
  return compressed_samples(
      std::move(facts), std::move(file), place, 0,
      [path, plain] {
        return PlainFile{path, true, {PlainPiece::given(plain)}};
      },
      Compression::zlib);
}

}  // namespace tagrid
