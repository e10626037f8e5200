#include "pipeline/materials/bricks.h"

#include <oneapi/tbb/flow_graph.h>

#include <memory>
#include <tuple>
#include <utility>

namespace tagrid {

MaterialBricks::MaterialBricks(const TagBricks& samples, const MaterialMeshJob& job,
                               std::vector<MeshLayer> layers, int threads, const Progress& progress)
    : job_(job),
      layers_(std::move(layers)),
      window_(samples, job.numbers, samples_of(layers_), threads),
      threads_(threads),
      progress_(progress) {
  for (const MeshLayer& layer : layers_) {
    first_.push_back(count_);
    count_ += static_cast<std::int64_t>(layer.bricks.size());
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

void MaterialBricks::make(std::size_t number,
                          const std::function<void(std::int64_t, const BrickMesh&)>& use) {
  const MeshLayer& layer = layers_[number];
  if (layer.bricks.empty()) return;
  const int threads = threads_.count();
  window_.move_to(layer.samples.low.z, layer.samples.high.z);
  namespace flow = oneapi::tbb::flow;
  struct MadeBrick {
    std::size_t number;
    BrickMesh mesh;
  };
  using Made = std::shared_ptr<const MadeBrick>;
  using Pass = flow::multifunction_node<Made, std::tuple<int>>;
  threads_.run([&] {
    std::size_t next = 0;
    flow::graph graph;
    flow::input_node<std::size_t> begin(graph, [&](oneapi::tbb::flow_control& control) -> std::size_t {
      if (next == layer.bricks.size()) control.stop();
      return next++;
    });
    flow::limiter_node<std::size_t, int> few(graph, static_cast<std::size_t>(bricks_in_flight(threads)));
    flow::function_node<std::size_t, Made> mesh(
        graph, static_cast<std::size_t>(threads), [&](std::size_t brick) -> Made {
          return std::make_shared<const MadeBrick>(MadeBrick{brick, mesh_of(layer.bricks[brick])});
        });
    flow::sequencer_node<Made> in_order(graph, [](const Made& brick) { return brick->number; });
    Pass pass(graph, flow::serial, [&](const Made& brick, Pass::output_ports_type& out) {
      use(first_[number] + static_cast<std::int64_t>(brick->number), brick->mesh);
      if (progress_) progress_(static_cast<std::uint64_t>(++done_), static_cast<std::uint64_t>(count_));
      std::get<0>(out).try_put(1);
    });
    flow::make_edge(begin, few);
    flow::make_edge(few, mesh);
    flow::make_edge(mesh, in_order);
    flow::make_edge(in_order, pass);
    flow::make_edge(flow::output_port<0>(pass), few.decrementer());
    run_graph(graph, begin);
  });
}

}  // namespace tagrid
