// Transfer syntaxes: how the samples of a file are stored. The list: DICOM PS3.6, A.1.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace tagrid {

/// How this reader handles the samples of a syntax.
enum class SyntaxUse : std::uint8_t {
  native,           ///< Samples lie plainly in the file.
  deflated,         ///< The data set is deflated; its samples are native.
  decoded,          ///< Samples are code streams in fragments, which are decoded.
  plain_fragments,  ///< Samples lie plainly in fragments.
  refused,          ///< known, and not read
  unknown
};

struct TransferSyntax {
  SyntaxUse use = SyntaxUse::unknown;
  std::string_view name;  ///< "" if it is unknown

  /// True if samples must be in fragments.
  bool has_fragments() const { return use == SyntaxUse::decoded || use == SyntaxUse::plain_fragments; }
};

/// What is known of the syntax with this UID.
TransferSyntax transfer_syntax(std::string_view uid);

/// "JPEG 2000 Multicomponent (1.2.840.10008.1.2.4.93)", or the UID alone.
std::string in_words(const TransferSyntax& syntax, std::string_view uid);

}  // namespace tagrid
