// tagrid.h for C++20: handles that close themselves, spans, and exceptions. Header only; link libtagrid.
//
//     tagrid::Reader scan("scan.tag");
//     const std::vector<std::int16_t> part = scan.read<std::int16_t>({{100, 100, 40}, {164, 164, 104}});
//
// See tagrid.h for the calls, units, axis order and threads.
#pragma once

#if __cplusplus < 202002L
#error "tagrid.hpp needs C++20"
#endif

#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "tagrid/tagrid.h"

namespace tagrid {
// This is part of the name of every function, so that it never clashes with a function from a library that
// was built with another version of this file.
inline namespace v1 {

/// A call that failed: what() is its message, status() its kind.
class Error : public std::runtime_error {
 public:
  Error(tagrid_status status, const std::string& message)
      : std::runtime_error(message.empty() ? tagrid_status_text(status) : message), status_(status) {}
  tagrid_status status() const noexcept { return status_; }  ///< its kind

 private:
  tagrid_status status_;
};

/// The number of a C++ type of samples.
template <class T>
constexpr tagrid_type type_of() {
  if constexpr (std::is_same_v<T, std::uint8_t>)
    return TAGRID_UINT8;
  else if constexpr (std::is_same_v<T, std::int8_t>)
    return TAGRID_INT8;
  else if constexpr (std::is_same_v<T, std::uint16_t>)
    return TAGRID_UINT16;
  else if constexpr (std::is_same_v<T, std::int16_t>)
    return TAGRID_INT16;
  else if constexpr (std::is_same_v<T, std::uint32_t>)
    return TAGRID_UINT32;
  else if constexpr (std::is_same_v<T, std::int32_t>)
    return TAGRID_INT32;
  else if constexpr (std::is_same_v<T, float>)
    return TAGRID_FLOAT32;
  else {
    static_assert(std::is_same_v<T, double>, "samples are integers of 8, 16 or 32 bits, float or double");
    return TAGRID_FLOAT64;
  }
}

using Point = std::array<std::int64_t, 3>;  ///< x, y, z

/// The samples from `low` up to, but not including, `high`.
struct Box {
  Point low = {0, 0, 0};   ///< the first sample
  Point high = {0, 0, 0};  ///< one beyond the last sample, along each axis
};

/// Limits of a call, and its progress; the defaults are those of tagrid_call_init().
struct Call {
  int threads = 0;                 ///< 0: one for each core of the process
  std::uint64_t memory_limit = 0;  ///< bytes; 0: no limit, see tagrid_call
  /// Takes the bytes of samples that are done, and their total; returns false to cancel. Its exceptions are
  /// rethrown.
  std::function<bool(std::uint64_t done, std::uint64_t total)> progress = {};
};

namespace detail {

/// Does the work of a callback, from which C takes no exception: keeps it, and returns 1.
template <class Work>
int without_throwing(std::exception_ptr& thrown, Work work) noexcept {
  try {
    work();
    return 0;
  } catch (...) {
    thrown = std::current_exception();
    return 1;
  }
}

/// A Call in the form of the C interface, and the exception of its callback.
class CallForC {
 public:
  explicit CallForC(const Call& call) : call_(call) {
    tagrid_call_init(&c_);
    c_.threads = call.threads;
    c_.memory_limit = call.memory_limit;
    c_.progress_user = this;
    if (call.progress)
      c_.progress = [](void* self, std::uint64_t done, std::uint64_t total) {
        return static_cast<CallForC*>(self)->tell(done, total);
      };
  }
  CallForC(const CallForC&) = delete;
  CallForC& operator=(const CallForC&) = delete;
  const tagrid_call* get() const { return &c_; }
  void rethrow() const {
    if (thrown_) std::rethrow_exception(thrown_);
  }

 private:
  int tell(std::uint64_t done, std::uint64_t total) noexcept {
    bool goes_on = false;
    without_throwing(thrown_, [&] { goes_on = call_.progress(done, total); });
    return goes_on ? 0 : 1;
  }

  Call call_;
  tagrid_call c_;
  std::exception_ptr thrown_;
};

/// What a sink took so far, and the exception that ended it.
template <class Whole>
struct Taken {
  template <class Add>
  int add(Add more) noexcept {
    return without_throwing(thrown, [&] { more(whole); });
  }

  Whole whole;
  std::exception_ptr thrown;
};

}  // namespace detail

/// A place from which a .tag file can be read. Both functions may throw; read_at is called by several threads
/// at once.
class Input {
 public:
  virtual ~Input() = default;
  virtual std::uint64_t size() = 0;  ///< the bytes of the file
  /// Fills `to` with the bytes from `offset` on.
  virtual void read_at(std::uint64_t offset, std::span<std::byte> to) = 0;
};

/// A mesh, all of it in memory.
template <class T>
struct Mesh {
  std::vector<double> points;            ///< x, y, z of each point, in the world
  std::vector<T> values;                 ///< one per point
  std::vector<std::int64_t> tetrahedra;  ///< four point numbers for each
  std::vector<std::uint8_t> levels;      ///< one per tetrahedron
};

/// A mesh with materials, all of it in memory.
struct MaterialMesh {
  struct Material {                        ///< its tetrahedra
    std::string name;                      ///< as given, or made of the label
    std::int64_t label = 0;                ///< see tagrid_material_mesh_sink
    std::vector<std::int64_t> tetrahedra;  ///< 4 or 10 point numbers for each
  };
  struct Surface {                        ///< its triangles
    std::string name;                     ///< of both materials, or of one and a side of the box
    std::vector<std::int64_t> triangles;  ///< 3 or 6 point numbers for each
  };
  std::vector<double> points;       ///< x, y, z of each point, in the world
  std::vector<Material> materials;  ///< by value or label
  std::vector<Surface> surfaces;    ///< where a material ends
};

/// A surface of triangles, all of it in memory.
struct Surface {
  std::vector<double> points;           ///< x, y, z of each point, in the world
  std::vector<std::int64_t> triangles;  ///< three point numbers for each
};

/// An open .tag file; see tagrid_reader.
class Reader {
 public:
  explicit Reader(const std::string& path) {  ///< see tagrid_reader_open_file()
    const tagrid_status status = tagrid_reader_open_file(path.c_str(), &reader_);
    own(status);
  }
  /// `input` must outlive the reader.
  explicit Reader(Input& input, const std::string& name = "input") {
    tagrid_input c;
    tagrid_input_init(&c);
    c.user = &input;
    c.name = name.c_str();
    c.size = [](void* user, std::uint64_t* bytes) noexcept {
      std::exception_ptr thrown;
      return detail::without_throwing(thrown, [&] { *bytes = static_cast<Input*>(user)->size(); });
    };
    c.read_at = [](void* user, std::uint64_t offset, void* buffer, std::size_t count) noexcept {
      std::exception_ptr thrown;
      return detail::without_throwing(thrown, [&] {
        static_cast<Input*>(user)->read_at(offset, {static_cast<std::byte*>(buffer), count});
      });
    };
    own(tagrid_reader_open(&c, &reader_));
  }
  Reader(Reader&& other) noexcept : reader_(std::exchange(other.reader_, nullptr)) {}
  Reader& operator=(Reader&& other) noexcept {
    std::swap(reader_, other.reader_);
    return *this;
  }
  ~Reader() { tagrid_reader_close(reader_); }

  tagrid_info info() const {  ///< see tagrid_reader_info()
    tagrid_info info;
    tagrid_info_init(&info);
    check(tagrid_reader_info(reader_, &info));
    return info;
  }
  /// The whole volume.
  Box box() const {
    const tagrid_info i = info();
    return {{0, 0, 0}, {i.dims[0], i.dims[1], i.dims[2]}};
  }
  std::string metadata() const { return tagrid_reader_metadata(reader_); }  ///< see tagrid_reader_metadata()
  tagrid_brick brick(std::int64_t number) const {                           ///< see tagrid_reader_brick()
    tagrid_brick brick;
    tagrid_brick_init(&brick);
    check(tagrid_reader_brick(reader_, number, &brick));
    return brick;
  }

  /// The samples of `box` at low, low + step, ... on each axis, x fastest. Throws Error with
  /// TAGRID_INVALID_ARGUMENT if T is not the type of the samples.
  template <class T>
  std::vector<T> read(const Box& box, const Point& step = {1, 1, 1}, const Call& call = {}) const {
    std::vector<T> samples(sample_count(box, step));
    read_to<T>(box, step, samples, call);
    return samples;
  }
  /// The same, into memory of the caller that has room for every sample.
  template <class T>
  void read_to(const Box& box, const Point& step, std::span<T> samples, const Call& call = {}) const {
    const tagrid_box c = c_box(box);
    if (samples.size() < sample_count(box, step))
      throw Error(TAGRID_INVALID_ARGUMENT, "the buffer is too small for all samples");
    run(call, [&](const tagrid_call* settings) {
      return tagrid_reader_read(reader_, &c, step.data(), type_of<T>(), samples.data(), nullptr, settings);
    });
  }

  /// The factors of the overviews, from fine to coarse.
  std::vector<std::int64_t> overviews() const {
    std::vector<std::int64_t> factors(TAGRID_MOST_OVERVIEWS);
    check(tagrid_reader_overviews(reader_, factors.data()));
    std::erase(factors, 0);
    return factors;
  }
  /// The overview with a factor; see tagrid_reader_overview().
  Reader overview(std::int64_t factor) const {
    Reader opened;
    opened.own(tagrid_reader_overview(reader_, factor, &opened.reader_));
    return opened;
  }

  /// The number of volumes; see tagrid_reader_volumes().
  std::int64_t volumes() const {
    std::int64_t count = 0;
    check(tagrid_reader_volumes(reader_, &count));
    return count;
  }
  /// The volume with a number, from 0 on; see tagrid_reader_volume().
  Reader volume(std::int64_t number) const {
    Reader opened;
    opened.own(tagrid_reader_volume(reader_, number, &opened.reader_));
    return opened;
  }

  /// The number of active points of each level of the grid: see tagrid_reader_levels().
  std::vector<std::uint64_t> levels(const Call& call = {}) const {
    std::vector<std::uint64_t> active(static_cast<std::size_t>(info().levels) + 1);
    run(call,
        [&](const tagrid_call* settings) { return tagrid_reader_levels(reader_, active.data(), settings); });
    return active;
  }

  /// Throws Error with TAGRID_BROKEN_INPUT for the first thing that is wrong.
  void verify(const Call& call = {}) const {
    run(call, [&](const tagrid_call* settings) { return tagrid_reader_verify(reader_, settings); });
  }

  /// The tetrahedra of the grid; see tagrid_reader_mesh() for the options.
  template <class T>
  Mesh<T> mesh(const tagrid_mesh_options* options = nullptr, const Call& call = {}) const {
    if (info().type != type_of<T>())
      throw Error(TAGRID_INVALID_ARGUMENT, "the samples of the file are of another type");
    using Taken = detail::Taken<Mesh<T>>;
    Taken taken;
    tagrid_mesh_sink sink;
    tagrid_mesh_sink_init(&sink);
    sink.user = &taken;
    sink.points = [](void* user, std::size_t count, const double* xyz, const void* values) noexcept {
      return static_cast<Taken*>(user)->add([&](Mesh<T>& mesh) {
        mesh.points.insert(mesh.points.end(), xyz, xyz + 3 * count);
        const T* first = static_cast<const T*>(values);
        mesh.values.insert(mesh.values.end(), first, first + count);
      });
    };
    sink.tetrahedra = [](void* user, std::size_t count, const std::int64_t* points,
                         const std::uint8_t* levels) noexcept {
      return static_cast<Taken*>(user)->add([&](Mesh<T>& mesh) {
        mesh.tetrahedra.insert(mesh.tetrahedra.end(), points, points + 4 * count);
        mesh.levels.insert(mesh.levels.end(), levels, levels + count);
      });
    };
    return all_of(taken, call, [&](const tagrid_call* settings) {
      return tagrid_reader_mesh(reader_, options, &sink, settings);
    });
  }

  /// A mesh of materials, for solvers; see tagrid_reader_material_mesh() for the options.
  MaterialMesh material_mesh(const tagrid_material_mesh_options& options, const Call& call = {}) const {
    using Taken = detail::Taken<MaterialMesh>;
    Taken taken;
    tagrid_material_mesh_sink sink;
    tagrid_material_mesh_sink_init(&sink);
    sink.user = &taken;
    sink.points = [](void* user, std::size_t count, const double* xyz) noexcept {
      return static_cast<Taken*>(user)->add(
          [&](MaterialMesh& mesh) { mesh.points.insert(mesh.points.end(), xyz, xyz + 3 * count); });
    };
    // With 10 nodes, 6 more for each tetrahedron, and 3 more for each triangle.
    const auto add = options.order == 2 ? add_rows<10, 6> : add_rows<4, 3>;
    sink.tetrahedra = add.first;
    sink.triangles = add.second;
    return all_of(taken, call, [&](const tagrid_call* settings) {
      return tagrid_reader_material_mesh(reader_, &options, &sink, settings);
    });
  }

  /// The isosurface of a value; see tagrid_reader_surface() for the options.
  Surface surface(double iso, const tagrid_surface_options* options = nullptr, const Call& call = {}) const {
    using Taken = detail::Taken<Surface>;
    Taken taken;
    tagrid_surface_sink sink;
    tagrid_surface_sink_init(&sink);
    sink.user = &taken;
    sink.points = [](void* user, std::size_t count, const double* xyz) noexcept {
      return static_cast<Taken*>(user)->add(
          [&](Surface& surface) { surface.points.insert(surface.points.end(), xyz, xyz + 3 * count); });
    };
    sink.triangles = [](void* user, std::size_t count, const std::int64_t* points) noexcept {
      return static_cast<Taken*>(user)->add([&](Surface& surface) {
        surface.triangles.insert(surface.triangles.end(), points, points + 3 * count);
      });
    };
    return all_of(taken, call, [&](const tagrid_call* settings) {
      return tagrid_reader_surface(reader_, iso, options, &sink, settings);
    });
  }

 private:
  /// The functions of a sink for tetrahedra and triangles with so many nodes.
  template <std::size_t of_tetrahedron, std::size_t of_triangle>
  static constexpr std::pair<decltype(tagrid_material_mesh_sink::tetrahedra),
                             decltype(tagrid_material_mesh_sink::triangles)>
      add_rows = {[](void* user, const char* name, std::int64_t label, std::size_t count,
                     const std::int64_t* points) noexcept {
                    return static_cast<detail::Taken<MaterialMesh>*>(user)->add([&](MaterialMesh& mesh) {
                      auto& all = mesh.materials;
                      if (all.empty() || all.back().name != name) all.push_back({name, label, {}});
                      auto& rows = all.back().tetrahedra;
                      rows.insert(rows.end(), points, points + of_tetrahedron * count);
                    });
                  },
                  [](void* user, const char* name, std::size_t count, const std::int64_t* points) noexcept {
                    return static_cast<detail::Taken<MaterialMesh>*>(user)->add([&](MaterialMesh& mesh) {
                      auto& all = mesh.surfaces;
                      if (all.empty() || all.back().name != name) all.push_back({name, {}});
                      auto& rows = all.back().triangles;
                      rows.insert(rows.end(), points, points + of_triangle * count);
                    });
                  }};

  Reader() = default;
  static tagrid_box c_box(const Box& box) {
    tagrid_box c;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      c.low[axis] = box.low[axis];
      c.high[axis] = box.high[axis];
    }
    return c;
  }
  // What a sink took during the work.
  template <class Whole, class Work>
  Whole all_of(detail::Taken<Whole>& taken, const Call& call, Work work) const {
    try {
      run(call, work);
    } catch (const Error&) {
      if (taken.thrown) std::rethrow_exception(taken.thrown);
      throw;
    }
    return std::move(taken.whole);
  }
  // The box is checked first, so that nothing overflows, and no memory is taken for a box outside the volume.
  std::size_t sample_count(const Box& box, const Point& step) const {
    const Box all = this->box();
    std::size_t count = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (box.low[axis] < 0 || box.high[axis] > all.high[axis])
        throw Error(TAGRID_INVALID_ARGUMENT, "the box is not within the volume");
      if (step[axis] < 1 || box.high[axis] <= box.low[axis])
        throw Error(TAGRID_INVALID_ARGUMENT, "the box is empty, or a step is below 1");
      count *= static_cast<std::size_t>((box.high[axis] - box.low[axis] - 1) / step[axis] + 1);
    }
    return count;
  }
  void check(tagrid_status status) const {
    if (status != TAGRID_OK) throw Error(status, tagrid_reader_message(reader_));
  }
  template <class Work>
  void run(const Call& call, Work work) const {
    const detail::CallForC settings(call);
    const tagrid_status status = work(settings.get());
    settings.rethrow();
    check(status);
  }
  // If the constructor fails, the destructor is not called.
  void own(tagrid_status status) {
    if (status == TAGRID_OK) return;
    const Error error(status, reader_ != nullptr ? tagrid_reader_message(reader_) : "");
    tagrid_reader_close(std::exchange(reader_, nullptr));
    throw error;
  }

