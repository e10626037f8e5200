// The encoder of the library.
#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <memory>

#include "io/errors/errors.h"
#include "io/metadata/fields.h"
#include "io/metadata/metadata.h"
#include "io/metadata/text.h"
#include "pipeline/job/options.h"
#include "pipeline/library/calls.h"
#include "pipeline/library/push_encoder.h"
#include "pipeline/memory/plan.h"
#include "stages/overview/block_sums.h"

using namespace tagrid;
using namespace tagrid::library;

namespace {

class CallbackSink : public ByteSink {
 public:
  CallbackSink(tagrid_write function, void* user) : function_(function), user_(user) {}
  void write(std::span<const std::byte> bytes) override {
    if (bytes.empty()) return;
    if (const int error = function_(user_, bytes.data(), bytes.size()); error != 0)
      throw WorldError("cannot write the output: error " + std::to_string(error));
  }

 private:
  tagrid_write function_;
  void* user_;
};

// The samples of a caller, for what follows from them.
class SamplesOfCaller : public VolumeSource {
 public:
  SamplesOfCaller(const VolumeInfo& info, tagrid_read_samples function, void* user)
      : VolumeSource(facts_of(info)), function_(function), user_(user) {}
  std::uint64_t bytes_read() const override { return 0; }

 private:
  static SourceFacts facts_of(const VolumeInfo& info) {
    SourceFacts facts;
    facts.info = info;
    facts.name = "the volume";
    facts.traits = {.again = true, .any_rows = true};
    return facts;
  }
  void read(std::byte* out, std::int64_t first, std::int64_t count) override {
    if (const int error = function_(user_, first, count, out); error != 0)
      throw WorldError("cannot read the samples: error " + std::to_string(error));
  }
  void seek(std::int64_t) override {}
  void end() override {}

  tagrid_read_samples function_;
  void* user_;
};

std::optional<double> unless_nan(double value) {
  return std::isnan(value) ? std::nullopt : std::optional(value);
}

// Factors up to a 0, or up to the first one that the options do not allow: the list may have no 0 then.
std::vector<int> factors_of(const std::int64_t* factors) {
  std::vector<int> found;
  for (std::int64_t before = 0; *factors != 0; before = *factors++) {
    const auto factor = static_cast<std::uint64_t>(*factors);
    const bool is_power_of_4 = std::has_single_bit(factor) && std::countr_zero(factor) % 2 == 0;
    const bool is_allowed = *factors > before && *factors > 1 && *factors <= largest_factor && is_power_of_4;
    found.push_back(is_allowed ? static_cast<int>(*factors) : -1);
    if (!is_allowed) break;
  }
  return found;
}

EncodeOptions options_of(const tagrid_encode_options& given) {
  EncodeOptions options;
  options.grid_only = given.grid_only != 0;
  require(given.grid >= TAGRID_GRID_DEFAULT && given.grid <= TAGRID_GRID_DERIVED, "there is no such grid");
  if (given.grid != TAGRID_GRID_DEFAULT)
    options.grid = given.grid == TAGRID_GRID_DERIVED ? GridOrigin::derived : GridOrigin::stored;
  options.max_error = unless_nan(given.max_error);
  options.surface_error = unless_nan(given.surface_error);
  options.mesh_error = unless_nan(given.mesh_error);
  require(given.effort >= TAGRID_EFFORT_DEFAULT && given.effort <= TAGRID_EFFORT_BEST,
          "there is no such effort");
  options.effort = static_cast<Effort>(given.effort);
  options.accuracy = given.accuracy;
  options.cube_size = given.cube;
  if (given.brick != 0) options.brick_edge = given.brick;
  require(given.lead == 0 || given.lead == 1, "lead must be 0 or 1");
  options.lead = given.lead;
  require(given.max_level >= -1, "max_level must be a level, or -1");
  if (given.max_level >= 0) options.max_level = given.max_level;
  if (!std::isnan(given.range[0]) || !std::isnan(given.range[1]))
    options.range = {given.range[0], given.range[1]};
  options.field_scale = unless_nan(given.field_scale);
  options.range_from_data = given.range_from_data != 0;
  require(given.error_rule >= TAGRID_RULE_NONE && given.error_rule <= TAGRID_RULE_BITS,
          "there is no such error_rule");
  constexpr ErrorRule::Kind kinds[] = {ErrorRule::Kind::noise, ErrorRule::Kind::relative,
                                       ErrorRule::Kind::psnr, ErrorRule::Kind::ratio, ErrorRule::Kind::bits};
  if (given.error_rule != TAGRID_RULE_NONE)
    options.error_rule = ErrorRule{kinds[given.error_rule - TAGRID_RULE_NOISE], given.error_rule_value};
  // One more than allowed is refused like any larger number.
  require(given.threshold_count == 0 || given.thresholds != nullptr,
          "threshold_count is given without thresholds");
  if (given.thresholds != nullptr)
    options.thresholds.assign(given.thresholds,
                              given.thresholds + std::min(given.threshold_count, most_thresholds + 1));
  if (given.overviews != nullptr) options.overviews = factors_of(given.overviews);
  return options;
}

// Entries with the same content; none if nothing is known.
MetadataEntries entries_of(const tagrid_geometry& geometry) {
  const auto vector = [](const double* v) { return fmt::format("({},{},{})", v[0], v[1], v[2]); };
  const std::array<double, 3> spacing = {geometry.spacing[0], geometry.spacing[1], geometry.spacing[2]};
  bool is_known = geometry.has_spacing;
  for (const double length : spacing) is_known &= !std::isnan(length);
  MetadataEntries entries;
  // Directions would state a distance between samples, but it is unknown.
  const bool has_origin = geometry.has_origin,
             are_directions_known = geometry.has_directions || (has_origin && is_known);
  if (!are_directions_known && geometry.has_spacing) add_spacings(spacing, entries);
  if (geometry.has_directions || has_origin) entries.add_field("space dimension", "3");
  if (are_directions_known) {
    std::string directions;
    for (int axis = 0; axis < 3; ++axis) {
      double along_axis[3] = {0, 0, 0};
      along_axis[axis] = geometry.spacing[axis];
      directions += axis == 0 ? "" : " ";
      directions += vector(geometry.has_directions ? geometry.directions[axis] : along_axis);
    }
    entries.add_field("space directions", directions);
  }
  if (has_origin) entries.add_field("space origin", vector(geometry.origin));
  return entries;
}

VolumeInfo volume_of(const tagrid_encode_options& given) {
  VolumeInfo info;
  for (int axis = 0; axis < 3; ++axis) info.dims[axis] = given.dims[axis];
  require(is_volume_size(info.dims), "dims must be from 1 to 2^31 each, and at most 2^58 samples");
  require(given.type >= TAGRID_UINT8 && given.type <= TAGRID_FLOAT64, "there is no such sample type");
  info.type = static_cast<SampleType>(given.type);
  try {
    MetadataEntries entries;
    if (given.geometry != nullptr) entries = entries_of(*given.geometry);
    if (given.metadata != nullptr) add_text(given.metadata, entries);
    info.metadata = Metadata(std::move(entries));
  } catch (const BrokenInput& broken) {
    throw UsageError(std::string("geometry or metadata: ") + broken.what());
  }
  return info;
}

tagrid_encode_options taken_over_options(const tagrid_encode_options* options) {
  require(options != nullptr, "there are no options");
  return taken_over(options, tagrid_encode_options_init, sizeof *options);
}

}  // namespace

