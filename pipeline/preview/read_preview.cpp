#include "pipeline/preview/read_preview.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <mutex>

#include "io/errors/errors.h"
#include "io/metadata/lengths.h"
#include "pipeline/decode/graph.h"
#include "pipeline/meshes/grid_bricks.h"
#include "pipeline/reading/read_region.h"
#include "pipeline/threads/threads.h"
#include "stages/mesh/tetrahedra.h"

namespace tagrid {
namespace {

// The slice across an axis that was asked for, or the one in the middle.
std::int64_t chosen_slice(const PreviewWishes& wishes, const Index3& dims, int axis) {
  const std::int64_t slice = wishes.slices[static_cast<std::size_t>(axis)].value_or(dims[axis] / 2);
  if (slice < 0 || slice >= dims[axis])
    throw UsageError("slice {} = {} is outside the volume, whose slices along {} are 0 to {}", "xyz"[axis],
                     slice, "xyz"[axis], dims[axis] - 1);
  return slice;
}

// The first slice of a layer of bricks that is nearest to the middle, or the middle, if that is far away.
std::int64_t quick_slice(const BrickGrid& bricks) {
  const std::int64_t slices = bricks.domain.dims.z, middle = slices / 2;
  std::int64_t best = 0;
  const std::int64_t owner = bricks.owner(bricks.domain.first().z + middle);
  for (std::int64_t layer = owner; layer <= owner + 1; ++layer) {
    const std::int64_t first = bricks.domain.samples_at(bricks.owned_box({0, 0, layer})).low.z;
    if (std::abs(first - middle) < std::abs(best - middle)) best = first;
  }
  return best < slices && std::abs(best - middle) <= slices / 20 ? best : middle;
}

// True if a panel may show the means of an overview: a mean never has more than four pixels along an axis. A
// finer overview would be 64 times as large.
bool fits(std::int64_t factor, const Panel& panel) {
  const auto fits_along = [&](const PanelAxis& a) { return 4 * a.samples >= factor * a.pixels; };
  return fits_along(panel.across) && fits_along(panel.down);
}

// The samples of a panel, in the file or in the overview that has them.
Region region_of(const Panel& panel, const CodingParameters& parameters) {
  const std::int64_t block = panel.block();
  Region region;
  region.box.low[panel.axis] = region.box.high[panel.axis] = panel.slice / block;
  for (const PanelAxis& a : {panel.across, panel.down}) {
    region.box.low[a.axis] = a.first / block;
    region.box.high[a.axis] = (a.first + a.samples - 1) / block;
    region.step[a.axis] = a.step() / block;
  }
  region.box = parameters.domain().points_of(region.box);
  return region;
}

Strides strides_of(const Panel& panel, std::int64_t size) {
  Strides strides = {0, 0, 0};
  strides[static_cast<std::size_t>(panel.across.axis)] = size;
  strides[static_cast<std::size_t>(panel.down.axis)] = size * panel.across.count();
  return strides;
}

std::uint64_t sample_count(const Panel& panel) {
  return static_cast<std::uint64_t>(panel.across.count() * panel.down.count());
}

std::uint64_t leaf_number(const BisectionStep& leaf) {
  Index3 sum;
  for (const Index3& v : leaf.vertices) sum = sum + v;
  const auto mix = [](std::uint64_t hash, std::int64_t n) {
    hash = (hash ^ static_cast<std::uint64_t>(n)) * 0x9e3779b97f4a7c15U;
    return hash ^ (hash >> 29);
  };
  return mix(mix(mix(1, sum.x), sum.y), sum.z);
}

// The leaves in the plane of a slice across z.
class LeafMap : public GridTaker {
 public:
  LeafMap(const Panel& panel, const CodingParameters& parameters, std::vector<LeafPixel>& pixels)
      : panel_(panel), bricks_(parameters.bricks()), pixels_(pixels) {
    // Faces of tetrahedra lie in a slice, so the plane moves a little into the bricks that own its samples.
    z_ = panel.slice * PanelAxis::parts + (panel.slice > 0 ? -1 : 1);
  }

