// Writes the tree of an OpenVDB grid from its leaves and tiles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "io/files/spool_file.h"
#include "io/vdb/voxels.h"

namespace tagrid {

using VdbSink = std::function<void(std::span<const std::byte>)>;

/// Puts leaves and tiles into the order of the file, depth first.
void sort_vdb_slots(std::vector<VdbSlot>& slots);

/// Writes background, root, nodes and the masks of leaves. A node that consists of tiles of one value becomes
/// a tile itself. Without `spool` the masks are zeros: this is used to count bytes. REQUIRES: `slots` are
/// sorted.
template <class T>
void write_vdb_topology(const VdbSink& sink, T background, std::span<const VdbSlot> slots, SpoolFile* spool);

/// Writes the leaves. REQUIRES: `slots` are sorted.
void write_vdb_buffers(const VdbSink& sink, std::span<const VdbSlot> slots, SpoolFile& spool);

}  // namespace tagrid
