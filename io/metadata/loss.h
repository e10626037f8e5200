// What is known of a loss before, such as by JPEG, or by an earlier encoding with a bound.
#pragma once

#include <string>
#include <string_view>

#include "io/metadata/metadata.h"

namespace tagrid {

/// The key under which readers say that samples were compressed with a loss before, and by what: "TIFF,
/// JPEG".
inline constexpr std::string_view lossy_source_key = "lossy source";

/// The text of lossy_source_key after two losses, the earlier one first. Either may be "".
std::string loss_after(std::string_view earlier, std::string_view later);

/// Records this loss, after those that the description records already; changes nothing if it is "".
void add_loss(std::string_view loss, Metadata& metadata);

/// How formats without key-value pairs have it, within other text: "lossy source: TIFF, JPEG".
struct TextWithLoss {
  std::string text, loss;

  /// At most so many bytes. Of the text and then of the loss, the end is cut off.
  std::string joined(std::size_t most) const;
};
TextWithLoss text_with_loss(std::string_view joined);

}  // namespace tagrid
