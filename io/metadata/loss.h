// What is known of a loss before, such as by JPEG, or by an earlier encoding with a bound.
#pragma once

#include <string>
#include <string_view>

namespace tagrid {

/// The text of lossy_source_key after two losses, the earlier one first. Either may be "".
std::string loss_after(std::string_view earlier, std::string_view later);

/// NRRD header lines that also have this loss, after those that they have; the same lines if it is "".
std::string with_loss(const std::string& nrrd_fields, std::string_view loss);

/// How formats without key-value pairs have it, within other text: "lossy source: TIFF, JPEG".
struct TextWithLoss {
  std::string text, loss;

  /// At most so many bytes. Of the text and then of the loss, the end is cut off.
  std::string joined(std::size_t most) const;
};
TextWithLoss text_with_loss(std::string_view joined);

}  // namespace tagrid
