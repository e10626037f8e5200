// What HDF5's library finds in the plugin. See "HDF5 Filter Plugins", The HDF Group.
#include <H5PLextern.h>
#include <hdf5.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "plugins/hdf5/coding.h"
#include "plugins/hdf5/lattice.h"

namespace tagrid::hdf5 {
namespace {

// Adds a message to HDF5's stack of errors, which h5py, h5dump and others print.
void tell(const char* function, int line, const std::string& message) {
  H5Epush2(H5E_DEFAULT, __FILE__, function, static_cast<unsigned>(line), H5E_ERR_CLS, H5E_PLINE,
           H5E_CANTFILTER, "tagrid: %s", message.c_str());
}

// Calls work(), and returns `failed` with a message if it throws: no exception may reach C.
template <class Result, class Work>
Result guarded(const char* function, Result failed, Work work) {
  try {
    return work();
  } catch (const std::exception& error) {
    tell(function, __LINE__, error.what());
  } catch (...) {
    tell(function, __LINE__, "an unknown error");
  }
  return failed;
}

struct StoredType {
  tagrid_type type;
  bool big_endian;
};

std::array<std::pair<hid_t, StoredType>, 16> known_types() {
  return {{
      {H5T_STD_U8LE, {TAGRID_UINT8, false}},
      {H5T_STD_I8LE, {TAGRID_INT8, false}},
      {H5T_STD_U8BE, {TAGRID_UINT8, false}},
      {H5T_STD_I8BE, {TAGRID_INT8, false}},
      {H5T_STD_U16LE, {TAGRID_UINT16, false}},
      {H5T_STD_U16BE, {TAGRID_UINT16, true}},
      {H5T_STD_I16LE, {TAGRID_INT16, false}},
      {H5T_STD_I16BE, {TAGRID_INT16, true}},
      {H5T_STD_U32LE, {TAGRID_UINT32, false}},
      {H5T_STD_U32BE, {TAGRID_UINT32, true}},
      {H5T_STD_I32LE, {TAGRID_INT32, false}},
      {H5T_STD_I32BE, {TAGRID_INT32, true}},
      {H5T_IEEE_F32LE, {TAGRID_FLOAT32, false}},
      {H5T_IEEE_F32BE, {TAGRID_FLOAT32, true}},
      {H5T_IEEE_F64LE, {TAGRID_FLOAT64, false}},
      {H5T_IEEE_F64BE, {TAGRID_FLOAT64, true}},
  }};
}

// Nothing for types that tagrid does not know: integers of 64 bits or with padding, half floats, compound
// types ...
std::optional<StoredType> stored_type_of(hid_t type) {
  for (const auto& [hdf5_type, stored] : known_types())
    if (H5Tequal(type, hdf5_type) > 0) return stored;
  return std::nullopt;
}

// The axes of a chunk along which it has more than one sample are x, y and z, the last one x.
std::array<std::int64_t, 3> dims_of_chunk(hid_t properties) {
  hsize_t sizes[H5S_MAX_RANK];
  const int rank = H5Pget_chunk(properties, H5S_MAX_RANK, sizes);
  if (rank < 1) throw Error(TAGRID_INVALID_ARGUMENT, "the data set has no chunks");
  std::array<std::int64_t, 3> dims = {1, 1, 1};
  std::size_t axis = 0;
  for (int i = rank - 1; i >= 0; --i) {
    if (sizes[i] == 1) continue;
    if (axis == 3)
      throw Error(
          TAGRID_INVALID_ARGUMENT,
          "the chunks have more than three axes with more than one sample; give the others chunks of 1");
    dims[axis++] = static_cast<std::int64_t>(sizes[i]);
  }
  return dims;
}

// The numbers of the filter. Throws Error if another filter comes before it: that one would change the
// samples.
std::vector<unsigned> given_numbers(hid_t properties, unsigned& flags) {
  unsigned kind = 0;
  std::size_t unused = 0;
  if (H5Pget_filter2(properties, 0, &kind, &unused, nullptr, 0, nullptr, nullptr) != filter_id)
    throw Error(TAGRID_INVALID_ARGUMENT,
                "tagrid must be the first filter: it needs samples, not what shuffle, scaleoffset or another "
                "filter makes of them");
  std::vector<unsigned> numbers(most_stored + 1);
  std::size_t count = numbers.size();
  if (H5Pget_filter_by_id2(properties, filter_id, &flags, &count, numbers.data(), 0, nullptr, nullptr) < 0)
    throw Error(TAGRID_INVALID_ARGUMENT, "HDF5 does not give the filter's numbers");
  numbers.resize(std::min(count, numbers.size()));
  return numbers;
}

// The bits of the data set's fill value in the machine's byte order; 0, which is also HDF5's own, if it has
// none.
std::uint64_t fill_of(hid_t properties, const StoredType& stored) {
  H5D_fill_value_t defined = H5D_FILL_VALUE_UNDEFINED;
  if (H5Pfill_value_defined(properties, &defined) < 0 || defined != H5D_FILL_VALUE_USER_DEFINED) return 0;
  for (const auto& [hdf5_type, known] : known_types()) {
    std::uint64_t bits = 0;
    if (known.type == stored.type && !known.big_endian &&
        H5Pget_fill_value(properties, hdf5_type, &bits) >= 0)
      return bits;
  }
  throw Error(TAGRID_INVALID_ARGUMENT, "HDF5 does not give the fill value");
}

// True for a fill value other than 0, unless it is not finite: then it comes back in any case.
bool changes_within_bound(const Chunk& chunk) {
  bool is_finite = true;
  if (chunk.type == TAGRID_FLOAT32)
    is_finite = std::isfinite(std::bit_cast<float>(static_cast<std::uint32_t>(chunk.fill)));
  if (chunk.type == TAGRID_FLOAT64) is_finite = std::isfinite(std::bit_cast<double>(chunk.fill));
  return chunk.fill != 0 && is_finite;
}

herr_t set_local(hid_t properties, hid_t type, hid_t) {
  return guarded(__func__, herr_t{-1}, [&]() -> herr_t {
    unsigned flags = 0;
    const Choice choice = choice_of(given_numbers(properties, flags));
    const auto stored = stored_type_of(type);
    if (!stored)
      throw Error(TAGRID_INVALID_ARGUMENT,
                  "samples are integers of 8, 16 or 32 bits, or floats of 32 or 64 bits");
    const Chunk chunk{stored->type, stored->big_endian, dims_of_chunk(properties),
                      fill_of(properties, *stored)};
    if (choice.whole_chunks && lattice_step(chunk.type, choice.max_error) > 0 && changes_within_bound(chunk))
      throw Error(
          TAGRID_INVALID_ARGUMENT,
          "the fill value would not come back within a bound where chunks are written as a whole; give "
          "none, or 0 as the fourth number (no whole_chunks in Python)");
    const auto numbers = numbers_of(choice, chunk);
    chunk_of(numbers);  // refuses chunks that are too large
    return H5Pmodify_filter(properties, filter_id, flags, numbers.size(), numbers.data());
  });
}

// Memory that HDF5's library frees.
class Hdf5Memory {
 public:
  explicit Hdf5Memory(std::size_t bytes) : memory_(H5allocate_memory(bytes, false)), bytes_(bytes) {
    if (memory_ == nullptr) throw std::bad_alloc();
  }
  Hdf5Memory(const Hdf5Memory&) = delete;
  Hdf5Memory& operator=(const Hdf5Memory&) = delete;
  ~Hdf5Memory() { H5free_memory(memory_); }