  // Sets the pixels whose places the brick owns.
  void add_brick(Index3 position, const LatticeBits& active, const ValueOf&) override {
    const Box owned = bricks_.domain.samples_at(bricks_.owned_box(position));
    const Index3 first = PanelAxis::parts * bricks_.domain.first();
    const Pixels x = pixels_in(panel_.across, owned), y = pixels_in(panel_.down, owned);
    const int cube_size = bricks_.domain.cube_size;
    // Places take divisions.
    std::vector<std::int64_t> across;
    for (int u = x.first; u < x.end; ++u) across.push_back(panel_.across.place(u));
    for (int v = y.first; v < y.end; ++v)
      for (int u = x.first; u < x.end; ++u) {
        const Place place = {
            first + Index3{across[static_cast<std::size_t>(u - x.first)], panel_.down.place(v), z_},
            PanelAxis::parts};
        const BisectionStep leaf = leaf_at(active, place, cube_size);
        pixels_[static_cast<std::size_t>(v) * static_cast<std::size_t>(panel_.across.pixels) +
                static_cast<std::size_t>(u)] = {leaf.level, leaf_number(leaf)};
      }
  }

 private:
  struct Pixels {
    int first, end;
  };
  // Places do not decrease from pixel to pixel, and neither axis of the panel of z is reversed.
  static Pixels pixels_in(const PanelAxis& axis, const Box& owned) {
    const auto first_after = [&](std::int64_t place) {
      // Not std::views::iota, which clang 14 does not compile.
      int low = 0, high = axis.pixels;
      while (low < high) {
        const int middle = (low + high) / 2;
        if (axis.place(middle) > place)
          high = middle;
        else
          low = middle + 1;
      }
      return low;
    };
    // The sample before the first one belongs to another brick, and so do places up to it.
    const std::int64_t low = owned.low[axis.axis];
    return {low == 0 ? 0 : first_after((low - 1) * PanelAxis::parts),
            first_after(owned.high[axis.axis] * PanelAxis::parts)};
  }

