#include "plugins/hdf5/coding.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "plugins/hdf5/lattice.h"

namespace tagrid::hdf5 {
namespace {

static_assert(std::endian::native == std::endian::little, "as everywhere in tagrid");

template <class Visit>
auto with_type(tagrid_type type, Visit visit) {
  switch (type) {
    case TAGRID_INT8:
      return visit(std::int8_t{});
    case TAGRID_UINT16:
      return visit(std::uint16_t{});
    case TAGRID_INT16:
      return visit(std::int16_t{});
    case TAGRID_UINT32:
      return visit(std::uint32_t{});
    case TAGRID_INT32:
      return visit(std::int32_t{});
    case TAGRID_FLOAT32:
      return visit(float{});
    case TAGRID_FLOAT64:
      return visit(double{});
    default:
      return visit(std::uint8_t{});
  }
}

void reverse_each(std::span<std::byte> samples, std::size_t size) {
  for (std::size_t i = 0; i < samples.size(); i += size) std::ranges::reverse(samples.subspan(i, size));
}

// The range of the finite samples, on which the grid of 32 and 64 bits depends.
template <class T>
std::array<double, 2> range_of(std::span<const T> samples) {
  T low = std::numeric_limits<T>::max(), high = std::numeric_limits<T>::lowest();
  for (const T sample : samples) {
    if constexpr (std::is_floating_point_v<T>)
      if (!std::isfinite(sample)) continue;
    low = std::min(low, sample);
    high = std::max(high, sample);
  }
  return {static_cast<double>(low), static_cast<double>(high)};
}

// A chunk of samples, or of their numbers, as a file. `lines` say more of it.
template <class T>
std::vector<std::byte> file_of(const Chunk& chunk, const Choice& choice, double max_error,
                               std::span<const T> samples, const std::string& lines = "") {
  tagrid_encode_options options;
  tagrid_encode_options_init(&options);
  std::ranges::copy(chunk.dims, options.dims);
  options.type = type_of<T>();
  options.max_error = max_error;
  options.effort = choice.effort;
  options.thresholds = choice.thresholds.data();
  options.threshold_count = choice.thresholds.size();
  options.metadata = lines.c_str();
  // Nobody sees a grid in a data set. Whoever takes the chunk as a file still gets the one of the decoded
  // samples.
  options.grid = TAGRID_GRID_DERIVED;
  // A chunk is read as a whole.
  constexpr std::int64_t no_overviews = 0;
  options.overviews = &no_overviews;
  if (const auto range = range_of(samples); range[0] < range[1] && std::isfinite(range[1] - range[0]))
    std::ranges::copy(range, options.range);
  else
    options.field_scale = 1;
  Call call;
  // One brick is the work of one thread.
  if (std::ranges::all_of(chunk.dims, [](std::int64_t n) { return n <= 64; })) call.threads = 1;
  std::vector<std::byte> file;
  Encoder encoder(
      options, [&](std::span<const std::byte> bytes) { file.insert(file.end(), bytes.begin(), bytes.end()); },
      call);
  encoder.write(samples);
  encoder.finish();
  return file;
}

template <class T>
Lattice<T> lattice_of(const Chunk& chunk, double max_error) {
  T fill;
  std::memcpy(&fill, &chunk.fill, sizeof fill);
  return lattice_for<T>(max_error, fill);
}

template <class T>
std::vector<std::byte> encode_samples(const Chunk& chunk, const Choice& choice, std::span<const T> samples) {
  if (choice.whole_chunks) return file_of<T>(chunk, choice, choice.max_error, samples);
  if (lattice_step(chunk.type, choice.max_error) > 0) {
    const auto lattice = lattice_of<T>(chunk, choice.max_error);
    if (const auto places = to_lattice<T>(samples, lattice))
      return file_of<NumberOf<T>>(chunk, choice, 0, places->numbers, lattice_lines(*places, lattice));
  }
  return file_of<T>(chunk, choice, 0, samples);
}

class Memory final : public Input {
 public:
  explicit Memory(std::span<const std::byte> bytes) : bytes_(bytes) {}
  std::uint64_t size() override { return bytes_.size(); }
  void read_at(std::uint64_t offset, std::span<std::byte> to) override {
    std::ranges::copy(bytes_.subspan(static_cast<std::size_t>(offset), to.size()), to.begin());
  }

