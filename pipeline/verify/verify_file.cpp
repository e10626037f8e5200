// Verifies against an original: the only part of verification that reads other formats of volumes.
#include "pipeline/verify/against_original.h"
#include "pipeline/verify/verifier.h"

namespace tagrid {

Verifier::Verifier(const std::string& input, const std::string& original, const SourceDescription& source,
                   const Resources& resources)
    : reader_(input) {
  std::unique_ptr<AgainstOriginal> against;
  if (!original.empty())
    against = std::make_unique<AgainstOriginal>(reader_.name(), parameters(), original, source);
  const bool any_rows = !against || against->random_access();
  any_order_ = any_rows && reader_.can_seek();
  plan_ = plan_decoding(parameters(), resources, any_rows ? DecodeUse::verify : DecodeUse::verify_stream,
                        against ? against->memory() : 0);
  if (plan_.spooled) against->spool(resources.spool);
  against_ = std::move(against);
}

}  // namespace tagrid
