// Small volumes in files, for tests of whole runs.
#pragma once

#include <cstdint>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "io/formats/table/formats.h"
#include "io/formats/table/open_volume.h"
#include "io/metadata/text.h"
#include "io/volume/volume_info.h"
#include "stages/sample/sample_type.h"
#include "tests/support/points.h"

namespace tagrid {

/// Writes `samples` as an attached NRRD file.
template <class T>
void write_nrrd(const std::string& path, Index3 dims, const std::vector<T>& samples,
                const std::string& fields = "") {
  VolumeInfo info{dims, sample_type_of<T>(), parse_metadata(fields)};
  const auto writer = create_volume(format_named("nrrd"), path, info, {.files = {.overwrite = true}});
  writer->write_slices(std::as_bytes(std::span(samples)));
  writer->commit();
}

template <class T>
std::vector<T> read_samples(const std::string& path) {
  const auto volume = open_volume(path);
  std::vector<T> samples(static_cast<std::size_t>(Box::of_size(volume->info().dims).count()));
  volume->read_slices(reinterpret_cast<std::byte*>(samples.data()), volume->info().dims.z);
  volume->finish();
  return samples;
}

inline std::string file_content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline void write_content(const std::string& path, const std::string& content) {
  std::ofstream(path, std::ios::binary).write(content.data(), static_cast<std::streamsize>(content.size()));
}

/// Blobs with blurred borders, and noise: they give a grid work at every level.
template <class T>
std::vector<T> blobs(Index3 dims, unsigned seed, double noise = 2) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> part(0, 1);
  struct Blob {
    double x, y, z, r, v;
  };
  std::vector<Blob> all(5);
  for (Blob& b : all)
    b = {part(random) * static_cast<double>(dims.x), part(random) * static_cast<double>(dims.y),
         part(random) * static_cast<double>(dims.z), 2 + part(random) * 12, 30 + part(random) * 60};
  std::vector<T> samples;
  for (const auto [x, y, z] : points_of(dims)) {
    double v = 20;
    for (const Blob& b : all) {
      const double dx = static_cast<double>(x) - b.x, dy = static_cast<double>(y) - b.y,
                   dz = static_cast<double>(z) - b.z;
      const double d = b.r * b.r - (dx * dx + dy * dy + dz * dz);
      if (d > 0) v += b.v * std::min(1.0, d / (b.r * 2));
    }
    samples.push_back(static_cast<T>(std::min(v + noise * part(random), 120.0)));
  }
  return samples;
}

}  // namespace tagrid