  std::span<std::byte> bytes() { return {static_cast<std::byte*>(memory_), bytes_}; }
  /// Takes the place of HDF5's buffer.
  std::size_t replace(std::size_t* size, void** buffer) {
    std::swap(*buffer, memory_);
    *size = bytes_;
    return bytes_;
  }

 private:
  void* memory_;
  std::size_t bytes_;
};

std::size_t filter(unsigned flags, std::size_t count, const unsigned* numbers, std::size_t bytes,
                   std::size_t* size, void** buffer) {
  return guarded(__func__, std::size_t{0}, [&] {
    const std::span<const unsigned> all(numbers, count);
    const Chunk chunk = chunk_of(all);
    const std::span<const std::byte> given(static_cast<const std::byte*>(*buffer), bytes);
    if ((flags & H5Z_FLAG_REVERSE) != 0) {
      std::optional<Hdf5Memory> samples;
      decode(chunk, choice_of(all), given, [&] { return samples.emplace(chunk.bytes()).bytes(); });
      return samples->replace(size, buffer);
    }
    if (bytes != chunk.bytes())
      throw Error(TAGRID_INVALID_ARGUMENT, "the chunk has " + std::to_string(bytes) + " bytes where " +
                                               std::to_string(chunk.bytes()) + " belong");
    const std::vector<std::byte> file = encode(chunk, choice_of(all), given);
    Hdf5Memory made(file.size());
    std::ranges::copy(file, made.bytes().begin());
    return made.replace(size, buffer);
  });
}

// set_local() also says whether the filter can be applied: what HDF5 has another function for, but loses its
// message.
const H5Z_class2_t plugin = {H5Z_CLASS_T_VERS, filter_id, 1, 1, "tagrid", nullptr, set_local, filter};

}  // namespace
}  // namespace tagrid::hdf5

extern "C" {
H5PLUGIN_DLL H5PL_type_t H5PLget_plugin_type() { return H5PL_TYPE_FILTER; }
H5PLUGIN_DLL const void* H5PLget_plugin_info() { return &tagrid::hdf5::plugin; }
}
