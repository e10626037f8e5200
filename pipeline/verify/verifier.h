// Verifies a .tag file, all at once or some rows of bricks at a time.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "io/tag/file.h"
#include "io/volume/volume_info.h"
#include "pipeline/memory/plan.h"
#include "pipeline/verify/comparison.h"
#include "pipeline/verify/shared_faces.h"
#include "pipeline/verify/verify.h"
#include "stages/brick/closed_samples.h"
#include "stages/volume/statistics.h"

namespace tagrid {

/// Results for some bricks that are correct by themselves.
struct Findings {
  Statistics counted;  ///< active points and samples, and the errors against the original if there is one
  std::vector<OpenFace> open_faces;
};

class Verifier {
 public:
  /// Opens the file and the original ("" for none). Throws as verify_file() does.
  Verifier(const std::string& input, const std::string& original, const SourceDescription& source,
           const Resources& resources);
  /// The same for any bytes, without an original.
  Verifier(std::unique_ptr<ByteStream> input, const Resources& resources);
  Verifier(const Verifier&) = delete;
  Verifier& operator=(const Verifier&) = delete;

  const CodingParameters& parameters() const { return reader_.parameters(); }
  /// True if rows may be verified in any order, after begin_any_order().
  bool any_order() const { return any_order_; }
  void begin_any_order() {
    reader_.read_index();
    seeks_ = true;
  }

  /// Verifies the bricks of `rows`, which must be all bricks unless begin_any_order() was called. The caller
  /// checks what depends on other bricks, using the findings. Throws BrokenInput at the first error.
  Findings verify(const BrickRows& rows, const Watch& watch);

  /// Throws BrokenInput for two neighbouring bricks whose common face differs, as found by comparing parts.
  /// The message says where.
  [[noreturn]] void tell_difference(const Disagreement& bricks);

  /// Call this when all bricks have been verified, here or elsewhere. `counted` is the sum of the findings.
  /// Throws BrokenInput if the index differs from it.
  VerifyResult finish(const Statistics& counted);

 private:
  class Ranges;

  ClosedSamples low_faces(const BrickRows& rows);
  void compare_with_index(const Statistics& counted) const;
  [[noreturn]] void fail_index(const std::string& what) const;
  [[noreturn]] void fail_brick(std::int64_t brick, const char* what, Index3 p) const;

  TagReader reader_;
  std::unique_ptr<Comparison> against_;  ///< comparison with an original, if there is one
  bool any_order_, seeks_ = false;
  DecodePlan plan_;
};

}  // namespace tagrid