void tagrid_encode_options_init_sized(tagrid_encode_options* options, size_t size) {
  const EncodeOptions usual;
  tagrid_encode_options defaults = {};
  defaults.max_error = defaults.surface_error = defaults.mesh_error = NAN;
  defaults.accuracy = usual.accuracy;
  defaults.cube = usual.cube_size;
  defaults.lead = usual.lead;
  defaults.max_level = -1;
  defaults.range[0] = defaults.range[1] = defaults.field_scale = NAN;
  set_up(options, size, defaults);
}

struct tagrid_encoder {
  std::unique_ptr<CallbackSink> sink;
  std::unique_ptr<PushEncoder> work;
  // Threads may take turns with the encoder.
  SharedMessage messages;
};

tagrid_status tagrid_encoder_open(const tagrid_encode_options* options, tagrid_write write, void* user,
                                  const tagrid_call* given, tagrid_encoder** encoder) {
  if (encoder == nullptr) return TAGRID_INVALID_ARGUMENT;
  *encoder = new (std::nothrow) tagrid_encoder;
  if (*encoder == nullptr) return TAGRID_OUT_OF_MEMORY;
  return call((*encoder)->messages, [&] {
    require(write != nullptr, "there is no function to write with");
    const tagrid_encode_options wanted = taken_over_options(options);
    const tagrid_call settings = settings_of(given);
    Resources resources = resources_of(settings);
    resources.spool = wanted.spool != nullptr ? wanted.spool : "/tmp";
    (*encoder)->sink = std::make_unique<CallbackSink>(write, user);
    const VolumeInfo info = volume_of(wanted);
    std::optional<SamplesOfCaller> samples;
    if (wanted.read_samples != nullptr) samples.emplace(info, wanted.read_samples, wanted.read_user);
    (*encoder)->work = std::make_unique<PushEncoder>(info, options_of(wanted), resources, *(*encoder)->sink,
                                                     progress_of(settings), samples ? &*samples : nullptr);
  });
}

tagrid_status tagrid_encoder_write(tagrid_encoder* encoder, const void* samples, int64_t slices,
                                   const int64_t* strides) {
  if (encoder == nullptr) return TAGRID_INVALID_ARGUMENT;
  return call(encoder->messages, [&] {
    require(encoder->work != nullptr, "the encoder is not open");
    require(samples != nullptr || slices == 0, "there are no samples");
    const CodingParameters& parameters = encoder->work->header().parameters;
    encoder->work->write(static_cast<const std::byte*>(samples), slices,
                         strides_of(strides, parameters.dims, size_of(parameters.type)));
  });
}

tagrid_status tagrid_encoder_finish(tagrid_encoder* encoder, tagrid_info* info) {
  if (encoder == nullptr) return TAGRID_INVALID_ARGUMENT;
  return call(encoder->messages, [&] {
    require(encoder->work != nullptr, "the encoder is not open");
    encoder->work->finish();
    if (info != nullptr)
      hand_over(info_of(encoder->work->header(), encoder->work->index(), encoder->work->sizes()), info,
                sizeof *info);
  });
}

void tagrid_encoder_close(tagrid_encoder* encoder) { delete encoder; }

const char* tagrid_encoder_message(const tagrid_encoder* encoder) {
  return encoder == nullptr ? "there is no encoder" : encoder->messages.get();
}

uint64_t tagrid_encode_memory(const tagrid_encode_options* options) {
  SharedMessage nobody;
  uint64_t memory = 0;
  call(nobody, [&] {
    const tagrid_encode_options wanted = taken_over_options(options);
    memory = PushEncoder::smallest_memory(volume_of(wanted), options_of(wanted)) - memory_of_program;
  });
  return memory;
}
