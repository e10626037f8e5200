// Small volumes, encoded and meshed, for tests of the mesh.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "stages/phantom/phantom.h"
#include "stages/sample/sample_type.h"
#include "tests/support/mesh_laws.h"
#include "tests/support/runs.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {

struct TestVolume {
  Index3 dims;
  std::vector<std::int16_t> samples;

  std::int16_t nearest(Index3 p) const {
    const Box box = Box::of_size(dims);
    return samples[static_cast<std::size_t>(box.offset(box.nearest(p)))];
  }
};

/// Flat except for a few samples: the grid is fine around them and coarse elsewhere.
inline TestVolume spiky_volume(Index3 dims, std::uint64_t seed) {
  TestVolume volume{dims, {}};
  std::mt19937_64 random(seed);
  for (std::int64_t i = 0; i < Box::of_size(dims).count(); ++i) {
    const std::uint64_t r = random();
    volume.samples.push_back(r % 61 == 0 ? static_cast<std::int16_t>(r >> 48) : std::int16_t{-700});
  }
  return volume;
}

inline TestVolume phantom_volume(Index3 dims, std::uint64_t seed) {
  TestVolume volume{dims, std::vector<std::int16_t>(static_cast<std::size_t>(Box::of_size(dims).count()))};
  const auto slice = static_cast<std::size_t>(dims.x * dims.y);
  for (std::int64_t z = 0; z < dims.z; ++z)
    phantom_slice<std::int16_t>(
        dims, seed, z, std::span(volume.samples).subspan(static_cast<std::size_t>(z) * slice, slice));
  return volume;
}

/// A mesh on the lattice, with its values.
struct ValuedMesh : LatticeMesh {
  std::vector<std::int16_t> values;
};

class MeshedVolume : public TemporaryFolder {
 protected:
  std::string write_samples(const TestVolume& volume, const std::string& header = {}) const {
    const auto* bytes = reinterpret_cast<const char*>(volume.samples.data());
    return file("volume", header + std::string(bytes, 2 * volume.samples.size()));
  }

  /// Encodes to v.tag.
  EncodeResult encode(const TestVolume& volume, const EncodeOptions& options) const {
    RawDescription raw{.dims = volume.dims, .type = SampleType::int16};
    return encode_volume(write_samples(volume), SourceDescription(raw), path("v.tag"), true, options,
                         Resources(2));
  }

  /// The mesh of v.tag.
  ValuedMesh mesh(std::optional<int> level, bool padded) const {
    const MeshResult result = write_mesh(path("v.tag"), path("v.vtu"), {level, padded, true}, Resources(2));
    Vtu vtu(path("v.vtu"));
    ValuedMesh m{read_lattice_mesh(vtu, result.header.parameters.domain().first()),
                 vtu.array<std::int16_t>("Int16", "value")};
    EXPECT_EQ(result.points, static_cast<std::int64_t>(m.points.size()));
    EXPECT_EQ(result.points, static_cast<std::int64_t>(m.values.size()));
    EXPECT_EQ(result.tetrahedra, static_cast<std::int64_t>(m.size()));
    return m;
  }

  /// The samples of v.tag.
  TestVolume decode(Index3 dims) const {
    TestVolume volume{dims, std::vector<std::int16_t>(static_cast<std::size_t>(Box::of_size(dims).count()))};
    decode_volume(path("v.tag"), path("v.raw"), format_named("raw"), true, Resources(2));
    const std::string bytes = content("v.raw");
    EXPECT_EQ(bytes.size(), 2 * volume.samples.size());
    std::copy_n(bytes.begin(), bytes.size(), reinterpret_cast<char*>(volume.samples.data()));
    return volume;
  }
};

}  // namespace tagrid
