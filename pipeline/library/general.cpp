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
