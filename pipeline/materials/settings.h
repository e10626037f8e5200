// What a request for a mesh with materials means for a file: its lattice, its materials, and their names.
#pragma once

#include <string>
#include <vector>

#include "io/metadata/geometry.h"
#include "pipeline/materials/material_mesh.h"
#include "stages/materials/brick_mesh.h"

namespace tagrid {

struct MaterialMeshJob {
  MaterialMeshSettings settings;
  SamplePlaces places;
  double reference = 0;           ///< values and thresholds count from this one
  std::vector<float> thresholds;  ///< of values
  MaterialNames names;
  WrittenNumbers numbers;  ///< what samples become
  std::optional<double> label_smoothing;
  std::vector<std::string> warnings = {};
  double fine = 0, coarse = 0;
  std::string unit;

  /// The samples around a position on which its material depends.
  double reach() const { return label_smoothing ? LabelField::reach(*label_smoothing) : ValueField::reach; }
};

/// The materials of a mesh, without its lattice. Throws UsageError if a file cannot have them.
MaterialMeshJob settle_materials(const TagBricks& file, const MaterialMeshOptions& options);
/// Throws UsageError if a file cannot have such a mesh.
MaterialMeshJob settle_material_mesh(const TagBricks& file, const Geometry& geometry,
                                     const MaterialMeshOptions& options);

}  // namespace tagrid
