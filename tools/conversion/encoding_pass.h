// One volume of a manifest, encoded, verified and described.
#pragma once

#include <atomic>
#include <nlohmann/json.hpp>
#include <utility>

#include "tools/conversion/conversion.h"
#include "tools/conversion/records.h"

namespace tagrid {

class EncodingPass {
 public:
  /// All outlive the pass. When `stop` becomes true its work is of no use any more: run() then throws
  /// Stopped.
  EncodingPass(const ConversionOptions& options, Resources resources, const KnownOutputs& known,
               const std::atomic<bool>& stop)
      : options_(options), resources_(std::move(resources)), known_(known), stop_(stop) {}

  /// Encodes the volume of `line`, and names the output once it was decoded and compared; or finds that this
  /// is not necessary. Adds what came of it to `record`. Throws what goes wrong; then there is nothing new
  /// under the name of the output.
  void run(const ManifestLine& line, nlohmann::ordered_json& record) const;

 private:
  struct Volume;

  void encode(const Volume& volume, bool overwrite, nlohmann::ordered_json& record) const;
  void adopt(const Volume& volume, nlohmann::ordered_json& record) const;

  const ConversionOptions& options_;
  Resources resources_;
  const KnownOutputs& known_;
  const std::atomic<bool>& stop_;
};

}  // namespace tagrid
