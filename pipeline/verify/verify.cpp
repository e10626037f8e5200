#include "pipeline/verify/verify.h"

#include "io/tag/file.h"
#include "pipeline/verify/verifier.h"

namespace tagrid {

VerifyResult verify_bytes(std::unique_ptr<ByteStream> input, const Resources& resources,
                          const Progress& progress) {
  TagReader reader(std::move(input));
  return verify_all(reader, {plan_decoding(reader.parameters(), resources, DecodeUse::verify)}, progress);
}

// All rows have none below them, so the file is opened once.
VerifyResult verify_all(TagReader& reader, VerifySetup setup, const Progress& progress) {
  const CodingParameters& parameters = reader.parameters();
  Verifier verifier(reader.name(), reader.header(), reader.index(), std::move(setup));
  const Watch watch = watch_for(progress, sample_bytes(parameters.dims, parameters.type).value());
  const Findings found = verifier.verify(
      BrickRows::all(parameters.bricks()), [&](const BrickRows&) { return reader.bricks(); }, watch);
  return verifier.finish(found.counted, reader.sizes());
}

}  // namespace tagrid