  tagrid_reader* reader_ = nullptr;
};

/// Takes the bytes of a .tag file, in order. May throw.
using Output = std::function<void(std::span<const std::byte> bytes)>;

/// An encoder; see tagrid_encoder.
class Encoder {
 public:
  /// `options` from tagrid_encode_options_init(), with dims and type.
  Encoder(const tagrid_encode_options& options, Output output, const Call& call = {})
      : state_(std::make_unique<State>(std::move(output), call)), type_(options.type) {
    for (std::size_t axis = 0; axis < 2; ++axis) slice_ *= static_cast<std::size_t>(options.dims[axis]);
    const tagrid_status status =
        tagrid_encoder_open(&options, State::write, state_.get(), state_->call.get(), &state_->encoder);
    check(status);
  }

  /// Takes whole slices, x fastest.
  template <class T>
  void write(std::span<const T> samples) {
    if (type_ != type_of<T>()) throw Error(TAGRID_INVALID_ARGUMENT, "the volume has samples of another type");
    if (samples.size() % slice_ != 0)
      throw Error(TAGRID_INVALID_ARGUMENT, "the samples are not a whole number of slices");
    check(tagrid_encoder_write(state_->encoder, samples.data(),
                               static_cast<std::int64_t>(samples.size() / slice_), nullptr));
  }
  template <class T>
  void write(const std::vector<T>& samples) {  ///< the same
    write(std::span<const T>(samples));
  }
  /// Waits until the last byte has been written. The file is complete only if this does not throw.
  tagrid_info finish() {
    tagrid_info info;
    tagrid_info_init(&info);
    check(tagrid_encoder_finish(state_->encoder, &info));
    return info;
  }

 private:
  struct State {
    State(Output given_output, const Call& given_call) : output(std::move(given_output)), call(given_call) {}
    State(const State&) = delete;
    State& operator=(const State&) = delete;
    ~State() { tagrid_encoder_close(encoder); }

    static int write(void* self, const void* bytes, std::size_t count) noexcept {
      auto* state = static_cast<State*>(self);
      return detail::without_throwing(state->thrown, [&] {
        state->output({static_cast<const std::byte*>(bytes), count});
      });
    }

    Output output;
    detail::CallForC call;
    std::exception_ptr thrown;
    tagrid_encoder* encoder = nullptr;
  };

  void check(tagrid_status status) const {
    if (status == TAGRID_OK) return;
    if (state_->thrown) std::rethrow_exception(state_->thrown);
    state_->call.rethrow();
    throw Error(status, state_->encoder != nullptr ? tagrid_encoder_message(state_->encoder) : "");
  }

  std::unique_ptr<State> state_;
  tagrid_type type_;
  std::size_t slice_ = 1;
};

}  // namespace v1
}  // namespace tagrid
