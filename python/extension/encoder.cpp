#include "encoder.h"

#include <pybind11/stl.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <utility>
#include <vector>

#include "info.h"

namespace tagrid_python {
Encoder::Encoder(const py::dict& given_options, py::function write, py::object read, int threads,
                 std::uint64_t memory_limit, py::object progress)
    : call_(threads, memory_limit, std::move(progress)),
      write_(std::move(write)),
      read_(std::move(read)),
      process_(getpid()) {
  tagrid_encode_options options;
  tagrid_encode_options_init(&options);
  // Sets a member that is given by name.
  const auto set = [&](const char* name, auto& member) {
    if (given_options.contains(name)) member = given_options[name].cast<std::decay_t<decltype(member)>>();
  };
  const auto dims = given_options["dims"].cast<std::array<std::int64_t, 3>>();
  for (std::size_t axis = 0; axis < 3; ++axis) options.dims[axis] = dims[axis];
  options.type = type_ = type_of(py::dtype::from_args(given_options["dtype"]));
  width_ = dims[0];
  height_ = dims[1];
  std::string metadata;
  set("metadata", metadata);
  options.metadata = metadata.c_str();
  bool grid_only = false;
  set("grid_only", grid_only);
  options.grid_only = grid_only;
  int grid = TAGRID_GRID_DEFAULT;
  set("grid", grid);
  options.grid = static_cast<tagrid_grid>(grid);
  set("max_error", options.max_error);
  set("surface_error", options.surface_error);
  set("mesh_error", options.mesh_error);
  int effort = TAGRID_EFFORT_DEFAULT;
  set("effort", effort);
  options.effort = static_cast<tagrid_effort>(effort);
  set("accuracy", options.accuracy);
  set("cube", options.cube);
  set("brick", options.brick);
  set("lead", options.lead);
  set("max_level", options.max_level);
  set("field_scale", options.field_scale);
  std::array<double, 2> range = {options.range[0], options.range[1]};
  set("range", range);
  options.range[0] = range[0];
  options.range[1] = range[1];
  std::vector<std::int64_t> overviews;
  set("overviews", overviews);
  overviews.push_back(0);
  if (given_options.contains("overviews")) options.overviews = overviews.data();
  std::vector<double> thresholds;
  set("thresholds", thresholds);
  options.thresholds = thresholds.data();
  options.threshold_count = thresholds.size();
  std::string spool;
  set("spool", spool);
  options.spool = spool.c_str();
  int rule = TAGRID_RULE_NONE;
  set("error_rule", rule);
  options.error_rule = static_cast<tagrid_error_rule>(rule);
  set("error_rule_value", options.error_rule_value);
  if (!read_.is_none()) {
    options.read_samples = give;
    options.read_user = this;
  }
  try {
    work([&] { return tagrid_encoder_open(&options, take, this, call_.get(), &encoder_); });
  } catch (...) {
    cancel();
    throw;
  }
  read_ = py::none();  // and what it keeps in memory
}

Encoder::~Encoder() { cancel(); }

void Encoder::check_caller() const {
  if (!is_of_this_process())
    raise_argument_error("the writer belongs to the process that made it, and this one was forked from it");
  if (call_.is_calling_back())
    raise_argument_error("a writer cannot be used by its own callback; raise an exception to end the work");
}

// What Python raises is kept for the call that waits. Returns 0 if `work` returns true.
template <class Work>
int Encoder::called_back(Work work) noexcept {
  const WithGil gil;
  const Call::CallingBack mark(call_);
  try {
    return work() ? 0 : 1;
  } catch (const py::error_already_set& error) {
    raised_.keep(error);
    return 1;
  } catch (...) {
    return 1;
  }
}

int Encoder::take(void* self, const void* bytes, std::size_t count) noexcept {
  auto* encoder = static_cast<Encoder*>(self);
  return encoder->called_back([&] {
    encoder->write_(py::bytes(static_cast<const char*>(bytes), count));
    return true;
  });
}

int Encoder::give(void* self, std::int64_t first, std::int64_t count, void* samples) noexcept {
  auto* encoder = static_cast<Encoder*>(self);
  return encoder->called_back([&] {
    const py::buffer_info given = encoder->read_(first, count).cast<py::buffer>().request();
    const auto bytes = static_cast<std::size_t>(given.size * given.itemsize);
    if (bytes != static_cast<std::size_t>(count * dtype_of(encoder->type_).itemsize())) return false;
    std::memcpy(samples, given.ptr, bytes);
    return true;
  });
}

template <class Work>
void Encoder::work(Work do_it) {
  check_caller();
  const Outcome ended = run_without_gil(call_, [&]() -> Outcome {
    const std::lock_guard lock(turn_);
    const tagrid_status status = do_it();
    if (status == TAGRID_OK) return {};
    return {status, encoder_ != nullptr ? tagrid_encoder_message(encoder_) : "the encoder is closed"};
  });
  // Also if the work was complete before it noticed.
  call_.raised().raise();
  raised_.raise();
  raise_unless_ok(ended);
}

void Encoder::write(const py::array& slices) {
  if (slices.ndim() != 3 || slices.shape(1) != height_ || slices.shape(2) != width_)
    raise_argument_error("slices must be an array of " + std::to_string(height_) + " x " +
                         std::to_string(width_) + " samples each");
  if (type_of(slices.dtype()) != type_)
    throw py::type_error("the slices are of another type than the volume");
  const std::array<std::int64_t, 3> strides = {slices.strides(2), slices.strides(1), slices.strides(0)};
  const void* samples = slices.data();
  const std::int64_t count = slices.shape(0);
  work([&] { return tagrid_encoder_write(encoder_, samples, count, strides.data()); });
}

py::dict Encoder::finish() {
  tagrid_info info;
  tagrid_info_init(&info);
  work([&] { return tagrid_encoder_finish(encoder_, &info); });
  return dict_of(info);
}

void Encoder::close() {
  if (is_of_this_process()) check_caller();
  cancel();
}

void Encoder::cancel() {
  // A thread of the encoder that waits for the GIL while the interpreter ends waits forever.
  if (!is_of_this_process() || python_is_ending()) return;
  // Its threads may be about to write, for which they need the GIL.
  const WithoutGil released;
  const std::lock_guard lock(turn_);
  tagrid_encoder_close(std::exchange(encoder_, nullptr));
}

}  // namespace tagrid_python
