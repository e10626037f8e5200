// Verifies against an original: the only part of verification that reads other formats of volumes.
#include <fmt/format.h>

#include "io/envelope/envelope.h"
#include "io/errors/errors.h"
#include "io/formats/table/open_volume.h"
#include "io/samples/file_samples.h"
#include "io/volume/one_of_volumes.h"
#include "pipeline/verify/against_original.h"
#include "pipeline/verify/verifier.h"

namespace tagrid {
namespace {

std::string words_of(const Index3& dims, SampleType type, std::int64_t volumes) {
  const std::string one = described(dims, type);
  return volumes == 1 ? one : fmt::format("{} volumes of {}", volumes, one);
}

}  // namespace

SourceDescription source_of_as_many(SourceDescription source, const TagHeader& header) {
  source.all_volumes = false;
  if (header.volumes > 1 && !source.series) source.series = every_volume;
  return source;
}

VerifySetup verify_setup(const std::string& name, const TagHeader& header,
                         const std::optional<std::string>& original, const SourceDescription& source,
                         const Resources& resources, std::uint64_t of_envelope) {
  const CodingParameters& parameters = header.parameters;
  if (!original) return {plan_verifying(parameters, resources, true, of_envelope)};
  std::unique_ptr<VolumeSource> volume = open_volume(*original, source_of_as_many(source, header));
  const VolumeInfo first = info_of_volume(volume->facts(), 0);
  if (first.dims != parameters.dims || first.type != parameters.type ||
      volume->info().volumes != header.volumes)
    throw BrokenInput("{}: the original is {}, but the file has {}", *original,
                      words_of(first.dims, first.type, volume->info().volumes),
                      words_of(parameters.dims, parameters.type, header.volumes));
  // Source files are compared if the .tag file keeps them.
  const std::uint64_t of_files = of_envelope > 0 ? memory_of_source_files(volume->facts()) : 0;
  const bool is_headerless = volume->facts().headerless;
  if (header.volumes > 1) volume = one_of_volumes(std::shared_ptr<VolumeSource>(std::move(volume)), 0);
  VerifySetup setup = setup_against(name, parameters, std::move(volume), resources, of_envelope + of_files);
  setup.is_original_headerless = is_headerless;
  return setup;
}

VerifySetup setup_against(const std::string& name, const CodingParameters& parameters,
                          std::unique_ptr<VolumeSource> volume, const Resources& resources,
                          std::uint64_t besides) {
  VerifySetup setup;
  setup.any_order = volume->traits().any_rows;
  setup.again = volume->traits().again;
  setup.metadata_of_original = volume->info().metadata;
  setup.plan = plan_verifying(parameters, resources, setup.any_order, volume->traits().memory + besides);
  if (setup.plan.spooled) volume = spooled(std::move(volume), resources.spool.value());
  setup.against = std::make_unique<AgainstOriginal>(name, parameters, std::move(volume));
  return setup;
}

}  // namespace tagrid
