#include "reader.h"

#include <cstring>
#include <vector>

#include "info.h"

namespace tagrid_python {

// REQUIRES: the GIL, to destroy it. A file without a path is read from a buffer, or by a function of Python.
struct Reader::File {
  Py_buffer buffer = {};
  py::object read_at;
  std::uint64_t size = 0;
  std::string name;
  std::shared_ptr<File> whole;  // in which this one is an overview or a volume, and which reads its bytes
  Raised raised;                // while bytes were read
  tagrid_reader* reader = nullptr;
  int calls = 0;  // that are running; counted with the GIL

  File() = default;
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() {
    tagrid_reader_close(reader);
    PyBuffer_Release(&buffer);
  }

  tagrid_info info() const {
    tagrid_info info;
    tagrid_info_init(&info);
    raise_unless_ok(outcome(tagrid_reader_info(reader, &info)));
    return info;
  }
  // On the thread of the call, which alone knows the message.
  Outcome outcome(tagrid_status status) const {
    if (status == TAGRID_OK) return {};
    return {status, reader != nullptr ? tagrid_reader_message(reader) : ""};
  }

  // Does the work, and raises the exception of a callback, or the error of the library. Several calls may fail
  // because the same source fails; each raises an exception of the source, which is forgotten after the last one.
  template <class Work>
  void work(Call& call, Work do_it) {
    struct Count {
      File& file;
      explicit Count(File& counted) : file(counted) { ++file.calls; }
      ~Count() {
        if (--file.calls == 0) file.raised.clear();
      }
    } const count(source());
    const Outcome ended = run_without_gil(call, [&] { return outcome(do_it()); });
    // Also if the work was complete before it noticed.
    call.raised().raise();
    if (ended.status == TAGRID_IO_ERROR) source().raised.raise();
    raise_unless_ok(ended);
  }

  // The file whose callbacks are called.
  File& source() { return whole ? *whole : *this; }

  // Called without the GIL, by several threads at once.
  int give(std::uint64_t offset, void* to, std::size_t count) noexcept {
    if (!read_at) {
      std::memcpy(to, static_cast<const char*>(buffer.buf) + offset, count);
      return 0;
    }
    const WithGil gil;
    try {
      copy(offset, to, count);
      return 0;
    } catch (const py::error_already_set& error) {
      raised.keep(error);
      return 1;
    } catch (...) {
      return 1;
    }
  }

 private:
  void copy(std::uint64_t offset, void* to, std::size_t count) {
    const py::object bytes = read_at(offset, count);
    Py_buffer view;
    if (PyObject_GetBuffer(bytes.ptr(), &view, PyBUF_SIMPLE) != 0) throw py::error_already_set();
    const auto given = static_cast<std::size_t>(view.len);
    if (given == count) std::memcpy(to, view.buf, count);
    PyBuffer_Release(&view);
    if (given != count)
      raise_unless_ok({TAGRID_IO_ERROR, "read_at(" + std::to_string(offset) + ", " + std::to_string(count) +
                                            ") returned " + std::to_string(given) + " bytes"});
  }
};

namespace {

// A vector becomes an array without a copy.
template <class T>
py::array array_of(std::vector<T>&& numbers, std::size_t columns = 1) {
  auto* held = new std::vector<T>(std::move(numbers));
  const py::capsule owner(held, [](void* p) { delete static_cast<std::vector<T>*>(p); });
  std::vector<py::ssize_t> shape = {static_cast<py::ssize_t>(held->size() / columns)};
  if (columns > 1) shape.push_back(static_cast<py::ssize_t>(columns));
  return py::array(py::dtype::of<T>(), shape, held->data(), owner);
}

tagrid_box box_of(const Corners& corners) {
  tagrid_box box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.low[axis] = corners.first[axis];
    box.high[axis] = corners.second[axis];
  }
  return box;
}

// What a sink takes. It must not throw: if memory runs out, it ends the call; so does a signal, which need not wait
// for progress.
struct AnyTaken {
  const Call& call;
  bool out_of_memory = false;

  tagrid_status status_of(tagrid_status status) const {
    return out_of_memory ? TAGRID_OUT_OF_MEMORY : status;
  }
  template <class Add>
  int add(Add more) noexcept {
    if (call.is_interrupted()) return 1;
    try {
      more();
      return 0;
    } catch (...) {
      out_of_memory = true;
      return 1;
    }
  }
};

// The points and cells of a mesh or a surface.
struct Taken : AnyTaken {
  std::size_t sample_size;  // 0: points have no values
  std::size_t corners;      // of a cell
  std::vector<double> points = {};
  std::vector<unsigned char> values = {};
  std::vector<std::int64_t> cells = {};
  std::vector<std::uint8_t> levels = {};

