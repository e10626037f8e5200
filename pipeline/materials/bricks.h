// Makes the bricks of a mesh with materials, layer by layer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "io/tag/bricks.h"
#include "pipeline/materials/plan.h"
#include "pipeline/materials/sample_window.h"
#include "pipeline/materials/settings.h"
#include "pipeline/progress/progress.h"
#include "pipeline/threads/threads.h"
#include "stages/materials/brick_mesh.h"

namespace tagrid {

class MaterialBricks {
 public:
  /// `samples` and `job` must stay.
  MaterialBricks(const TagBricks& samples, const MaterialMeshJob& job, std::vector<MeshLayer> layers,
                 int threads, const Progress& progress);

  const std::vector<MeshLayer>& layers() const { return layers_; }
  /// Calls use(number, brick) for the bricks of a layer, in order: all threads make them, one at a time uses them.
  /// Bricks are numbered over all layers. Throws BrokenInput, WorldError, and the exceptions of `use`.
  /// REQUIRES: layers come in rising order.
  void make(std::size_t layer, const std::function<void(std::int64_t, const BrickMesh&)>& use);

 private:
  BrickMesh mesh_of(const Box& closed_box) const;

  const MaterialMeshJob& job_;
  std::vector<MeshLayer> layers_;
  std::vector<std::int64_t> first_;  ///< the number of the first brick of each layer
  SampleWindow window_;
  Threads threads_;
  Progress progress_;
  std::int64_t count_ = 0, done_ = 0;  ///< bricks
};

}  // namespace tagrid
