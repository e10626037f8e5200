// Surfaces as VTK XML polygonal data (.vtp), for ParaView and VTK.
#pragma once

#include <cstdint>
#include <string>

#include "io/files/spool_file.h"
#include "io/meshes/surface_file.h"

namespace tagrid {

/// Appended raw data, header_type="UInt64", little endian: Float64 points, Int64 connectivity and offsets.
class VtpFile : public SurfaceFile {
 public:
  VtpFile(const std::string& path, bool overwrite);

  void add(const SurfacePiece& piece) override;
  void finish() override;

 private:
  std::string head() const;

  SpoolFile points_, connectivity_;
  std::int64_t point_count_ = 0, triangle_count_ = 0;
};

}  // namespace tagrid
