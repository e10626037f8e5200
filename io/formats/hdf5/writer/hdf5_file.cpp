#include "io/formats/hdf5/writer/hdf5_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <utility>

#include "io/errors/errors.h"
#include "io/text/paths.h"

namespace tagrid {
namespace {

struct Reason {
  int error_number = 0;  ///< of the system
  std::string words;     ///< of the library, about the call that failed first
};

/// Why the last call, which has failed just now, did so. The library tells the system's error number in words
/// only.
Reason last_reason() {
  Reason reason;
  const auto look = [](unsigned, const H5E_error2_t* error, void* user) -> herr_t {
    Reason& found = *static_cast<Reason*>(user);
    const std::string_view words = error->desc == nullptr ? "" : error->desc;
    constexpr std::string_view number = "errno = ";
    if (found.words.empty()) found.words = words;
    if (found.error_number != 0) return 0;
    if (const std::size_t at = words.find(number); at != words.npos)
      found.error_number = std::atoi(words.data() + at + number.size());
    else if (error->min_num == H5E_WRITEERROR)
      found.error_number = errno;  // the driver for stdio says no number
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, look, &reason);
  return reason;
}

}  // namespace

Hdf5File::Hdf5File(const std::string& path, std::string name) : name_(std::move(name)) {
  const Hdf5Handle access = checked(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  check(H5Pset_libver_bounds(access.get(), H5F_LIBVER_EARLIEST, H5F_LIBVER_V18));
  // The usual driver asks for the name of a file, which the one behind a link of /proc does not have.
  if (std::filesystem::is_symlink(path_of(path))) check(H5Pset_fapl_stdio(access.get()));
  // Nobody else writes a temporary file, and some file systems have no locks.
  check(H5Pset_file_locking(access.get(), false, true));
  file_ = checked(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.get()), H5Fclose);
}

Hdf5Handle Hdf5File::make_group(const std::string& path) const {
  return checked(H5Gcreate2(file_.get(), path.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
}

Hdf5Handle Hdf5File::make_dataset(const std::string& path, hid_t type,
                                  const std::vector<hsize_t>& dims) const {
  const Hdf5Handle properties = checked(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  check(H5Pset_layout(properties.get(), H5D_CONTIGUOUS));
  check(H5Pset_alloc_time(properties.get(), H5D_ALLOC_TIME_EARLY));
  check(H5Pset_fill_time(properties.get(), H5D_FILL_TIME_NEVER));  // every number is written
  check(H5Pset_obj_track_times(properties.get(), false));          // or equal contents would give other bytes
  const Hdf5Handle space =
      checked(H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr), H5Sclose);
  return checked(
      H5Dcreate2(file_.get(), path.c_str(), type, space.get(), H5P_DEFAULT, properties.get(), H5P_DEFAULT),
      H5Dclose);
}

void Hdf5File::write(hid_t dataset, hid_t type, std::int64_t first, std::int64_t count,
                     const std::byte* numbers) const {
  const Hdf5Handle space = checked(H5Dget_space(dataset), H5Sclose);
  const int rank = H5Sget_simple_extent_ndims(space.get());
  std::vector<hsize_t> start(static_cast<std::size_t>(rank), 0), size(start);
  check(H5Sget_simple_extent_dims(space.get(), size.data(), nullptr));
  start[0] = static_cast<hsize_t>(first);
  size[0] = static_cast<hsize_t>(count);
  check(H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, start.data(), nullptr, size.data(), nullptr));
  const Hdf5Handle memory = checked(H5Screate_simple(rank, size.data(), nullptr), H5Sclose);
  check(H5Dwrite(dataset, type, memory.get(), space.get(), H5P_DEFAULT, numbers));
}

void Hdf5File::add_texts(const std::string& path, const std::vector<std::string>& texts) const {
  const Hdf5Handle type = checked(H5Tcopy(H5T_C_S1), H5Tclose);
  check(H5Tset_size(type.get(), H5T_VARIABLE));
  // VTK reads no others.
  const bool is_ascii = std::ranges::all_of(texts, [](const std::string& text) {
    return std::ranges::all_of(text, [](char c) { return (c & 0x80) == 0; });
  });
  check(H5Tset_cset(type.get(), is_ascii ? H5T_CSET_ASCII : H5T_CSET_UTF8));
  std::vector<const char*> values;
  for (const std::string& text : texts) values.push_back(text.c_str());
  // Unlike data sets of numbers, those of texts must have fill values.
  const Hdf5Handle properties = checked(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  check(H5Pset_obj_track_times(properties.get(), false));
  const hsize_t count = texts.size();
  const Hdf5Handle space = checked(H5Screate_simple(1, &count, nullptr), H5Sclose);
  const Hdf5Handle dataset = checked(H5Dcreate2(file_.get(), path.c_str(), type.get(), space.get(),
                                                H5P_DEFAULT, properties.get(), H5P_DEFAULT),
                                     H5Dclose);
  check(H5Dwrite(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()));
}

void Hdf5File::add_text(hid_t object, const std::string& name, const std::string& text) const {
  const Hdf5Handle type = checked(H5Tcopy(H5T_C_S1), H5Tclose);
  check(H5Tset_size(type.get(), H5T_VARIABLE));
  check(H5Tset_cset(type.get(), H5T_CSET_UTF8));
  const Hdf5Handle space = checked(H5Screate(H5S_SCALAR), H5Sclose);
  const char* value = text.c_str();
  add(object, name, type.get(), type.get(), space.get(), &value);
}

void Hdf5File::add_fixed_text(hid_t object, const std::string& name, const std::string& text) const {
  const Hdf5Handle type = checked(H5Tcopy(H5T_C_S1), H5Tclose);
  check(H5Tset_size(type.get(), text.size()));
  check(H5Tset_strpad(type.get(), H5T_STR_NULLPAD));
  const Hdf5Handle space = checked(H5Screate(H5S_SCALAR), H5Sclose);
  add(object, name, type.get(), type.get(), space.get(), text.data());
}

void Hdf5File::add_numbers(hid_t object, const std::string& name, std::span<const double> numbers) const {
  const hsize_t count = numbers.size();
  const Hdf5Handle space =
      checked(count == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &count, nullptr), H5Sclose);
  add(object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, space.get(), numbers.data());
}

void Hdf5File::add_vectors(hid_t object, const std::string& name, std::span<const double, 9> numbers) const {
  const hsize_t counts[] = {3, 3};
  const Hdf5Handle space = checked(H5Screate_simple(2, counts, nullptr), H5Sclose);
  add(object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, space.get(), numbers.data());
}

void Hdf5File::add_whole_numbers(hid_t object, const std::string& name,
                                 std::span<const std::int64_t> numbers) const {
  const hsize_t count = numbers.size();
  const Hdf5Handle space = checked(H5Screate_simple(1, &count, nullptr), H5Sclose);
  add(object, name, H5T_STD_I64LE, H5T_NATIVE_INT64, space.get(), numbers.data());
}

void Hdf5File::close() { close(std::move(file_)); }

void Hdf5File::close(Hdf5Handle handle) const {
  if (!handle.close()) fail();
}

Hdf5Handle Hdf5File::checked(hid_t id, herr_t (*closes)(hid_t)) const {
  if (id < 0) fail();
  return {id, closes};
}

void Hdf5File::check(herr_t status) const {
  if (status < 0) fail();
}

void Hdf5File::fail() const {
  const Reason reason = last_reason();
  if (reason.error_number != 0) throw world_error("cannot write", name_, reason.error_number);
  throw WorldError("{}: HDF5 cannot write it: {}", name_,
                   reason.words.empty() ? "no reason is given" : reason.words);
}

void Hdf5File::add(hid_t object, const std::string& name, hid_t type, hid_t memory_type, hid_t space,
                   const void* value) const {
  const Hdf5Handle attribute =
      checked(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  check(H5Awrite(attribute.get(), memory_type, value));
}

}  // namespace tagrid
