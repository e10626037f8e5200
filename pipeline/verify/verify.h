// Verifies a file: checksums, bricks, grid, statistics, and the original. Counts the points of derived grids.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "io/volume/volume_info.h"
#include "io/volume/volume_source.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

struct GeometryComparison {
  std::vector<std::string> compared;  ///< what both say: "spacing", "origin", "rescale_slope"
  bool file_places_samples = false;   ///< says anything of where its samples are
  bool original_places_samples = false;
  std::vector<std::string> differences;  ///< "the spacing along x is 0.5, but 0.7 in the original"
};

/// Compares the metadata of a file with that of an original, where both have it:
/// spacings, directions, origin, slopes, intercepts, positions of slices. Known units and spaces that differ
/// in signs are converted; what cannot be compared is left out. Numbers may differ by 1e-5 of a spacing or a
/// coordinate, and by 1e-6 of a slope or an intercept, as formats with float32 or six digits make them. A
/// slope or an intercept on one side alone is a difference, unless it changes nothing or the original has no
/// place for it (`original_has_scale`).
GeometryComparison compare_geometry(const Metadata& metadata, const Metadata& of_original,
                                    bool original_has_scale = true);

struct VerifyRun {
  std::string input;  ///< the .tag file; "-": the standard input
  std::optional<std::string> original = std::nullopt;
  SourceDescription source = {};  ///< of the original
  Resources resources{0};         ///< per rank; 0 threads: all that the rank may use
  Progress progress = {};
};

struct VerifyResult {
  TagHeader header;
  TagIndex index;
  std::uint64_t bytes_in = 0;  ///< of the .tag file
  std::int64_t bricks = 0;
  /// Empty if the grid is not in the bricks, and there was too little memory to compute it.
  std::optional<std::uint64_t> active_points;
  /// With an original: errors measured against it.
  std::optional<double> max_error;
  std::optional<double> mesh_error;  ///< only if the mesh of the file has a bound
  GeometryComparison geometry;       ///< with an original, of verify_file() alone
  /// False if only the checksums of further volumes and overviews were checked, as in a pipe.
  bool are_members_decoded = true;
  /// False if these were not compared with the original, as it can be read only once.
  bool are_members_compared = true;
};

/// Verifies any bytes, without an original; otherwise like verify_file() in pipeline/run/run.h.
VerifyResult verify_bytes(std::unique_ptr<ByteStream> input, const Resources& resources,
                          const Progress& progress = {});

/// The description of an original of a file with this header: all of its volumes, if the file has several.
SourceDescription source_of_as_many(SourceDescription source, const TagHeader& header);

/// The smallest limit with which a file can be compared with its original. `strips`: rows of the original can be read in
/// any order, or spooled. `besides`: memory of its reader.
std::uint64_t smallest_memory_of_verifying(const CodingParameters& parameters, bool strips,
                                           std::uint64_t besides = 0);

struct VerifySetup;
/// See setup_against() in pipeline/verify/verifier.h.
using SetupAgainst = VerifySetup (*)(const std::string& name, const CodingParameters& parameters,
                                     std::unique_ptr<VolumeSource> original, const Resources& resources);

/// Verifies the members of a file: checksums, and volumes and overviews as any file. With `original`, which has
/// as many volumes and of which any slice can be read next, also compares volumes with its own, and overviews
/// with the means of its blocks, which wait in temporary files in `resources.spool`. What was found of volumes
/// is added to `all`, if it is not null. `against` is setup_against() if there is an original: the library, which
/// has none, does not link what opens other formats. Throws as verify_file() does.
void verify_members(const TagBricks& file, VolumeSource* original, const Resources& resources,
                    VerifyResult* all = nullptr, SetupAgainst against = nullptr);

/// The same for a file that has been opened but not read.
VerifyResult verify_all(TagReader& reader, VerifySetup setup, const Progress& progress = {});

/// The numbers of active points of each level, by the grid of the decoded samples. Decodes the file, which
/// has not been read yet, in the memory that a mesh takes. Throws BrokenInput, WorldError, MemoryLimit, and
/// the exceptions of `progress`. REQUIRES: the file stores no grid.
Statistics count_active_points(TagReader& reader, const Resources& resources, const Progress& progress = {});

/// The summary of a file, as summary_of() reads it. The levels of a grid that is not stored are counted.
TagSummary summary_with_levels(const std::string& path, const Resources& resources,
                               const Progress& progress = {});

}  // namespace tagrid
