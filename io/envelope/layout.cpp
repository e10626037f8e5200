#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <set>

#include "io/bytes/little_endian.h"
#include "io/envelope/envelope.h"
#include "io/files/byte_source.h"
#include "io/files/errors.h"
#include "io/samples/stored_bits.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// The names of the files in the deepest folder that has them all.
std::vector<std::string> names_in_common_folder(const std::vector<std::string>& paths) {
  std::vector<fs::path> whole;
  for (const std::string& path : paths) whole.push_back(fs::absolute(path).lexically_normal());
  fs::path common = whole.front().parent_path();
  for (const fs::path& path : whole) {
    fs::path shared;
    for (auto a = common.begin(), b = path.begin(); a != common.end() && b != path.end() && *a == *b;
         ++a, ++b)
      shared /= *a;
    common = shared;
  }
  std::vector<std::string> names;
  for (const fs::path& path : whole) names.push_back(path.lexically_relative(common).string());
  return names;
}

/// The number of `used` bits that is nearest to `bits`. Only an encoding with an error makes others.
template <class Bits>
Bits nearest_of_range(Bits bits, const StoredBits& stored, Bits used) {
  const auto half = static_cast<Bits>((used >> 1) + 1);
  const auto low = static_cast<Bits>(stored.is_signed ? -half : 0),
             high = static_cast<Bits>(stored.is_signed ? half - 1 : used);
  if (static_cast<Bits>(bits - low) <= used) return bits;
  return static_cast<Bits>(bits - high) < static_cast<Bits>(low - bits) ? high : low;
}

template <class Bits>
void to_stored_bits(const SlicesInFile& slices, std::byte* samples, std::size_t count) {
  const StoredBits& stored = slices.run.stored;
  const int unused = stored.bits == 0 ? 0 : static_cast<int>(8 * sizeof(Bits)) - stored.bits;
  const auto mask = static_cast<Bits>(static_cast<Bits>(~Bits{0}) >> unused);
  const auto sign =
      static_cast<Bits>(slices.spare == SpareBits::sign && unused > 0 ? Bits{1} << (stored.bits - 1) : 0);
  const auto add = static_cast<Bits>(stored.add);
  for (std::size_t i = 0; i < count; ++i) {
    Bits bits;
    std::memcpy(&bits, samples + i * sizeof(Bits), sizeof(Bits));
    bits = static_cast<Bits>(bits - add);
    if (unused > 0) bits = nearest_of_range(bits, stored, mask);
    bits = static_cast<Bits>((static_cast<Bits>(bits & mask) ^ sign) - sign);
    std::memcpy(samples + i * sizeof(Bits), &bits, sizeof(Bits));
  }
}

}  // namespace

bool is_safe_name(const std::string& name) {
  if (name.empty() || name.front() == '/' || name.back() == '/' || name.find('\0') != name.npos) return false;
  for (std::size_t begin = 0; begin <= name.size();) {
    const std::size_t end = std::min(name.find('/', begin), name.size());
    const std::string part = name.substr(begin, end - begin);
    if (part.empty() || part == "." || part == "..") return false;
    begin = end + 1;
  }
  return true;
}

void for_each_stretch(
    const EnvelopeFile& file, std::uint64_t slice_bytes,
    const std::function<void(std::uint64_t begin, std::uint64_t end, const SlicesInFile* slices)>& use) {
  std::uint64_t position = 0;
  for (const SlicesInFile& slices : file.slices) {
    const SliceRun& run = slices.run;
    const bool is_gapless = run.step == slice_bytes;
    const std::uint64_t bytes = slice_bytes * (is_gapless ? static_cast<std::uint64_t>(run.slices) : 1);
    for (std::int64_t i = 0; i < (is_gapless ? 1 : run.slices); ++i) {
      const std::uint64_t begin = run.offset + static_cast<std::uint64_t>(i) * run.step;
      if (begin > position) use(position, begin, nullptr);
      position = begin + bytes;
      use(begin, position, &slices);
    }
  }
  if (file.size > position) use(position, file.size, nullptr);
}

void to_stored(const SlicesInFile& slices, SampleType type, std::byte* samples, std::size_t count) {
  if (!slices.run.stored.changes_nothing()) {
    switch (size_of(type)) {
      case 1:
        to_stored_bits<std::uint8_t>(slices, samples, count);
        break;
      case 2:
        to_stored_bits<std::uint16_t>(slices, samples, count);
        break;
      default:
        to_stored_bits<std::uint32_t>(slices, samples, count);
    }
  }
  if (slices.run.big_endian != (std::endian::native == std::endian::big))
    swap_bytes_of_samples(samples, count, size_of(type));
}

SourceFiles source_files(const SourceFacts& facts) {
  SourceFiles source;
  source.shape = {facts.info.dims, facts.info.type};
  source.paths = facts.files;
  const auto not_kept = [&](std::string why) {
    source.files.clear();
    source.why_not = std::move(why);
    return source;
  };
  if (facts.files.front() == "-" || facts.files.back() == "-") return not_kept("it came through a pipe");
  source.names = names_in_common_folder(facts.files);
  const std::vector<std::string>& names = source.names;
  if (facts.places.empty()) return not_kept("its samples are compressed, or stored in pieces");
  if (std::set<std::string>(names.begin(), names.end()).size() != names.size())
    return not_kept("one of its files is named twice");
  source.files.resize(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!is_safe_name(names[i])) return not_kept(fmt::format("{} cannot be a name", names[i]));
    source.files[i].name = names[i];
    source.files[i].size = FileSource(facts.files[i]).size();
  }
  std::int64_t z = 0;
  for (SliceRun run : facts.places) {
    EnvelopeFile& file = source.files[run.file];
    run.file = 0;
    if (run.slices == 1) run.step = source.shape.slice_bytes();
    file.slices.push_back({z, run});
    z += run.slices;
  }
  std::uint64_t all = 0;
  for (EnvelopeFile& file : source.files) {
    std::ranges::sort(file.slices, {}, [](const SlicesInFile& slices) { return slices.run.offset; });
    std::uint64_t end = 0;
    for (const auto& [first, run, spare] : file.slices) {
      if (run.offset < end || run.step < source.shape.slice_bytes())
        return not_kept("two of its slices lie at the same place");
      end = run.offset + static_cast<std::uint64_t>(run.slices - 1) * run.step + source.shape.slice_bytes();
    }
    if (end > file.size) return not_kept(fmt::format("{} has become shorter", file.name));
    all += file.size;
  }
  if (source.files.size() > most_files(source.shape))
    return not_kept(fmt::format("it has {} files, of which most have no slice", source.files.size()));
  // Other volumes of a file would be kept with each of them.
  const std::uint64_t samples = source.shape.bytes();
  const std::uint64_t most = most_other_bytes(source.shape, source.files.size());
  if (all - samples > most)
    return not_kept(
        fmt::format("its files have {} bytes besides these samples, more than the {} that are kept",
                    all - samples, most));
  return source;
}

}  // namespace tagrid
