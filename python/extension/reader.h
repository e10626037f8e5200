// An open .tag file, for Python.
#pragma once

#include <pybind11/numpy.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "call.h"
#include "tagrid/tagrid.h"

namespace tagrid_python {

using Point = std::array<std::int64_t, 3>;  ///< x, y, z
using Corners = std::pair<Point, Point>;    ///< low, and high, which is not part of the box

/// Any number of threads may use one reader at once, and one may close it while others read. The last three
/// arguments of a call that decodes are those of Call.
class Reader {
 public:
  static std::unique_ptr<Reader> of_path(const py::bytes& path);
  /// `buffer`: an object with the buffer protocol: bytes, bytearray, memoryview, mmap. It is held, so it
  /// cannot shrink.
  static std::unique_ptr<Reader> of_buffer(const py::object& buffer, std::string name);
  /// `read_at`: a function of Python. read_at(offset, size) returns so many bytes.
  static std::unique_ptr<Reader> of_object(py::object read_at, std::uint64_t size, std::string name);

  /// Running calls complete as if it were open.
  void close() { file_.reset(); }
  bool is_closed() const { return !file_; }

  py::dict info() const;
  py::bytes metadata() const;
  py::dict brick(std::int64_t number) const;
  /// The factors of the overviews, from fine to coarse.
  py::tuple overviews() const;
  /// The overview with a factor, as a file of its own, which holds what this one holds.
  std::unique_ptr<Reader> overview(std::int64_t factor) const;
  /// The number of volumes, and one of them, likewise.
  std::int64_t volumes() const;
  std::unique_ptr<Reader> volume(std::int64_t number) const;
  /// Fills `out`, an array of the shape (z, y, x) that the box has with this step.
  void read(const Point& low, const Point& high, const Point& step, py::array out, int threads,
            std::uint64_t memory_limit, py::object progress) const;
  void verify(int threads, std::uint64_t memory_limit, py::object progress) const;
  /// The number of active points of each level.
  py::array levels(int threads, std::uint64_t memory_limit, py::object progress) const;
  /// points (n, 3), values (n), cells (m, 4), levels (m).
  /// `materials`: (name, low, high, label) of each. Returns points, [(name, label, tetrahedra)], [(name, triangles)].
  py::tuple material_mesh(const py::dict& options, const std::vector<py::tuple>& materials,
                          const std::optional<Corners>& box, int threads, std::uint64_t memory_limit,
                          py::object progress) const;
  py::tuple mesh(int level, bool padded, const std::optional<Corners>& box, int threads,
                 std::uint64_t memory_limit, py::object progress) const;
  /// points (n, 3), triangles (m, 3).
  py::tuple surface(double iso, bool rescaled, int level, bool close, const std::optional<Corners>& box,
                    int threads, std::uint64_t memory_limit, py::object progress) const;

 private:
  struct File;
  explicit Reader(std::shared_ptr<File> file) : file_(std::move(file)) {}
  std::unique_ptr<Reader> nested(std::int64_t number,
                                 tagrid_status (*open_nested)(const tagrid_reader*, std::int64_t,
                                                              tagrid_reader**)) const;
  static std::unique_ptr<Reader> open(std::shared_ptr<File> file);

  /// The file, for as long as a call needs it. Raises ArgumentError if the reader is closed.
  std::shared_ptr<File> file() const;

  std::shared_ptr<File> file_;
};

}  // namespace tagrid_python
