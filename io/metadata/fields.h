// The fields of a description that say where samples lie.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "io/metadata/entries.h"
#include "io/metadata/geometry.h"

namespace tagrid {

/// The geometry that fields give. Throws BrokenInput if a field says how samples are stored, is given twice, or
/// has content that is not supported.
Geometry geometry_of_fields(const MetadataEntries& entries);

/// Adds fields for a geometry. Reading them gives the same numbers. Throws BrokenInput if the name of the space
/// does not fit into a line.
void add_fields(const Geometry& geometry, MetadataEntries& entries);

/// Adds the field with spacings alone.
void add_spacings(const std::array<double, 3>& spacing, MetadataEntries& entries);

/// The numbers of "(a,b,c)"; nothing if it is not like that.
std::optional<std::vector<double>> vector_of(std::string_view value);

/// True if an axis of this kind may be one of space: "none" and "???" say nothing.
bool is_spatial_kind(std::string_view kind);

}  // namespace tagrid
