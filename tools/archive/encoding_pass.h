// Encodes one volume of a manifest, verifies the output and describes it.
#pragma once

#include <atomic>
#include <nlohmann/json.hpp>
#include <utility>

#include "tools/archive/conversion.h"
#include "tools/archive/records.h"

namespace tagrid {

class EncodingPass {
 public:
  /// All arguments must outlive the pass. When `stop` becomes true, the result is no longer needed, and run()
  /// throws Stopped.
  EncodingPass(const ConversionOptions& options, Resources resources, const KnownOutputs& known,
               const std::atomic<bool>& stop)
      : options_(options), resources_(std::move(resources)), known_(known), stop_(stop) {}

  /// Encodes the volume of `line`, and gives the output its name after it was decoded and compared. Skips
  /// this if a record or an existing output shows that it is not necessary. Adds the result to `record`. If
  /// it throws, nothing new is left under the name of the output.
  void run(const ManifestLine& line, nlohmann::ordered_json& record) const;

 private:
  struct Volume;

  void encode(const Volume& volume, bool overwrite, nlohmann::ordered_json& record) const;
  void adopt(const Volume& volume, bool was_removed, nlohmann::ordered_json& record) const;

  const ConversionOptions& options_;
  Resources resources_;
  const KnownOutputs& known_;
  const std::atomic<bool>& stop_;
};

}  // namespace tagrid