  const Panel& panel_;
  BrickGrid bricks_;
  std::vector<LeafPixel>& pixels_;
  std::int64_t z_;
};

// A brick that slices meet: whether its grid is needed, and how many of its slices across z.
struct WantedBrick {
  std::int64_t id;
  bool with_grid;
  std::int64_t slices;
};

// The positions of the bricks that a panel shows.
Box bricks_across(const Panel& panel, const CodingParameters& p) {
  const BrickGrid bricks = p.bricks();
  const Box points = region_of(panel, p).box;
  const auto owner = [&](Index3 at) {
    return Index3{bricks.owner(at.x), bricks.owner(at.y), bricks.owner(at.z)};
  };
  return {owner(points.low), owner(points.high)};
}

// All parts of the volume that are read: the slices, and what the levels are drawn over if they are drawn.
std::vector<PreviewSlice*> parts_of(PreviewContent& content, const CodingParameters& p) {
  std::vector<PreviewSlice*> parts;
  for (PreviewSlice& slice : content.slices) parts.push_back(&slice);
  if (p.counts_points()) parts.push_back(&content.levels);
  return parts;
}

// The bricks of some parts, each once. `with_leaves` is the part whose grid is read.
std::vector<WantedBrick> wanted_bricks(const std::vector<PreviewSlice*>& parts,
                                       const PreviewSlice* with_leaves, const CodingParameters& p) {
  const BrickGrid bricks = p.bricks();
  std::vector<WantedBrick> wanted;
  for (const PreviewSlice* part : parts) {
    const Region region = region_of(part->panel, p);
    const bool with_grid = part == with_leaves && p.stores_activity();
    for (const std::int64_t id : bricks_of(region, bricks))
      wanted.push_back(
          {id, with_grid,
           with_grid ? all_slices : slices_until(region, bricks.owned_box(bricks.position(id)))});
  }
  std::ranges::sort(wanted, {}, &WantedBrick::id);
  std::size_t count = 0;
  for (const WantedBrick& brick : wanted) {
    if (count == 0 || wanted[count - 1].id != brick.id) {
      wanted[count++] = brick;
      continue;
    }
    WantedBrick& before = wanted[count - 1];
    before.with_grid |= brick.with_grid;
    before.slices = std::max(before.slices, brick.slices);
  }
  wanted.resize(count);
  return wanted;
}

struct Plan {
  int threads = 1;
  std::uint64_t memory = 0;
};

Plan plan_preview(PreviewContent& content, const CodingParameters& p, const Resources& resources,
                  std::uint64_t besides) {
  const Panel& levels = content.levels.panel;
  std::uint64_t fixed = besides + resources.besides;
  // Bricks are counted as if none was met twice, in a list that grows by copying.
  for (const PreviewSlice* part : parts_of(content, p)) {
    const Panel& panel = part->panel;
    fixed += sample_count(panel) * (size_of(p.type) + sizeof(double));
    fixed += static_cast<std::uint64_t>(p.bricks().bricks(panel.across.axis) *
                                        p.bricks().bricks(panel.down.axis)) *
             (3 * sizeof(WantedBrick) + sizeof(std::int64_t));
  }
  if (p.counts_points())
    fixed += static_cast<std::uint64_t>(levels.across.pixels) *
             static_cast<std::uint64_t>(levels.down.pixels) * sizeof(LeafPixel);
  // The grid is read with the slices, or computed after them.
  const auto needed = [&](int threads) {
    const std::uint64_t reading = memory_of_reading(p, threads, p.stores_activity());
    if (p.grid != GridOrigin::implied) return reading + fixed;
    return std::max(reading, memory_of_taking(p, bricks_across(levels, p), 0, threads)) + fixed;
  };
  const auto best = [&](std::uint64_t limit) -> std::optional<Plan> {
    for (int threads = resources.threads; threads >= 1; --threads)
      if (needed(threads) <= limit) return Plan{threads, needed(threads)};
    return std::nullopt;
  };
  const Plan plan = within(resources, best, Plan{1, needed(1)});
  if (resources.memory && plan.memory > *resources.memory)
    throw MemoryLimit("a preview of " + described(p.dims, p.type),
                      {.needed = plan.memory, .allowed = *resources.memory});
  return plan;
}

// The overviews that were opened, by factor.
using Overviews = std::map<std::int64_t, std::shared_ptr<const TagBricks>>;

// Opens the overview of a member. False if it is damaged: others, or voxels, take its place.
bool can_open(const TagBricks& file, const Member& member, Overviews& overviews) {
  if (overviews.contains(member.factor)) return true;
  try {
    overviews[member.factor] = file.nested(member);
    return true;
  } catch (const BrokenInput&) {
    overviews.erase(member.factor);
    return false;
  }
}

// The slices, each from the coarsest overview that shows as much.
Overviews choose_panels(const TagBricks& file, const PreviewWishes& wishes, PreviewContent& content) {
  Overviews overviews;
  const Index3& dims = file.parameters().dims;
  const Geometry geometry = in_one_unit(file.header().metadata.geometry());
  const int largest = file.parameters().counts_points() ? wishes.largest : wishes.largest_of_three;
  for (int axis = 0; axis < 3; ++axis) {
    Panel& panel = content.slices[static_cast<std::size_t>(axis)].panel;
    panel = panel_of(dims, geometry.spacing, axis, chosen_slice(wishes, dims, axis), largest, wishes.least);
    const std::vector<Member>& members = file.index().members;
    const auto shown = std::find_if(members.rbegin(), members.rend(), [&](const Member& member) {
      return member.is_overview() && fits(member.factor, panel) && can_open(file, member, overviews);
    });
    if (shown != members.rend()) panel.across.block = panel.down.block = shown->factor;
  }
  return overviews;
}

// A file, or an overview in it, from which parts are read.
struct PreviewSource {
  std::int64_t factor = 1;  // 1: the file itself
  std::shared_ptr<const TagBricks> overview = {};
  std::vector<PreviewSlice*> parts = {};
  std::vector<WantedBrick> bricks = {};

