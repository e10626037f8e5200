// Versions, texts and the defaults of structs.
#include "pipeline/library/answers.h"
#include "stages/sample/sample_type.h"
#include "tagrid/tagrid.h"

using namespace tagrid;
using namespace tagrid::library;

const char* tagrid_version(void) { return TAGRID_VERSION; }

const char* tagrid_status_text(tagrid_status status) {
  constexpr const char* texts[] = {"ok",
                                   "invalid argument",
                                   "broken input",
                                   "input or output failed",
                                   "the memory limit cannot be kept",
                                   "out of memory",
                                   "cancelled",
                                   "a bug in the library",
                                   "bytes are needed",
                                   "a newer version of the format"};
  return status >= TAGRID_OK && status <= TAGRID_NEWER_FORMAT ? texts[status] : "unknown status";
}

size_t tagrid_sample_size(tagrid_type type) {
  if (type < TAGRID_UINT8 || type > TAGRID_FLOAT64) return 0;
  return size_of(static_cast<SampleType>(type));
}

void tagrid_call_init_sized(tagrid_call* call, size_t size) { set_up(call, size); }
void tagrid_input_init_sized(tagrid_input* input, size_t size) { set_up(input, size); }
void tagrid_info_init_sized(tagrid_info* info, size_t size) { set_up(info, size); }
void tagrid_brick_init_sized(tagrid_brick* brick, size_t size) { set_up(brick, size); }
void tagrid_mesh_sink_init_sized(tagrid_mesh_sink* sink, size_t size) { set_up(sink, size); }
void tagrid_surface_sink_init_sized(tagrid_surface_sink* sink, size_t size) { set_up(sink, size); }

void tagrid_mesh_options_init_sized(tagrid_mesh_options* options, size_t size) {
  tagrid_mesh_options defaults = {};
  defaults.level = -1;
  set_up(options, size, defaults);
}

void tagrid_material_mesh_sink_init_sized(tagrid_material_mesh_sink* sink, size_t size) {
  set_up(sink, size);
}
void tagrid_material_mesh_options_init_sized(tagrid_material_mesh_options* options, size_t size) {
  tagrid_material_mesh_options defaults = {};
  defaults.smoothing = 1;
  defaults.order = 1;
  set_up(options, size, defaults);
}

void tagrid_surface_options_init_sized(tagrid_surface_options* options, size_t size) {
  tagrid_surface_options defaults = {};
  defaults.level = -1;
  set_up(options, size, defaults);
}
