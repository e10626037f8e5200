// Verifies rows of bricks of a .tag file in any order.
#pragma once

#include <string>

#include "io/tag/bricks.h"
#include "pipeline/verify/verifier.h"

namespace tagrid {

/// Verifies parts of a file, whose header, index and footer were checked when it was opened. The checksum of
/// every brick is checked with that of the brick before it, so that all parts together check the entire
/// chain.
class PartVerifier {
 public:
  /// `file` must outlive the verifier. REQUIRES: setup.any_order.
  PartVerifier(const TagBricks& file, VerifySetup setup);

  const CodingParameters& parameters() const { return file_.parameters(); }

  /// See Verifier.
  Findings verify(const BrickRows& rows, const Watch& watch);
  VerifyResult finish(const Statistics& counted) { return checks_.finish(counted, file_.sizes()); }

  /// Throws BrokenInput for two neighboring bricks whose common face differs, as found by comparing parts.
  /// The message says where.
  [[noreturn]] void tell_difference(const Disagreement& bricks) const;

 private:
  BrickStream bricks_of(const BrickRows& rows) const {
    return file_.bricks_from(rows.first_brick(parameters().bricks()));
  }

  const TagBricks& file_;
  Verifier checks_;
};

}  // namespace tagrid
