// The members of the structs that ranks send each other; see messages.h.
#pragma once

#include "pipeline/parts/mesh_parts.h"
#include "pipeline/parts/part_work.h"
#include "pipeline/parts/work_orders.h"
#include "pipeline/ranks/messages.h"

namespace tagrid {

TAGRID_MEMBERS(Index3, x, y, z)
TAGRID_MEMBERS(RawDescription, dims, type, big_endian, offset)
TAGRID_MEMBERS(GivenSpacing, distances, unit, overrides)
/// All but what only the process that has opened the volume knows.
template <class Of>
requires std::same_as<std::remove_const_t<Of>, SourceDescription>
auto members_of(Of& of) {
  auto& [raw, spacing, vdb_grid, from, series, all_volumes, gaps_ok, data_outside, dataset, reader_memory,
         known] = of;
  return std::tie(raw, spacing, vdb_grid, from, series, all_volumes, gaps_ok, data_outside, dataset,
                  reader_memory);
}
TAGRID_MEMBERS(Resources, threads, memory, besides, processes, spool)

TAGRID_MEMBERS(PartOrder, input, source, folder, record, resources, code_after_signal)
TAGRID_MEMBERS(PartPlace, position, checksum_before, bricks)
TAGRID_MEMBERS(PlaceOrder, folder, record, file, name, places)
TAGRID_MEMBERS(DecodeOrder, input, file, name, start, numbers, resources)
TAGRID_MEMBERS(WrittenNumbers, rule, is_range_known)
TAGRID_MEMBERS(ValueRule, from, to, slopes, intercepts)
TAGRID_MEMBERS(MeshOrder, input, volume, options, resources)
TAGRID_MEMBERS(MaterialMeshOptions, ranges, labels, keep, parts, fine, coarse, prefers_angles, order,
               label_volume, region, overwrite, counts_edges)
TAGRID_MEMBERS(MaterialRange, name, low, high)
TAGRID_MEMBERS(LabelsWish, names, smoothing)
TAGRID_MEMBERS(PartsWish, only_largest, least_volume)
TAGRID_MEMBERS(MeshLength, length, unit)
TAGRID_MEMBERS(WantedRegion, low, high, step)
TAGRID_MEMBERS(VerifyOrder, input, original, source, resources)

TAGRID_MEMBERS(ContentOrder, source, paths, exact, resources)
/// All but the open files.
template <class Of>
requires std::same_as<std::remove_const_t<Of>, SourceFiles>
auto members_of(Of& of) {
  auto& [files, names, pieces, opened, shape, compression, why_not, warnings] = of;
  return std::tie(files, names, pieces, shape, compression, why_not, warnings);
}
TAGRID_MEMBERS(SampleShape, dims, type)
TAGRID_MEMBERS(EnvelopeFile, name, size, is_changed, checksum, slices)
TAGRID_MEMBERS(SlicesInFile, first_slice, run, spare)
TAGRID_MEMBERS(SliceRun, file, offset, slices, step, big_endian, stored, row_step, bottom_up)
TAGRID_MEMBERS(StoredBits, bits, is_signed, add)
TAGRID_MEMBERS(PlainPiece, kind, bytes, file, offset, size)

TAGRID_MEMBERS(Statistics, active, max_error, mesh_error, sum_squared_error, sum_squared_real, low, high, sum,
               finite, samples, at_least, moved)
TAGRID_MEMBERS(OfThresholds<std::uint64_t>, all, count)
TAGRID_MEMBERS(OpenFace, below, axis, checksum)
TAGRID_MEMBERS(Findings, counted, has_points, open_faces)

}  // namespace tagrid
