// Versions, texts and defaults of the library.
#include <cmath>

#include "pipeline/job/options.h"
#include "stages/sample/sample_type.h"
#include "tagrid/tagrid.h"

using namespace tagrid;

namespace {

// Everything 0 but the size; false if there is no struct.
template <class Struct>
bool set_up(Struct* given) {
  if (given == nullptr) return false;
  *given = {};
  given->struct_size = sizeof *given;
  return true;
}

}  // namespace

const char* tagrid_version(void) { return TAGRID_VERSION; }

const char* tagrid_status_text(tagrid_status status) {
  constexpr const char* texts[] = {"ok",
                                   "invalid argument",
                                   "broken input",
                                   "input or output failed",
                                   "the memory limit cannot be kept",
                                   "out of memory",
                                   "cancelled",
                                   "a bug in the library"};
  return status >= TAGRID_OK && status <= TAGRID_BUG ? texts[status] : "unknown status";
}

size_t tagrid_sample_size(tagrid_type type) {
  if (type < TAGRID_UINT8 || type > TAGRID_FLOAT64) return 0;
  return size_of(static_cast<SampleType>(type));
}

void tagrid_call_init(tagrid_call* call) { set_up(call); }
void tagrid_input_init(tagrid_input* input) { set_up(input); }
void tagrid_info_init(tagrid_info* info) { set_up(info); }
void tagrid_brick_init(tagrid_brick* brick) { set_up(brick); }
void tagrid_mesh_sink_init(tagrid_mesh_sink* sink) { set_up(sink); }
void tagrid_surface_sink_init(tagrid_surface_sink* sink) { set_up(sink); }

void tagrid_mesh_options_init(tagrid_mesh_options* options) {
  if (set_up(options)) options->level = -1;
}

void tagrid_surface_options_init(tagrid_surface_options* options) {
  if (set_up(options)) options->level = -1;
}

void tagrid_encode_options_init(tagrid_encode_options* options) {
  if (!set_up(options)) return;
  const EncodeOptions defaults;
  options->max_error = options->surface_error = options->mesh_error = NAN;
  options->accuracy = defaults.accuracy;
  options->cube = defaults.cube_size;
  options->lead = defaults.lead;
  options->max_level = -1;
  options->range[0] = options->range[1] = options->field_scale = NAN;
}
