// The text of a description, as .tag files, NRRD files and programs have it: the lines of an NRRD header, each
// with '\n', without those that say how samples are stored.
#pragma once

#include <string>
#include <string_view>

#include "io/metadata/metadata.h"

namespace tagrid {

/// Throws BrokenInput if a line is not one of an NRRD header, does not belong here, or has content that is not
/// supported. Safe for any text.
Metadata parse_metadata(std::string_view text);

/// Adds the entries of a text. Throws BrokenInput if a line is not one of an NRRD header.
void add_text(std::string_view text, MetadataEntries& entries);

/// The same bytes that were parsed. They end with the metadata.
const std::string& text_of(const Metadata& metadata);

}  // namespace tagrid
