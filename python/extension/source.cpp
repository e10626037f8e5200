#include "source.h"

#include <cstring>

#include "gil.h"

namespace tagrid_python {

tagrid_input Source::input() {
  tagrid_input input;
  tagrid_input_init(&input);
  input.user = this;
  input.name = name_.c_str();
  input.size = [](void* self, std::uint64_t* bytes) {
    *bytes = static_cast<Source*>(self)->size();
    return 0;
  };
  input.read_at = [](void* self, std::uint64_t offset, void* buffer, std::size_t count) {
    return static_cast<Source*>(self)->read_at(offset, buffer, count);
  };
  return input;
}

BufferSource::BufferSource(const py::object& buffer, std::string name) : Source(std::move(name)) {
  if (PyObject_GetBuffer(buffer.ptr(), &view_, PyBUF_SIMPLE) != 0) throw py::error_already_set();
}

BufferSource::~BufferSource() { PyBuffer_Release(&view_); }

int BufferSource::read_at(std::uint64_t offset, void* buffer, std::size_t count) noexcept {
  std::memcpy(buffer, static_cast<const char*>(view_.buf) + offset, count);
  return 0;
}

int ObjectSource::read_at(std::uint64_t offset, void* buffer, std::size_t count) noexcept {
  const WithGil gil;
  try {
    copy(offset, buffer, count);
    return 0;
  } catch (const py::error_already_set& error) {
    raised_.keep(error);
    return 1;
  } catch (...) {
    return 1;
  }
}

void ObjectSource::copy(std::uint64_t offset, void* buffer, std::size_t count) {
  const py::object bytes = read_at_(offset, count);
  Py_buffer view;
  if (PyObject_GetBuffer(bytes.ptr(), &view, PyBUF_SIMPLE) != 0) throw py::error_already_set();
  const auto given = static_cast<std::size_t>(view.len);
  if (given == count) std::memcpy(buffer, view.buf, count);
  PyBuffer_Release(&view);
  if (given != count)
    raise_unless_ok({TAGRID_IO_ERROR, "read_at(" + std::to_string(offset) + ", " + std::to_string(count) +
                                          ") returned " + std::to_string(given) + " bytes"});
}

}  // namespace tagrid_python
