#include "pipeline/materials/bricks.h"

#include <oneapi/tbb/parallel_pipeline.h>

#include <memory>
#include <utility>

namespace tagrid {

MaterialBricks::MaterialBricks(const TagBricks& samples, const MaterialMeshJob& job,
                               std::vector<MeshLayer> layers, int threads, const Progress& progress)
    : job_(job),
      layers_(std::move(layers)),
      window_(samples, job.numbers, samples_of(layers_), threads, progress),
      threads_(threads) {
  std::int64_t count = 0;
  for (const MeshLayer& layer : layers_) {
    first_.push_back(count);
    count += static_cast<std::int64_t>(layer.bricks.size());
  }
}

BrickMesh MaterialBricks::mesh_of(const Box& closed_box) const {
  const Box box = samples_for(job_, closed_box);
  if (job_.label_smoothing) {
    const std::vector<Material> labels = window_.labels(box);
    return mesh_of_brick(LabelField({box, labels.data()}, job_.places, *job_.label_smoothing), job_.settings,
                         closed_box);
  }
  const std::vector<float> values = window_.values(box, job_.reference);
  return mesh_of_brick(ValueField({box, values.data()}, job_.places, job_.thresholds), job_.settings,
                       closed_box);
}

void MaterialBricks::make(std::size_t number, int threads,
                          const std::function<void(std::int64_t, const BrickMesh&)>& use) {
  using oneapi::tbb::filter_mode;
  const MeshLayer& layer = layers_[number];
  if (layer.bricks.empty()) return;
  window_.move_to(layer.samples.low.z, layer.samples.high.z);
  using Made = std::shared_ptr<const BrickMesh>;
  std::size_t next = 0;
  std::int64_t used = first_[number];
  const auto begin = [&](oneapi::tbb::flow_control& control) -> std::size_t {
    if (next == layer.bricks.size()) control.stop();
    return next++;
  };
  const auto mesh = [&](std::size_t brick) -> Made {
    return std::make_shared<const BrickMesh>(mesh_of(layer.bricks[brick]));
  };
  const auto pass = [&](const Made& brick) { use(used++, *brick); };
  threads_.run([&] {
    oneapi::tbb::parallel_pipeline(
        static_cast<std::size_t>(bricks_in_flight(threads)),
        oneapi::tbb::make_filter<void, std::size_t>(filter_mode::serial_in_order, begin) &
            oneapi::tbb::make_filter<std::size_t, Made>(filter_mode::parallel, mesh) &
            oneapi::tbb::make_filter<Made, void>(filter_mode::serial_in_order, pass));
  });
}

}  // namespace tagrid
