#include "reader.h"

#include <vector>

#include "info.h"

namespace tagrid_python {

// REQUIRES: the GIL, to destroy it.
struct Reader::File {
  std::unique_ptr<Source> source;  // null if the file has a path
  tagrid_reader* reader = nullptr;
  int calls = 0;  // that are running; counted with the GIL

  ~File() { tagrid_reader_close(reader); }

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

  // Does the work, and raises what a callback raised, or the error of the library. Several calls may fail because the
  // same source fails; each raises an exception of the source, which is forgotten after the last one.
  template <class Work>
  void work(Call& call, Work do_it) {
    struct Count {
      File& file;
      explicit Count(File& counted) : file(counted) { ++file.calls; }
      ~Count() {
        if (--file.calls == 0 && file.source) file.source->raised().clear();
      }
    } const count(*this);
    const Outcome ended = run(call, [&] { return outcome(do_it()); });
    // Also if the work was complete before it noticed.
    call.raised().raise();
    if (ended.status == TAGRID_IO_ERROR && source) source->raised().raise();
    raise_unless_ok(ended);
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

// A sink must not throw. If memory runs out, it ends the call; so does a signal, which need not wait for progress.
template <class Add>
int add_or_stop(const Call& call, bool& out_of_memory, Add add) noexcept {
  if (call.is_interrupted()) return 1;
  try {
    add();
    return 0;
  } catch (...) {
    out_of_memory = true;
    return 1;
  }
}

struct TakenMesh {
  const Call& call;
  std::size_t sample_size;
  std::vector<double> points;
  std::vector<unsigned char> values;
  std::vector<std::int64_t> cells;
  std::vector<std::uint8_t> levels;
  bool out_of_memory = false;

  tagrid_mesh_sink sink() {
    tagrid_mesh_sink sink;
    tagrid_mesh_sink_init(&sink);
    sink.user = this;
    sink.points = [](void* user, std::size_t count, const double* xyz, const void* samples) {
      auto& mesh = *static_cast<TakenMesh*>(user);
      return add_or_stop(mesh.call, mesh.out_of_memory, [&] {
        mesh.points.insert(mesh.points.end(), xyz, xyz + 3 * count);
        const auto* first = static_cast<const unsigned char*>(samples);
        mesh.values.insert(mesh.values.end(), first, first + count * mesh.sample_size);
      });
    };
    sink.tetrahedra = [](void* user, std::size_t count, const std::int64_t* ids, const std::uint8_t* at) {
      auto& mesh = *static_cast<TakenMesh*>(user);
      return add_or_stop(mesh.call, mesh.out_of_memory, [&] {
        mesh.cells.insert(mesh.cells.end(), ids, ids + 4 * count);
        mesh.levels.insert(mesh.levels.end(), at, at + count);
      });
    };
    return sink;
  }
};

struct TakenSurface {
  const Call& call;
  std::vector<double> points;
  std::vector<std::int64_t> triangles;
  bool out_of_memory = false;

  tagrid_surface_sink sink() {
    tagrid_surface_sink sink;
    tagrid_surface_sink_init(&sink);
    sink.user = this;
    sink.points = [](void* user, std::size_t count, const double* xyz) {
      auto& taken = *static_cast<TakenSurface*>(user);
      return add_or_stop(taken.call, taken.out_of_memory,
                         [&] { taken.points.insert(taken.points.end(), xyz, xyz + 3 * count); });
    };
    sink.triangles = [](void* user, std::size_t count, const std::int64_t* ids) {
      auto& taken = *static_cast<TakenSurface*>(user);
      return add_or_stop(taken.call, taken.out_of_memory,
                         [&] { taken.triangles.insert(taken.triangles.end(), ids, ids + 3 * count); });
    };
    return sink;
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

std::unique_ptr<Reader> Reader::of_path(const std::string& path) {
  auto file = std::make_shared<File>();
  Call call(0, 0, py::none());
  file->work(call, [&] { return tagrid_reader_open_file(path.c_str(), &file->reader); });
  return std::unique_ptr<Reader>(new Reader(std::move(file)));
}

std::unique_ptr<Reader> Reader::open(std::unique_ptr<Source> source) {
  auto file = std::make_shared<File>();
  file->source = std::move(source);
  const tagrid_input input = file->source->input();
  Call call(0, 0, py::none());
  file->work(call, [&] { return tagrid_reader_open(&input, &file->reader); });
  return std::unique_ptr<Reader>(new Reader(std::move(file)));
}

std::unique_ptr<Reader> Reader::of_buffer(const py::object& buffer, std::string name) {
  return open(std::make_unique<BufferSource>(buffer, std::move(name)));
}

std::unique_ptr<Reader> Reader::of_object(py::object read_at, std::uint64_t size, std::string name) {
  return open(std::make_unique<ObjectSource>(std::move(read_at), size, std::move(name)));
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

void Reader::read(const Corners& corners, const Point& step, py::array out, Call& call) const {
  const auto open = file();
  check_room(open->info(), corners, step, out);
  const tagrid_box box = box_of(corners);
  const Point strides = {out.strides(2), out.strides(1), out.strides(0)};
  void* samples = out.mutable_data();
  open->work(call, [&] {
    return tagrid_reader_read(open->reader, &box, step.data(), samples, strides.data(), call.get());
  });
}

void Reader::verify(Call& call) const {
  const auto open = file();
  open->work(call, [&] { return tagrid_reader_verify(open->reader, call.get()); });
}

py::array Reader::levels(Call& call) const {
  const auto open = file();
  std::vector<std::uint64_t> active(static_cast<std::size_t>(open->info().levels) + 1);
  open->work(call, [&] { return tagrid_reader_levels(open->reader, active.data(), call.get()); });
  return array_of(std::move(active));
}

py::tuple Reader::mesh(int level, bool padded, const std::optional<Corners>& corners, Call& call) const {
  const auto open = file();
  const tagrid_type type = open->info().type;
  TakenMesh mesh{call, tagrid_sample_size(type), {}, {}, {}, {}};
  const tagrid_mesh_sink sink = mesh.sink();
  tagrid_mesh_options options;
  tagrid_mesh_options_init(&options);
  const tagrid_box box = box_of(corners.value_or(Corners{}));
  options.level = level;
  options.padded = padded;
  if (corners) options.box = &box;
  open->work(call, [&] {
    const tagrid_status status = tagrid_reader_mesh(open->reader, &options, &sink, call.get());
    return mesh.out_of_memory ? TAGRID_OUT_OF_MEMORY : status;
  });
  const py::array values = array_of(std::move(mesh.values)).attr("view")(dtype_of(type));
  return py::make_tuple(array_of(std::move(mesh.points), 3), values, array_of(std::move(mesh.cells), 4),
                        array_of(std::move(mesh.levels)));
}

py::tuple Reader::surface(double iso, bool rescaled, int level, bool close,
                          const std::optional<Corners>& corners, Call& call) const {
  const auto open = file();
  TakenSurface surface{call, {}, {}};
  const tagrid_surface_sink sink = surface.sink();
  tagrid_surface_options options;
  tagrid_surface_options_init(&options);
  const tagrid_box box = box_of(corners.value_or(Corners{}));
  options.level = level;
  options.close = close;
  options.rescaled = rescaled;
  if (corners) options.box = &box;
  open->work(call, [&] {
    const tagrid_status status = tagrid_reader_surface(open->reader, iso, &options, &sink, call.get());
    return surface.out_of_memory ? TAGRID_OUT_OF_MEMORY : status;
  });
  return py::make_tuple(array_of(std::move(surface.points), 3), array_of(std::move(surface.triangles), 3));
}

}  // namespace tagrid_python
