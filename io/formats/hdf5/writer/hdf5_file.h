// An HDF5 file that is written: https://docs.hdfgroup.org/hdf5
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/formats/hdf5/handle.h"

namespace tagrid {

/// The library's caches, and what it needs for the largest of small things.
inline constexpr std::uint64_t memory_of_hdf5_library = std::uint64_t{16} << 20;

/// Equal calls give equal bytes. Programs with version 1.8 of the library can read the file. All functions
/// throw WorldError.
class Hdf5File {
 public:
  /// Writes into the file at `path`, which messages call `name`.
  Hdf5File(const std::string& path, std::string name);

  /// The group at this path. Groups above it must exist.
  Hdf5Handle make_group(const std::string& path) const;
  /// The data set at this path, with its numbers in one piece of the file. `type`: little endian. `dims`: the
  /// slowest axis first.
  Hdf5Handle make_dataset(const std::string& path, hid_t type, const std::vector<hsize_t>& dims) const;
  /// Writes `count` entries of the slowest axis from entry `first` on. `numbers`: all of them, of this type.
  void write(hid_t dataset, hid_t type, std::int64_t first, std::int64_t count,
             const std::byte* numbers) const;

  /// The data set at this path, with texts in UTF-8.
  void add_texts(const std::string& path, const std::vector<std::string>& texts) const;
  /// A text of any length, in UTF-8.
  void add_text(hid_t object, const std::string& name, const std::string& text) const;
  /// A text in ASCII that takes as many bytes as it has.
  void add_fixed_text(hid_t object, const std::string& name, const std::string& text) const;
  /// One number, or a list.
  void add_numbers(hid_t object, const std::string& name, std::span<const double> numbers) const;
  /// Three vectors, one after another.
  void add_vectors(hid_t object, const std::string& name, std::span<const double, 9> numbers) const;
  void add_whole_numbers(hid_t object, const std::string& name, std::span<const std::int64_t> numbers) const;

  /// Completes the file. REQUIRES: everything else of it is closed.
  void close();
  /// Closes something; what the library still had to write of it is written now.
  void close(Hdf5Handle handle) const;

 private:
  Hdf5Handle checked(hid_t id, herr_t (*closes)(hid_t)) const;
  void check(herr_t status) const;
  [[noreturn]] void fail() const;
  void add(hid_t object, const std::string& name, hid_t type, hid_t memory_type, hid_t space,
           const void* value) const;

  std::string name_;
  Hdf5Handle file_;
};

}  // namespace tagrid
