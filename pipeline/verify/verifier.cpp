#include "pipeline/verify/verifier.h"

#include <fmt/format.h>

#include <array>
#include <cassert>
#include <cmath>
#include <cstring>
#include <numeric>

#include "io/bytes/checksum.h"
#include "io/errors/errors.h"
#include "io/tag/file.h"
#include "pipeline/grid/schedule.h"
#include "pipeline/memory/plan.h"
#include "stages/brick/codec.h"
#include "stages/brick/sample_statistics.h"
#include "stages/grid/conformity.h"

namespace tagrid {

SharedFaces::Face SharedFaces::cut(const DecodedBrick& brick, const Box& face) const {
  Face result{LatticeBits(face), {}};
  copy_bits(brick.active, result.active);
  if (brick.points.empty()) return result;
  const Box& box = brick.active.box();
  const std::size_t row = static_cast<std::size_t>(face.size().x) * size_;
  for (std::int64_t z = face.low.z; z <= face.high.z; ++z)
    for (std::int64_t y = face.low.y; y <= face.high.y; ++y) {
      const std::byte* from =
          brick.points.data() + static_cast<std::size_t>(box.offset({face.low.x, y, z})) * size_;
      result.points.insert(result.points.end(), from, from + row);
    }
  return result;
}

// Values of inactive points are zero on both sides.
std::optional<Index3> SharedFaces::compare(const Face& a, const Face& b, std::size_t sample_size) {
  if (a.active == b.active && a.points == b.points) return std::nullopt;
  const Box& box = a.active.box();
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
      for (std::int64_t x = box.low.x; x <= box.high.x; ++x) {
        const Index3 p{x, y, z};
        if (a.active.test(p) != b.active.test(p)) return p;
        const std::size_t at = static_cast<std::size_t>(box.offset(p)) * sample_size;
        if (!a.points.empty() && std::memcmp(a.points.data() + at, b.points.data() + at, sample_size) != 0)
          return p;
      }
  return box.low;
}

double SharedFaces::memory(const CodingParameters& p) {
  constexpr double of_face = 250;  // besides bits and values: in the map
  const BrickGrid bricks = p.bricks();
  // Each brick of a layer leaves three faces. Rows of bits are whole words, so faces along x have more.
  const auto edge = static_cast<double>(bricks.length());
  const double bits = 2 * memory_of_activity(p) / edge;
  const double points =
      p.mode == FileMode::grid ? (edge + 1) * (edge + 1) * static_cast<double>(size_of(p.type)) : 0;
  return static_cast<double>(bricks.bricks(0)) * static_cast<double>(bricks.bricks(1)) * 3 *
         (bits + points + of_face);
}

std::optional<Index3> SharedFaces::first_difference(const DecodedBrick& brick) {
  const Index3 position = bricks_.position(brick.id);
  const Box& box = brick.active.box();
  std::optional<Index3> different;
  for (int axis = 0; axis < 3; ++axis) {
    Box face = box;
    if (position[axis] > 0) {
      face.high[axis] = box.low[axis];
      const auto below = high_faces_.find({bricks_.id(position - unit_vector(axis)), axis});
      if (below == high_faces_.end()) {
        open_low_faces_.push_back(
            {bricks_.id(position - unit_vector(axis)), axis, checksum(cut(brick, face))});
      } else {
        if (!different) different = compare(below->second, cut(brick, face), size_);
        high_faces_.erase(below);
      }
    }
    if (position[axis] + 1 < bricks_.bricks(axis)) {
      face = box;
      face.low[axis] = box.high[axis];
      high_faces_.emplace(std::pair{brick.id, axis}, cut(brick, face));
    }
  }
  return different;
}

std::uint64_t SharedFaces::checksum(const Face& face) {
  return checksum_of({std::as_bytes(face.active.words()), face.points});
}

std::vector<OpenFace> SharedFaces::open_faces() const {
  std::vector<OpenFace> open = open_low_faces_;
  for (const auto& [at, face] : high_faces_) open.push_back({at.first, at.second, checksum(face)});
  return open;
}

void OpenFacePairs::add(const std::vector<OpenFace>& faces) {
  for (const OpenFace& face : faces) {
    const auto [other, is_first] = waiting_.emplace(std::pair{face.below, face.axis}, face.checksum);
    if (is_first) continue;
    const std::int64_t above = bricks_.id(bricks_.position(face.below) + unit_vector(face.axis));
    // For one brick, the x face comes before the y and z faces, as when one process compares them.
    if (other->second != face.checksum &&
        (!first_ || above < first_->above || (above == first_->above && face.below > first_->below)))
      first_ = {face.below, above};
    waiting_.erase(other);
  }
}

std::optional<Disagreement> OpenFacePairs::first_difference() const {
  assert(waiting_.empty());
  return first_;
}

double RangesAndIndex::memory(double bricks, std::int64_t bricks_in_flight) {
  constexpr double of_range = 128;  // values that wait for the index, and an entry, in lists that grow
  return (bricks_of_page(bricks) + static_cast<double>(bricks_in_flight)) * of_range;
}

namespace {

double memory_of_verifier(const CodingParameters& p, const DecodeLoad& load) {
  double bytes = SharedFaces::memory(p) + RangesAndIndex::memory(count_of_bricks(p), load.bricks_in_flight) +
                 AgainstOriginal::memory(p, load.rows, load.threads);
  if (mesh_needs_bricks_below(p)) bytes += static_cast<double>(ClosedSamples::working_bytes(p, load.rows));
  return bytes;
}

}  // namespace

DecodePlan plan_verifying(const CodingParameters& parameters, const Resources& resources, bool any_order,
                          std::uint64_t besides) {
  return plan_decoding(parameters, resources, any_order ? DecodeUse::verify : DecodeUse::verify_stream,
                       besides, 0, memory_of_verifier);
}

std::uint64_t smallest_memory_of_verifying(const CodingParameters& p, bool strips, std::uint64_t besides) {
  DecodeLoad load;
  load.with_grid = p.stores_activity();
  load.rows = strips ? 1 : p.bricks().bricks(1);
  load.kept = memory_of_verifier;
  return memory_of_decoding(p, load) + besides;
}

void RangesAndIndex::add(const ValueRange& range) {
  const std::lock_guard lock(mutex_);
  ranges_.push_back(range);
  compare();
}

void RangesAndIndex::add(std::span<const IndexEntry> entries) {
  const std::lock_guard lock(mutex_);
  entries_.insert(entries_.end(), entries.begin(), entries.end());
  compare();
}

void RangesAndIndex::compare() {
  for (; !ranges_.empty() && !entries_.empty(); ranges_.pop_front(), entries_.pop_front()) {
    const double error = tagrid::least_error(ranges_.front(), entries_.front());
    if (error > least_error_) {
      least_error_ = error;
      worst_ = compared_;
    }
    ++compared_;
  }
}

void Verifier::decode_rows(const BrickRows& rows, RowSink& sink, Watch& watch) const {
  const DecodeJob job{parameters(), setup_.plan.budget, rows};
  if (reader_ != nullptr) return decode(job, *reader_, sink, watch);
  BricksInOrder bricks(*file_, rows.first_brick(parameters().bricks()));
  decode(job, bricks, sink, watch);
}

ClosedSamples Verifier::low_faces(const BrickRows& rows) const {
  ClosedSamples closed(parameters(), rows);
  const BrickGrid bricks = parameters().bricks();
  BricksTo sink([&](const DecodedBrick& brick) { closed.complete(bricks.position(brick.id), brick.samples); },
                ignore_rows);
  Watch unwatched;
  for (const BrickRows& below : rows_below(rows)) decode_rows(below, sink, unwatched);
  return closed;
}

void Verifier::fail_index(const std::string& what) const {
  throw BrokenInput(name() + ": the index: " + what);
}

// A point of padding is named as if it were a sample.
void Verifier::fail_brick(std::int64_t brick, const char* what, Index3 point) const {
  const Index3 p = point - parameters().domain().first();
  throw BrokenInput("{}: brick {}: {} at ({}, {}, {})", name(), brick, what, p.x, p.y, p.z);
}

void Verifier::check_grid(const DecodedBrick& brick, SharedFaces& faces, Statistics& counted) const {
  if (const auto p =
          first_nonconforming_point(brick.active, parameters().domain().padded(), parameters().cube_size))
    fail_brick(brick.id, "the grid is not conforming", *p);
  if (const auto p = faces.first_difference(brick))
    fail_brick(brick.id, "it disagrees with its neighbor", *p);
  count_active(brick.active, parameters(), parameters().bricks().position(brick.id), counted);
}

Findings Verifier::verify(const BrickRows& rows, Watch& watch) {
  const BrickGrid bricks = parameters().bricks();
  Findings found;
  found.has_points = parameters().stores_activity() || setup_.plan.derives;
  SharedFaces faces(parameters());
  RangesAndIndex of_part;
  RangesAndIndex& ranges = file_ ? of_part : ranges_;
  AgainstOriginal* const against = setup_.against.get();
  const bool meshed = against && parameters().mesh_error >= 0;
  std::optional<ClosedSamples> closed;
  if (meshed && parameters().mode == FileMode::voxels) closed.emplace(low_faces(rows));

  const auto check = [&](DecodedBrick& brick) {
    if (parameters().stores_activity()) check_grid(brick, faces, found.counted);
    found.counted.samples += brick.samples.size() / size_of(parameters().type);
    const ValueRange range = value_range(brick.samples, parameters().type);
    if (file_) ranges.add(std::array{file_->entry(brick.id)});
    ranges.add(range);
    count_above(brick.samples, parameters(), found.counted.at_least);
    if (against)
      against->add_activity(brick.active);
    else
      found.counted.finite += range.finite;
    if (meshed) {
      const Index3 position = bricks.position(brick.id);
      against->add_mesh(position, brick.active,
                        closed ? closed->complete(position, brick.samples) : std::move(brick.points));
    }
  };
  // A part needs samples of rows around it for its grid, and these are decoded once more.
  DerivedGrid derived(parameters(), rows, [&](const SubdividedBrick& brick) {
    check_grid({bricks.id(brick.brick), brick.active, {}, {}}, faces, found.counted);
  });
  const auto derive = [&](const DecodedRows& decoded) {
    decoded.for_each_slice(derived.samples(),
                           [&](SliceSamples slice) { derived.add_slice(std::move(slice)); });
  };
  std::vector<BrickRows> around;
  if (setup_.plan.derives) around = derived.stretches();
  const bool at_once = around == std::vector{rows};
  BricksTo sink(check, [&](const DecodedRows& decoded) {
    if (against) against->compare(decoded, found.counted);
    if (at_once) derive(decoded);
  });
  decode_rows(rows, sink, watch);
  RowsTo again(derive);
  Watch unwatched;
  for (const BrickRows& stretch : at_once ? std::vector<BrickRows>() : around)
    decode_rows(stretch, again, unwatched);
  assert(ranges.compared() == rows.count(bricks));
  if (ranges.least_error() > index_.total.max_error)
    fail_index(fmt::format("the value range of brick {} does not match its voxels",
                           rows.first_brick(bricks) + ranges.worst()));
  found.open_faces = faces.open_faces();
  return found;
}

void Verifier::compare_with_index(const Statistics& counted, bool has_points) const {
  const Statistics& total = index_.total;
  if (has_points && parameters().counts_points() && total.active != counted.active)
    fail_index("the number of active points does not match the bricks");
  const double bound = parameters().max_error;
  // Without a bound, all samples are interpolated: only the original tells how many are finite.
  const bool all_come_back = setup_.against || bound >= 0;
  if (all_come_back ? total.finite != counted.finite : total.finite > counted.samples)
    fail_index("the number of finite samples does not match the bricks");
  if (total.at_least != counted.at_least)
    fail_index("the number of samples that are at least a threshold does not match the bricks");
  const double of_mesh = parameters().mesh_error;
  if (Status status = check_extremes(index_); !status.ok()) fail_index(status.what());
  if (!setup_.against) return;
  if (of_mesh >= 0 && counted.mesh_error > of_mesh)
    throw BrokenInput("{}: the mesh differs from the original by up to {}, more than {}", name(),
                      counted.mesh_error, of_mesh);
  // Sums of floats depend slightly on the order of addition.
  const double real = total.sum_squared_real;
  if (counted.max_error != total.max_error || counted.mesh_error != total.mesh_error ||
      counted.sum_squared_error != total.sum_squared_error ||
      !(std::abs(counted.sum_squared_real - real) <= 1e-9 * real))
    fail_index(
        fmt::format("the recorded errors do not match this original: the largest is {}, but {} was found; "
                    "this is not the volume that was encoded, or the file is damaged",
                    total.max_error, counted.max_error));
}

VerifyResult Verifier::finish(const Statistics& counted, bool has_points, const TagSizes& sizes) {
  if (setup_.against) setup_.against->finish();
  compare_with_index(counted, has_points);
  VerifyResult result;
  result.header = header_;
  result.index = index_;
  result.bytes_in = sizes.file;
  result.bricks = parameters().bricks().count();
  if (has_points)
    result.active_points = std::accumulate(counted.active.begin(), counted.active.end(), std::uint64_t{0});
  if (setup_.against) result.max_error = counted.max_error;
  if (setup_.against && counted.mesh_error >= 0) result.mesh_error = counted.mesh_error;
  return result;
}

void Verifier::tell_difference(const Disagreement& bricks) const {
  const BrickGrid grid = parameters().bricks();
  SharedFaces faces(parameters());
  for (const std::int64_t id : {bricks.below, bricks.above}) {
    const Index3 position = grid.position(id);
    const BrickRows row = {position.y, position.y + 1, position.z, position.z + 1};
    BricksTo sink(
        [&](const DecodedBrick& brick) {
          if (brick.id != id) return;
          if (const auto p = faces.first_difference(brick))
            fail_brick(brick.id, "it disagrees with its neighbor", *p);
        },
        ignore_rows);
    Watch unwatched;
    decode_rows(row, sink, unwatched);
  }
  throw WorldError("{}: bricks {} and {} changed while they were read; is the file being written to?", name(),
                   bricks.below, bricks.above);
}

VerifyResult verify_bytes(std::unique_ptr<ByteStream> input, const Resources& resources,
                          const Progress& progress) {
  TagReader reader(std::move(input));
  return verify_all(reader, {plan_verifying(reader.parameters(), resources)}, progress);
}

// All rows have none below them, so the file is opened once.
VerifyResult verify_all(TagReader& reader, VerifySetup setup, const Progress& progress) {
  const CodingParameters& parameters = reader.parameters();
  Verifier verifier(reader, std::move(setup));
  reader.look_at_pages([&](std::span<const IndexEntry> page) { verifier.add_page(page); });
  ProgressWatch watch(progress, sample_bytes(parameters.dims, parameters.type).value());
  const Findings found = verifier.verify(BrickRows::all(parameters.bricks()), watch);
  return verifier.finish(found.counted, found.has_points, reader.sizes());
}

}  // namespace tagrid
