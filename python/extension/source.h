// Where the bytes of a .tag file come from, if not from a path: memory, or an object of Python.
#pragma once

#include <pybind11/pybind11.h>

#include <cstdint>
#include <string>

#include "call.h"
#include "tagrid/tagrid.h"

namespace tagrid_python {

/// A place that is read through callbacks. Its name is for messages. REQUIRES: the GIL, to make and to destroy it.
class Source {
 public:
  explicit Source(std::string name) : name_(std::move(name)) {}
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;
  virtual ~Source() = default;

  /// Its functions for the library. The source must outlive the reader.
  tagrid_input input();
  /// An exception that was raised while bytes were read. REQUIRES: the GIL.
  Raised& raised() { return raised_; }

 protected:
  /// Called without the GIL, by several threads at once. Returns 0, or another number if it fails.
  virtual int read_at(std::uint64_t offset, void* buffer, std::size_t count) noexcept = 0;
  virtual std::uint64_t size() const noexcept = 0;

  Raised raised_;

 private:
  std::string name_;
};

/// An object with the buffer protocol: bytes, bytearray, memoryview, mmap. It is held, so it cannot shrink.
class BufferSource : public Source {
 public:
  BufferSource(const py::object& buffer, std::string name);
  ~BufferSource() override;

 protected:
  int read_at(std::uint64_t offset, void* buffer, std::size_t count) noexcept override;
  std::uint64_t size() const noexcept override { return static_cast<std::uint64_t>(view_.len); }

 private:
  Py_buffer view_;
};

/// A function of Python: read_at(offset, size) returns so many bytes.
class ObjectSource : public Source {
 public:
  ObjectSource(py::object read_at, std::uint64_t size, std::string name)
      : Source(std::move(name)), read_at_(std::move(read_at)), size_(size) {}

 protected:
  int read_at(std::uint64_t offset, void* buffer, std::size_t count) noexcept override;
  std::uint64_t size() const noexcept override { return size_; }

 private:
  void copy(std::uint64_t offset, void* buffer, std::size_t count);

  py::object read_at_;
  std::uint64_t size_;
};

}  // namespace tagrid_python
