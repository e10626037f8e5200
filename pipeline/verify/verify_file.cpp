// Verifies against an original: the only part of verification that reads other formats of volumes.
#include <fmt/format.h>

#include "io/envelope/envelope.h"
#include "io/errors/errors.h"
#include "io/formats/table/open_volume.h"
#include "io/samples/file_samples.h"
#include "pipeline/verify/against_original.h"
#include "pipeline/verify/verifier.h"

namespace tagrid {

VerifySetup verify_setup(const std::string& name, const CodingParameters& parameters,
                         const std::string& original, const SourceDescription& source,
                         const Resources& resources, std::uint64_t of_envelope) {
  if (original.empty()) return {plan_decoding(parameters, resources, DecodeUse::verify, of_envelope)};
  std::unique_ptr<VolumeSource> volume = open_volume(original, source);
  const VolumeInfo& info = volume->info();
  if (info.dims != parameters.dims || info.type != parameters.type)
    throw BrokenInput(fmt::format("{}: the original is {}, but the file has {}", original,
                                  described(info.dims, info.type),
                                  described(parameters.dims, parameters.type)));
  // Source files are compared if the .tag file keeps them.
  const std::uint64_t of_files = of_envelope > 0 ? memory_of_source_files(volume->facts()) : 0;
  VerifySetup setup;
  setup.any_order = volume->traits().any_rows;
  setup.again = volume->traits().again;
  setup.fields_of_original = info.nrrd_fields;
  setup.is_original_headerless = volume->facts().headerless;
  setup.plan =
      plan_decoding(parameters, resources, setup.any_order ? DecodeUse::verify : DecodeUse::verify_stream,
                    volume->traits().memory + of_envelope + of_files);
  if (setup.plan.spooled) volume = spooled(std::move(volume), resources.spool);
  setup.against = std::make_unique<AgainstOriginal>(name, parameters, std::move(volume));
  return setup;
}

}  // namespace tagrid