 private:
  std::span<const std::byte> bytes_;
};

// Throws Error if a file, of numbers on a lattice or of samples, does not fit the data set.
void require_fit(const Chunk& chunk, const Choice& choice, const tagrid_info& info, bool has_numbers) {
  if (has_numbers && !(lattice_step(chunk.type, choice.max_error) > 0))
    throw Error(TAGRID_BROKEN_INPUT, "the chunk was coded with another bound than that of the data set");
  const bool has_numbers_of_floats =
      has_numbers && (chunk.type == TAGRID_FLOAT32 || chunk.type == TAGRID_FLOAT64);
  if (info.type != (has_numbers_of_floats ? TAGRID_INT32 : chunk.type) ||
      !std::ranges::equal(info.dims, chunk.dims))
    throw Error(TAGRID_BROKEN_INPUT,
                "the chunk is a volume of another type or size than the data set's chunks");
  // False for a file without a bound, too: it is NaN.
  if (!(info.max_error <= choice.max_error))
    throw Error(TAGRID_BROKEN_INPUT, "the chunk was coded with a larger bound than that of the data set");
  if ((info.max_error > 0 || has_numbers) &&
      !std::ranges::equal(choice.thresholds,
                          std::span(info.thresholds).first(static_cast<std::size_t>(info.threshold_count))))
    throw Error(TAGRID_BROKEN_INPUT, "the chunk was coded with other thresholds than those of the data set");
  if (!choice.whole_chunks && info.max_error > 0)
    throw Error(
        TAGRID_BROKEN_INPUT,
        "the chunk was coded elsewhere, with a bound, and would be off by more if a part of it were written; "
        "it belongs into a data set whose fourth number is 1 (whole_chunks in Python)");
}

}  // namespace

std::vector<std::byte> encode(const Chunk& chunk, const Choice& choice, std::span<const std::byte> samples) {
  return with_type(chunk.type, [&](auto type) {
    using T = decltype(type);
    // HDF5's buffers need not be aligned for a type, and those of the other byte order are swapped.
    std::vector<T> copy(chunk.sample_count());
    std::memcpy(copy.data(), samples.data(), samples.size());
    if (chunk.big_endian) reverse_each(std::as_writable_bytes(std::span(copy)), sizeof(T));
    return encode_samples<T>(chunk, choice, copy);
  });
}

void decode(const Chunk& chunk, const Choice& choice, std::span<const std::byte> file,
            const std::function<std::span<std::byte>()>& memory_for_samples) {
  Memory memory(file);
  const Reader reader(memory, "the chunk");
  const std::string header = reader.metadata();
  require_fit(chunk, choice, reader.info(), has_lattice(header));
  const std::span<std::byte> bytes = memory_for_samples();
  with_type(chunk.type, [&](auto type) {
    using T = decltype(type);
    const std::span<T> samples(reinterpret_cast<T*>(bytes.data()), chunk.sample_count());
    if (!has_lattice(header)) {
      reader.read_to<T>(reader.box(), {1, 1, 1}, samples);
    } else {
      OnLattice<T> places;
      const auto lattice = lattice_of<T>(chunk, choice.max_error);
      read_lattice_lines(header, lattice, places);
      places.numbers = reader.read<NumberOf<T>>(reader.box());
      from_lattice(places, lattice, samples);
    }
  });
  if (chunk.big_endian) reverse_each(bytes, tagrid_sample_size(chunk.type));
}

namespace {

constexpr unsigned layout = 2, layout_with_thresholds = 3;
constexpr unsigned big_endian_flag = 256;

[[noreturn]] void refuse(const std::string& message) { throw Error(TAGRID_INVALID_ARGUMENT, message); }

std::uint64_t joined(unsigned low, unsigned high) { return std::uint64_t{high} << 32 | low; }

// Thresholds as files have them: the least numbers of the type that are at least the given ones.
template <class T>
std::vector<double> kept_thresholds(const std::vector<double>& given) {
  using Limits = std::numeric_limits<T>;
  std::vector<double> kept;
  for (const double value : given) {
    if (!(value > static_cast<double>(Limits::lowest()) && value <= static_cast<double>(Limits::max())))
      refuse("all numbers of the type are on one side of the threshold " + std::to_string(value));
    double least = std::ceil(value);
    if constexpr (!Limits::is_integer) {
      const auto nearest = static_cast<T>(value);
      least = nearest < value ? std::nextafter(nearest, Limits::infinity()) : nearest;
    }
    if (!kept.empty() && value < kept.back() && least != kept.back())
      refuse("the thresholds are not increasing");
    if (kept.empty() || kept.back() != least) kept.push_back(least);
  }
  return kept;
}

double bound_of(std::span<const unsigned> numbers) {
  if (numbers.empty()) return 0;
  if (numbers.size() == 1) return numbers[0];
  return std::bit_cast<double>(joined(numbers[0], numbers[1]));
}

}  // namespace

std::size_t Chunk::sample_count() const {
  return static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
         static_cast<std::size_t>(dims[2]);
}

Choice choice_of(std::span<const unsigned> numbers) {
  const bool is_stored = numbers.size() >= stored_numbers;
  if (is_stored ? numbers.size() > most_stored || numbers.size() % 2 == 0
                : numbers.size() > most_given ||
                      (numbers.size() > least_with_thresholds && numbers.size() % 2 == 1))
    refuse(
        "the filter takes none to four numbers: E, or the low and high half of a double E, the effort, and 1 "
        "if chunks are written as a whole; and after these four, the low and high half of one or two "
        "thresholds");
  Choice choice;
  choice.max_error = bound_of(numbers);
  // False for NaN, too.
  if (!(choice.max_error >= 0 && choice.max_error <= std::numeric_limits<double>::max()))
    refuse("the largest error is not a finite number of at least 0: " + std::to_string(choice.max_error));
  if (numbers.size() > 2) {
    if (numbers[2] > TAGRID_EFFORT_BEST)
      refuse("the effort is 0 (default), 1 (fast) or 2 (best), not " + std::to_string(numbers[2]));
    choice.effort = static_cast<tagrid_effort>(numbers[2]);
  }
  if (numbers.size() > 3) {
    if (numbers[3] > 1)
      refuse("the fourth number is 0, or 1 if chunks are written as a whole, not " +
             std::to_string(numbers[3]));
    choice.whole_chunks = numbers[3] == 1;
  }
  for (std::size_t i = is_stored ? stored_numbers : least_with_thresholds; i + 1 < numbers.size(); i += 2)
    choice.thresholds.push_back(std::bit_cast<double>(joined(numbers[i], numbers[i + 1])));
  if (!choice.thresholds.empty() && !choice.whole_chunks)
    refuse(
        "thresholds need chunks that are written as a whole: the fourth number must be 1 (whole_chunks in "
        "Python)");
  return choice;
}

Chunk chunk_of(std::span<const unsigned> numbers) {
  if (numbers.size() < stored_numbers || numbers.size() > most_stored || numbers.size() % 2 == 0)
    refuse("the file has " + std::to_string(numbers.size()) + " numbers for the filter where " +
           std::to_string(stored_numbers) + " belong, or more of them with thresholds");
  if (numbers[4] != (numbers.size() == stored_numbers ? layout : layout_with_thresholds))
    refuse("the filter's numbers are of version " + std::to_string(numbers[4]) +
           ", and this one knows version " + std::to_string(layout) + " and " +
           std::to_string(layout_with_thresholds) + ": a newer tagrid may read them");
  Chunk chunk;
  chunk.type = static_cast<tagrid_type>(numbers[5] & ~big_endian_flag);
  chunk.big_endian = (numbers[5] & big_endian_flag) != 0;
  std::uint64_t bytes = tagrid_sample_size(chunk.type);
  if (bytes == 0) refuse("the filter's numbers name no type of samples");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint64_t samples = numbers[6 + axis];
    // HDF5 limits a chunk to less than 4 GiB.
    if (samples == 0 || samples > std::numeric_limits<std::uint32_t>::max() / bytes)
      refuse("the filter's numbers give a chunk of no size that HDF5 has");
    bytes *= samples;
    chunk.dims[axis] = static_cast<std::int64_t>(samples);
  }
  chunk.fill = joined(numbers[9], numbers[10]);
  return chunk;
}

std::vector<unsigned> numbers_of(const Choice& choice, const Chunk& chunk) {
  const auto bound = std::bit_cast<std::uint64_t>(choice.max_error);
  std::vector<unsigned> numbers = {
      static_cast<unsigned>(bound),
      static_cast<unsigned>(bound >> 32),
      static_cast<unsigned>(choice.effort),
      choice.whole_chunks ? 1U : 0U,
      choice.thresholds.empty() ? layout : layout_with_thresholds,
      static_cast<unsigned>(chunk.type) | (chunk.big_endian ? big_endian_flag : 0),
      static_cast<unsigned>(chunk.dims[0]),
      static_cast<unsigned>(chunk.dims[1]),
      static_cast<unsigned>(chunk.dims[2]),
      static_cast<unsigned>(chunk.fill),
      static_cast<unsigned>(chunk.fill >> 32)};
  with_type(chunk.type, [&](auto type) {
    for (const double threshold : kept_thresholds<decltype(type)>(choice.thresholds)) {
      const auto bits = std::bit_cast<std::uint64_t>(threshold);
      numbers.insert(numbers.end(), {static_cast<unsigned>(bits), static_cast<unsigned>(bits >> 32)});
    }
  });
  return numbers;
}

}  // namespace tagrid::hdf5
