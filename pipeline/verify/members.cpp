// Verifies what is nested in a file.
#include <algorithm>
#include <memory>
#include <optional>

#include "io/tag/file.h"
#include "io/tag/members.h"
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

}  // namespace

void verify_members(const TagBricks& file, VolumeSource* original, const Resources& resources) {
  std::optional<OriginalMeans> of_original;
  for (const Member& member : file.index().members) {
    file.check(member);
    if (!member.is_overview()) continue;
    file.overview(member);
    if (original && !of_original) of_original.emplace(*original, resources.spool);
    TagReader reader(std::make_unique<SourceStream>(file.bytes_of(member)));
    VerifySetup setup{plan_decoding(reader.parameters(), resources, DecodeUse::verify)};
    if (auto means = of_original ? of_original->means(member.factor) : nullptr)
      setup.against = std::make_unique<AgainstOriginal>(reader.name(), reader.parameters(), std::move(means));
    verify_all(reader, std::move(setup));
  }
}

}  // namespace tagrid
