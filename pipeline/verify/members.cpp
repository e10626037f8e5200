// Verifies what is nested in a file.
#include <algorithm>
#include <memory>
#include <optional>

#include "io/tag/file.h"
#include "io/tag/members.h"
#include "io/volume/one_of_volumes.h"
#include "pipeline/overview/means_source.h"
#include "pipeline/verify/against_original.h"
#include "pipeline/verify/verifier.h"

namespace tagrid {
namespace {

// The means of the original's blocks, level by level. They wait in temporary files, which belong to no output.
class OriginalMeans {
 public:
  OriginalMeans(VolumeSource& original, const std::string& spool)
      : dims_(original.info().dims), spool_(spool), sums_(sums_of(original, spool_, "-")) {}

  /// Those of blocks of `factor`, which increases; null if it is not a power of 4, for which there are no sums.
  std::unique_ptr<VolumeSource> means(std::int64_t factor) {
    while (sums_.layout().factor < std::min(factor, largest_factor))
      sums_ = coarser(sums_, dims_, spool_, "-");
    if (sums_.layout().factor != factor) return nullptr;
    return std::make_unique<MeansSource>(sums_, dims_);
  }

 private:
  Index3 dims_;
  std::string spool_;
  SumsFile sums_;
};

void add(const VerifyResult& volume, VerifyResult& all) {
  all.bricks += volume.bricks;
  if (all.active_points && volume.active_points)
    *all.active_points += *volume.active_points;
  else
    all.active_points.reset();
  if (all.max_error && volume.max_error) all.max_error = std::max(*all.max_error, *volume.max_error);
  if (all.mesh_error && volume.mesh_error) all.mesh_error = std::max(*all.mesh_error, *volume.mesh_error);
  all.index.total.add(volume.index.total);
  for (const std::string& difference : volume.geometry.differences)
    if (std::ranges::find(all.geometry.differences, difference) == all.geometry.differences.end())
      all.geometry.differences.push_back(difference);
}

void verify_volume(const TagBricks& file, const Member& member, VolumeSource* original,
                   const Resources& resources, VerifyResult* all, const SetupAgainst& against) {
  const auto volume = file.nested(member);
  const auto of_original = [&] {
    return original ? one_of_volumes(*original, member.factor) : std::unique_ptr<VolumeSource>();
  };
  TagReader reader(std::make_unique<SourceStream>(file.bytes_of(member)));
  VerifySetup setup{plan_verifying(reader.parameters(), resources)};
  if (original) setup = against(reader.name(), reader.parameters(), of_original(), resources);
  const Metadata metadata = setup.metadata_of_original;
  VerifyResult found = verify_all(reader, std::move(setup));
  if (original) found.geometry = compare_geometry(found.header.metadata, metadata);
  const auto again = of_original();
  verify_members(*volume, again.get(), resources);
  if (all) add(found, *all);
}

}  // namespace

void verify_members(const TagBricks& file, VolumeSource* original, const Resources& resources,
                    VerifyResult* all, const SetupAgainst& against) {
  for (const Member& member : file.index().members) {
    if (member.is_volume()) verify_volume(file, member, original, resources, all, against);
    // Whoever read the file front to back has checked this, but not who read its bricks by its index.
    file.check(member);
  }
  std::unique_ptr<VolumeSource> first;
  if (original && file.header().volumes > 1) {
    first = one_of_volumes(*original, 0);
    original = first.get();
  }
  std::optional<OriginalMeans> of_original;
  for (const Member& member : file.index().members) {
    if (!member.is_overview()) continue;
    file.nested(member);
    if (original && !of_original) of_original.emplace(*original, resources.spool);
    TagReader reader(std::make_unique<SourceStream>(file.bytes_of(member)));
    VerifySetup setup{plan_verifying(reader.parameters(), resources)};
    if (auto means = of_original ? of_original->means(member.factor) : nullptr)
      setup.against = std::make_unique<AgainstOriginal>(reader.name(), reader.parameters(), std::move(means));
    verify_all(reader, std::move(setup));
  }
}

}  // namespace tagrid
