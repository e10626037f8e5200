#include "pipeline/verify/verify.h"

#include "pipeline/verify/verifier.h"

namespace tagrid {

VerifyResult verify_bytes(std::unique_ptr<ByteStream> input, const Resources& resources,
                          const Progress& progress) {
  Verifier verifier(std::move(input), resources);
  return verify_all(verifier, progress);
}

VerifyResult verify_all(Verifier& verifier, const Progress& progress) {
  const CodingParameters& parameters = verifier.parameters();
  const Watch watch = watch_for(progress, sample_bytes(parameters.dims, parameters.type).value());
  const Findings found = verifier.verify(BrickRows::all(parameters.bricks()), watch);
  return verifier.finish(found.counted);
}

}  // namespace tagrid