  int add_points(std::size_t count, const double* xyz, const void* samples) noexcept {
    return add([&] {
      points.insert(points.end(), xyz, xyz + 3 * count);
      const auto* first = static_cast<const unsigned char*>(samples);
      values.insert(values.end(), first, first + count * sample_size);
    });
  }
  int add_cells(std::size_t count, const std::int64_t* ids, const std::uint8_t* at) noexcept {
    return add([&] {
      cells.insert(cells.end(), ids, ids + corners * count);
      if (at != nullptr) levels.insert(levels.end(), at, at + count);
    });
  }
};

// A mesh with materials.
struct TakenMaterials : AnyTaken {
  struct Group {
    std::string name;
    std::int64_t label;
    std::vector<std::int64_t> rows;
  };
  std::size_t of_tetrahedron, of_triangle;  // nodes
  std::vector<double> points = {};
  std::vector<Group> materials = {}, surfaces = {};

  static void add_to(std::vector<Group>& groups, const char* name, std::int64_t label,
                     const std::int64_t* first, std::size_t count) {
    if (groups.empty() || groups.back().name != name) groups.push_back({name, label, {}});
    groups.back().rows.insert(groups.back().rows.end(), first, first + count);
  }
};

// Raises unless `out` has room for every sample of the box: nothing else keeps the library within the array.
void check_room(const tagrid_info& info, const Corners& box, const Point& step, const py::array& out) {
  if (out.ndim() != 3) raise_argument_error("the array for samples must have three axes");
  if (!out.writeable()) raise_argument_error("the array for samples is read-only");
  if (type_of(out.dtype()) != info.type) throw py::type_error("the array for samples has another type");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t low = box.first[axis], high = box.second[axis];
    if (low < 0 || low >= high || high > info.dims[axis] || step[axis] < 1)
      raise_argument_error("the box is empty or not within the volume, or a step is below 1");
    if (out.shape(2 - static_cast<py::ssize_t>(axis)) != (high - low - 1) / step[axis] + 1)
      raise_argument_error("the array for samples has another shape than the box");
  }
}

}  // namespace

std::unique_ptr<Reader> Reader::of_path(const py::bytes& path) {
  const std::string name = path;
  auto file = std::make_shared<File>();
  Call call(0, 0, py::none());
  file->work(call, [&] { return tagrid_reader_open_file(name.c_str(), &file->reader); });
  return std::unique_ptr<Reader>(new Reader(std::move(file)));
}

std::unique_ptr<Reader> Reader::open(std::shared_ptr<File> file) {
  tagrid_input input;
  tagrid_input_init(&input);
  input.user = file.get();
  input.name = file->name.c_str();
  input.size = [](void* self, std::uint64_t* bytes) {
    *bytes = static_cast<File*>(self)->size;
    return 0;
  };
  input.read_at = [](void* self, std::uint64_t offset, void* buffer, std::size_t count) {
    return static_cast<File*>(self)->give(offset, buffer, count);
  };
  Call call(0, 0, py::none());
  file->work(call, [&] { return tagrid_reader_open(&input, &file->reader); });
  return std::unique_ptr<Reader>(new Reader(std::move(file)));
}

std::unique_ptr<Reader> Reader::of_buffer(const py::object& buffer, std::string name) {
  auto file = std::make_shared<File>();
  if (PyObject_GetBuffer(buffer.ptr(), &file->buffer, PyBUF_SIMPLE) != 0) throw py::error_already_set();
  file->size = static_cast<std::uint64_t>(file->buffer.len);
  file->name = std::move(name);
  return open(std::move(file));
}

std::unique_ptr<Reader> Reader::of_object(py::object read_at, std::uint64_t size, std::string name) {
  auto file = std::make_shared<File>();
  file->read_at = std::move(read_at);
  file->size = size;
  file->name = std::move(name);
  return open(std::move(file));
}

std::shared_ptr<Reader::File> Reader::file() const {
  if (!file_) raise_argument_error("the volume is closed");
  return file_;
}

py::dict Reader::info() const { return dict_of(file()->info()); }

py::bytes Reader::metadata() const { return tagrid_reader_metadata(file()->reader); }