  const TagBricks& of(const TagBricks& file) const { return overview ? *overview : file; }
};

// The file first, then the overviews that are shown.
std::vector<PreviewSource> sources_of(const Overviews& overviews, const PreviewContent& content) {
  std::vector<PreviewSource> sources(1);
  for (const auto& [factor, overview] : overviews) {
    const auto is_shown = [shown = factor](const PreviewSlice& slice) {
      return slice.panel.block() == shown;
    };
    if (std::ranges::any_of(content.slices, is_shown)) sources.push_back({factor, overview});
  }
  return sources;
}

}  // namespace

std::vector<double> values_of(const PreviewSlice& slice, SampleType type) {
  return with_sample_type(type, [&](auto sample) {
    const auto* first = reinterpret_cast<const decltype(sample)*>(slice.samples.data());
    return std::vector<double>(first, first + slice.samples.size() / sizeof(sample));
  });
}

PreviewContent read_preview(const TagBricks& file, const PreviewWishes& wishes, const Resources& resources,
                            std::uint64_t besides, const Progress& progress) {
  const CodingParameters& p = file.parameters();
  PreviewContent content;
  const Overviews overviews = choose_panels(file, wishes, content);
  std::vector<PreviewSource> sources = sources_of(overviews, content);
  Panel& of_z = content.slices[2].panel;
  // Without voxels, bricks are decoded as a whole.
  if (of_z.leaves_out() && !wishes.slices[2] && p.mode == FileMode::voxels)
    for (const PreviewSource& source : sources)
      if (source.factor == of_z.block())
        of_z.slice = of_z.block() * quick_slice(source.of(file).parameters().bricks());
  const Index3 crossing{content.slices[0].panel.slice, content.slices[1].panel.slice, of_z.slice};
  content.levels.panel = of_z.leaves_out() && p.counts_points() ? detail_of(of_z, crossing) : of_z;
  const Plan plan = plan_preview(content, p, resources, besides);
  content.memory = plan.memory;
  const std::vector<PreviewSlice*> parts = parts_of(content, p);
  std::uint64_t total = 0;
  for (PreviewSlice* part : parts) {
    part->samples.resize(sample_count(part->panel) * size_of(p.type));
    total += part->samples.size();
  }
  const Panel& of_levels = content.levels.panel;
  if (p.counts_points())
    content.leaves.resize(static_cast<std::size_t>(of_levels.across.pixels) *
                          static_cast<std::size_t>(of_levels.down.pixels));
  LeafMap leaves(of_levels, p, content.leaves);

  for (PreviewSource& source : sources) {
    for (PreviewSlice* part : parts)
      if (part->panel.block() == source.factor) source.parts.push_back(part);
    source.bricks = wanted_bricks(source.parts, &content.levels, source.of(file).parameters());
    content.bricks += static_cast<std::int64_t>(source.bricks.size());
  }
  std::mutex telling;
  std::uint64_t done = 0;
  const auto read = [&](const PreviewSource& source, const WantedBrick& wanted) {
    const TagBricks& from = source.of(file);
    const CodingParameters& of_source = from.parameters();
    const auto [id, with_grid, slices] = wanted;
    const DecodedBrick brick = decode_block(from.read(id), of_source, from.name(),
                                            with_grid ? Wanted::samples_and_grid : Wanted::samples, slices);
    std::uint64_t bytes = 0;
    for (PreviewSlice* part : source.parts)
      bytes += copy_samples(brick, of_source, region_of(part->panel, of_source), part->samples.data(),
                            strides_of(part->panel, static_cast<std::int64_t>(size_of(p.type))));
    if (with_grid) leaves.add_brick(p.bricks().position(brick.id), brick.active, {});
    if (!progress) return;
    const std::lock_guard lock(telling);
    progress(done += bytes, total);
  };
  Threads(plan.threads).run([&] {
    for (const PreviewSource& source : sources) {
      std::vector<std::int64_t> ids;
      for (const WantedBrick& wanted : source.bricks) ids.push_back(wanted.id);
      source.of(file).will_read(ids);
      oneapi::tbb::parallel_for(std::size_t{0}, source.bricks.size(),
                                [&](std::size_t i) { read(source, source.bricks[i]); });
    }
  });
  if (p.grid == GridOrigin::implied)
    take_some(file, bricks_across(of_levels, p), 0, Resources(plan.threads), leaves);
  return content;
}

}  // namespace tagrid
