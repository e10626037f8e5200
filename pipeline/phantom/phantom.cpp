#include "pipeline/phantom/phantom.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <vector>

#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/metadata/metadata.h"
#include "pipeline/memory/resources.h"
#include "pipeline/threads/threads.h"
#include "stages/phantom/phantom.h"

namespace tagrid {
namespace {

VolumeInfo info_of(const PhantomOptions& options) {
  const Index3 n = options.dims;
  require(sample_bytes(n, options.type).has_value(),
          {"{} {},{},{}: the volume must be smaller than 2^62 bytes", Setting{"dims", "the sizes"}, n.x, n.y,
           n.z});
  Geometry geometry;
  geometry.spacing = {1, 1, 1};
  geometry.has_spacing = true;
  return {n, options.type, Metadata(geometry)};
}

}  // namespace

Finished<std::uint64_t> write_phantom(const PhantomRun& run) {
  const PhantomOptions& options = run.options;
  const VolumeInfo info = info_of(options);
  const std::shared_ptr<VolumeSink> sink =
      create_volume(run.format, run.output, info, {.files = {.overwrite = run.overwrite}});
  require_memory_of_writer({run.format.writes.program, run.format.writes.holds_volume}, sink->memory(),
                           Resources(run.threads));
  const std::int64_t nz = options.dims.z, batch = std::min<std::int64_t>(run.threads, nz);
  const std::uint64_t total = *sample_bytes(options.dims, options.type);
  const std::size_t slice_bytes = memory_size(total / static_cast<std::uint64_t>(nz));
  std::vector<std::byte> slices(memory_size(static_cast<std::uint64_t>(batch) * slice_bytes));
  ProgressWatch watch(run.progress, total);
  Threads threads(run.threads);
  for (std::int64_t z = 0; z < nz; z += batch) {
    const std::int64_t count = std::min(batch, nz - z);
    threads.run([&] {
      oneapi::tbb::parallel_for(std::int64_t{0}, count, [&](std::int64_t i) {
        with_sample_type(options.type, [&](auto sample) {
          using T = decltype(sample);
          auto* out = reinterpret_cast<T*>(slices.data() + static_cast<std::size_t>(i) * slice_bytes);
          phantom_slice<T>(options.dims, options.seed, z + i, {out, slice_bytes / sizeof(T)});
        });
      });
    });
    sink->write_slices(std::span(slices).first(static_cast<std::size_t>(count) * slice_bytes));
    watch.done(static_cast<std::uint64_t>(count) * slice_bytes);
  }
  return {sink->bytes_written(), sink};
}

}  // namespace tagrid