py::dict Reader::brick(std::int64_t number) const {
  const auto open = file();
  tagrid_brick brick;
  tagrid_brick_init(&brick);
  raise_unless_ok(open->outcome(tagrid_reader_brick(open->reader, number, &brick)));
  return dict_of(brick);
}

py::tuple Reader::overviews() const {
  const auto open = file();
  std::array<std::int64_t, TAGRID_MOST_OVERVIEWS> factors;
  raise_unless_ok(open->outcome(tagrid_reader_overviews(open->reader, factors.data())));
  py::list all;
  for (const std::int64_t factor : factors)
    if (factor != 0) all.append(factor);
  return py::tuple(all);
}

std::int64_t Reader::volumes() const {
  const auto open = file();
  std::int64_t count = 0;
  raise_unless_ok(open->outcome(tagrid_reader_volumes(open->reader, &count)));
  return count;
}

std::unique_ptr<Reader> Reader::nested(std::int64_t number,
                                       tagrid_status (*open_nested)(const tagrid_reader*, std::int64_t,
                                                                    tagrid_reader**)) const {
  auto nested = std::make_shared<File>();
  const auto open = file();
  nested->whole = open->whole ? open->whole : open;
  Call call(0, 0, py::none());
  nested->work(call, [&] { return open_nested(open->reader, number, &nested->reader); });
  return std::unique_ptr<Reader>(new Reader(std::move(nested)));
}

std::unique_ptr<Reader> Reader::overview(std::int64_t factor) const {
  return nested(factor, tagrid_reader_overview);
}

std::unique_ptr<Reader> Reader::volume(std::int64_t number) const {
  return nested(number, tagrid_reader_volume);
}

void Reader::read(const Point& low, const Point& high, const Point& step, py::array out, int threads,
                  std::uint64_t memory_limit, py::object progress) const {
  Call call(threads, memory_limit, std::move(progress));
  const auto open = file();
  const tagrid_info info = open->info();
  check_room(info, {low, high}, step, out);
  const tagrid_box box = box_of({low, high});
  const Point strides = {out.strides(2), out.strides(1), out.strides(0)};
  void* samples = out.mutable_data();
  open->work(call, [&] {
    return tagrid_reader_read(open->reader, &box, step.data(), info.type, samples, strides.data(),
                              call.get());
  });
}

void Reader::verify(int threads, std::uint64_t memory_limit, py::object progress) const {
  Call call(threads, memory_limit, std::move(progress));
  const auto open = file();
  open->work(call, [&] { return tagrid_reader_verify(open->reader, call.get()); });
}

py::array Reader::levels(int threads, std::uint64_t memory_limit, py::object progress) const {
  Call call(threads, memory_limit, std::move(progress));
  const auto open = file();
  std::vector<std::uint64_t> active(static_cast<std::size_t>(open->info().levels) + 1);
  open->work(call, [&] { return tagrid_reader_levels(open->reader, active.data(), call.get()); });
  return array_of(std::move(active));
}

py::tuple Reader::mesh(int level, bool padded, const std::optional<Corners>& corners, int threads,
                       std::uint64_t memory_limit, py::object progress) const {
  Call call(threads, memory_limit, std::move(progress));
  const auto open = file();
  const tagrid_type type = open->info().type;
  Taken taken{{call}, tagrid_sample_size(type), 4};
  tagrid_mesh_sink sink;
  tagrid_mesh_sink_init(&sink);
  sink.user = &taken;
  sink.points = [](void* user, std::size_t count, const double* xyz, const void* samples) {
    return static_cast<Taken*>(user)->add_points(count, xyz, samples);
  };
  sink.tetrahedra = [](void* user, std::size_t count, const std::int64_t* ids, const std::uint8_t* levels) {
    return static_cast<Taken*>(user)->add_cells(count, ids, levels);
  };
  tagrid_mesh_options options;
  tagrid_mesh_options_init(&options);
  const tagrid_box box = box_of(corners.value_or(Corners{}));
  options.level = level;
  options.padded = padded;
  if (corners) options.box = &box;
  open->work(call,
             [&] { return taken.status_of(tagrid_reader_mesh(open->reader, &options, &sink, call.get())); });
  const py::array values = array_of(std::move(taken.values)).attr("view")(dtype_of(type));
  return py::make_tuple(array_of(std::move(taken.points), 3), values, array_of(std::move(taken.cells), 4),
                        array_of(std::move(taken.levels)));
}

