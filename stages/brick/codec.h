// Codes one brick as bytes and back. The activity of a file with voxels is coded in the context of the
// decoded samples, so values come first. If samples depend on the activity (surface_error), or are
// interpolated from active points, the activity comes first. The stage before this one is subdivide; the
// container follows. The type of samples is chosen here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "stages/grid/lattice_bits.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/filter_fit.h"
#include "stages/sample/samples.h"
#include "stages/sample/statistics.h"
#include "stages/sample/status.h"

namespace tagrid {

struct BrickCode {
  std::vector<std::uint8_t> activity;  ///< without its first bytes, if the values carry them
  std::vector<std::uint8_t> values;
  Statistics statistics;
  /// If the mesh of the file has a bound: the samples as they will be decoded, x fastest. In a file without
  /// voxels: the stored values of all points of the closed box.
  std::vector<std::byte> decoded;
  /// If the caller puts sums here, the errors of a transformed brick are added.
  std::optional<FilterSums> filter_sums;
};

/// The box of the samples that encode_brick reads: those that the brick owns. In a file without voxels, those
/// of its closed box; a point outside the volume has the value of the nearest sample.
Box samples_to_encode(const CodingParameters& parameters, Index3 brick);

/// Encodes a brick. `active` is the activity of its closed box; it is ignored if the file stores no grid.
/// REQUIRES: samples.box == samples_to_encode(parameters, brick).
template <class T>
void encode_brick(const Samples<T>& samples, const LatticeBits& active, const CodingParameters& parameters,
                  Index3 brick, BrickCode& code);

/// The same for samples of parameters.type.
void encode_brick(const BrickSamples& samples, const LatticeBits& active, const CodingParameters& parameters,
                  Index3 brick, BrickCode& code);

/// True if the activity of a brick is coded in the context of its decoded samples. Otherwise the samples need
/// the activity.
bool activity_follows_values(const CodingParameters& parameters);

/// Decodes the activity of the closed box of a brick.
///   samples   the decoded samples that the brick owns, x fastest; ignored unless
///             activity_follows_values()
template <class T>
Status decode_brick_activity(std::span<const std::uint8_t> bytes, std::span<const T> samples,
                             const CodingParameters& parameters, Index3 brick, LatticeBits& active);

/// Where the decoded values of a brick go.
template <class T>
struct BrickValues {
  /// Those that the brick owns, x fastest. In a file with voxels there may be room for the first slices only:
  /// see decode_voxels().
  std::span<T> samples;
  /// In a file without voxels: the stored values of the points of the closed box, x fastest. Those of active
  /// points are set, the others are not changed.
  std::span<T> points;
  /// Bytes of the activity that the values carry, its first ones, are appended.
  std::vector<std::uint8_t>& carried;
};

/// Decodes the values of a brick. `active` may be empty if activity_follows_values(). REQUIRES: there is room
/// for every value.
template <class T>
Status decode_brick_values(std::span<const std::uint8_t> bytes, const LatticeBits& active,
                           const CodingParameters& parameters, Index3 brick, const BrickValues<T>& values);

/// The peak of the heap that encode_brick() takes, including the code. The first phase is the coder of
/// values, with the decoded samples or the stored values of points. The second phase is the coder of the
/// activity, while the values are kept. In a file without voxels, the interpolation is the last phase. These
/// are upper bounds for any samples, except for voxels of 8 and 16 bits: see encode_voxels().
std::uint64_t working_bytes_of_encoding(const CodingParameters& parameters, Index3 brick);

/// The largest number of bytes of a brick's code: noise takes a few percent more than its samples.
std::uint64_t most_bytes_of_code(const CodingParameters& parameters, Index3 brick);

/// Adds the numbers of active points that the brick owns, by level; see Statistics.
void count_active(const LatticeBits& active, const CodingParameters& parameters, Index3 brick,
                  Statistics& statistics);

/// A decoded brick. Samples are stored as in memory, in the type of the volume, x fastest.
struct DecodedBrick {
  std::int64_t id = 0;
  LatticeBits active;              ///< activity of its closed box; empty in a file that stores no grid
  std::vector<std::byte> samples;  ///< the samples that it owns, or those of its first slices
  std::vector<std::byte> points;   ///< in a file without voxels: see BrickValues
};

/// Which parts of a brick are needed.
enum class Wanted {
  samples,           ///< only samples
  samples_and_grid,  ///< also the active points and the values of points
};

inline constexpr std::int64_t all_slices = std::numeric_limits<std::int64_t>::max();

/// What to decode of a brick.
struct BrickRequest {
  std::int64_t id = 0;  ///< its number
  Wanted wanted = Wanted::samples_and_grid;
  /// Values lie slice after slice: if only the first slices across z are needed, the time for the others is
  /// saved, and their code is not checked. A brick that has fewer, or no values of voxels, is decoded as a
  /// whole. REQUIRES: at least one; all of them with Wanted::samples_and_grid.
  std::int64_t slices = all_slices;
};

/// The bytes of a brick; see BrickCode.
struct BrickCodeView {
  std::span<const std::uint8_t> activity, values;
};

/// Decodes a brick. Safe on any bytes.
Status decode_brick(BrickCodeView code, const CodingParameters& parameters, BrickRequest request,
                    DecodedBrick& brick);

/// Decodes only samples, as decode_brick() does with Wanted::samples. A program that calls nothing else
/// needs no forecast of the activity.
Status decode_brick_samples(BrickCodeView code, const CodingParameters& parameters, std::int64_t id,
                            std::int64_t slices, DecodedBrick& brick);

/// The peak of the heap that decode_brick() takes, including the decoded brick.
std::uint64_t working_bytes_of_decoding(const CodingParameters& parameters, Index3 brick, Wanted wanted);

}  // namespace tagrid
