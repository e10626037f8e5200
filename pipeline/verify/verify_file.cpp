// Verifies against an original: the only part of verification that reads other formats of volumes.
#include "io/formats/open_volume.h"
#include "io/samples/spooled.h"
#include "pipeline/verify/against_original.h"
#include "pipeline/verify/verifier.h"

namespace tagrid {

VerifySetup verify_setup(const std::string& name, const CodingParameters& parameters,
                         const std::string& original, const SourceDescription& source,
                         const Resources& resources) {
  if (original.empty()) return {plan_decoding(parameters, resources, DecodeUse::verify)};
  std::unique_ptr<VolumeSource> volume = open_volume(original, source);
  check_original(original, volume->info(), parameters);
  VerifySetup setup;
  setup.any_order = volume->traits().any_rows;
  setup.plan =
      plan_decoding(parameters, resources, setup.any_order ? DecodeUse::verify : DecodeUse::verify_stream,
                    volume->traits().memory);
  if (setup.plan.spooled) volume = spooled(std::move(volume), resources.spool);
  setup.against = std::make_unique<AgainstOriginal>(name, parameters, std::move(volume));
  return setup;
}

}  // namespace tagrid