py::tuple Reader::material_mesh(const py::dict& given, const std::vector<py::tuple>& materials,
                                const std::optional<Corners>& corners, int threads,
                                std::uint64_t memory_limit, py::object progress) const {
  Call call(threads, memory_limit, std::move(progress));
  const auto open = file();
  tagrid_material_mesh_options options;
  tagrid_material_mesh_options_init(&options);
  std::vector<std::string> names;
  std::vector<tagrid_material> list;
  for (const py::tuple& material : materials) names.push_back(material[0].cast<std::string>());
  for (std::size_t i = 0; i < names.size(); ++i)
    list.push_back({names[i].c_str(), materials[i][1].cast<double>(), materials[i][2].cast<double>(),
                    materials[i][3].cast<std::int64_t>()});
  options.materials = list.data();
  options.material_count = list.size();
  options.labels = given["labels"].cast<bool>();
  options.smoothing = given["smooth"].cast<double>();
  options.fine = given["fine"].cast<double>();
  options.coarse = given["coarse"].cast<double>();
  options.best_angles = given["best_angles"].cast<bool>();
  options.order = given["order"].cast<int>();
  options.largest_parts = given["largest"].cast<bool>();
  options.least_volume = given["least_volume"].cast<double>();
  const std::string folder = given["folder"].cast<std::string>();
  options.folder = folder.c_str();
  const tagrid_box box = box_of(corners.value_or(Corners{}));
  if (corners) options.box = &box;
  TakenMaterials taken{
      {call}, options.order == 2 ? std::size_t{10} : 4, options.order == 2 ? std::size_t{6} : 3};
  tagrid_material_mesh_sink sink;
  tagrid_material_mesh_sink_init(&sink);
  sink.user = &taken;
  sink.points = [](void* user, std::size_t count, const double* xyz) {
    auto& to = *static_cast<TakenMaterials*>(user);
    return to.add([&] { to.points.insert(to.points.end(), xyz, xyz + 3 * count); });
  };
  sink.tetrahedra = [](void* user, const char* name, std::int64_t label, std::size_t count,
                       const std::int64_t* nodes) {
    auto& to = *static_cast<TakenMaterials*>(user);
    return to.add(
        [&] { TakenMaterials::add_to(to.materials, name, label, nodes, to.of_tetrahedron * count); });
  };
  sink.triangles = [](void* user, const char* name, std::size_t count, const std::int64_t* nodes) {
    auto& to = *static_cast<TakenMaterials*>(user);
    return to.add([&] { TakenMaterials::add_to(to.surfaces, name, 0, nodes, to.of_triangle * count); });
  };
  open->work(call, [&] {
    return taken.status_of(tagrid_reader_material_mesh(open->reader, &options, &sink, call.get()));
  });
  py::list of_materials, of_surfaces;
  for (TakenMaterials::Group& group : taken.materials)
    of_materials.append(
        py::make_tuple(group.name, group.label, array_of(std::move(group.rows), taken.of_tetrahedron)));
  for (TakenMaterials::Group& group : taken.surfaces)
    of_surfaces.append(py::make_tuple(group.name, array_of(std::move(group.rows), taken.of_triangle)));
  return py::make_tuple(array_of(std::move(taken.points), 3), of_materials, of_surfaces);
}

py::tuple Reader::surface(double iso, bool rescaled, int level, bool close,
                          const std::optional<Corners>& corners, int threads, std::uint64_t memory_limit,
                          py::object progress) const {
  Call call(threads, memory_limit, std::move(progress));
  const auto open = file();
  Taken taken{{call}, 0, 3};
  tagrid_surface_sink sink;
  tagrid_surface_sink_init(&sink);
  sink.user = &taken;
  sink.points = [](void* user, std::size_t count, const double* xyz) {
    return static_cast<Taken*>(user)->add_points(count, xyz, nullptr);
  };
  sink.triangles = [](void* user, std::size_t count, const std::int64_t* ids) {
    return static_cast<Taken*>(user)->add_cells(count, ids, nullptr);
  };
  tagrid_surface_options options;
  tagrid_surface_options_init(&options);
  const tagrid_box box = box_of(corners.value_or(Corners{}));
  options.level = level;
  options.close = close;
  options.rescaled = rescaled;
  if (corners) options.box = &box;
  open->work(call, [&] {
    return taken.status_of(tagrid_reader_surface(open->reader, iso, &options, &sink, call.get()));
  });
  return py::make_tuple(array_of(std::move(taken.points), 3), array_of(std::move(taken.cells), 3));
}

}  // namespace tagrid_python
