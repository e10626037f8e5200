#include "pipeline/materials/sample_window.h"

#include <algorithm>
#include <utility>

#include "pipeline/reading/read_region.h"

namespace tagrid {

SampleWindow::SampleWindow(const TagBricks& file, const WrittenNumbers& numbers, const Box& needed,
                           int threads)
    : file_(file),
      numbers_(numbers),
      type_(numbers.type(file.parameters().type)),
      needed_(needed),
      threads_(threads),
      next_(needed.low.z) {}

void SampleWindow::move_to(std::int64_t low, std::int64_t high) {
  while (!layers_.empty() && layers_.front().box.high.z < low) layers_.pop_front();
  high = std::min(high, needed_.high.z);
  const CodingParameters& parameters = file_.parameters();
  const Domain& domain = parameters.domain();
  const BrickGrid bricks = parameters.bricks();
  const auto bytes_of_sample = static_cast<std::int64_t>(size_of(type_));
  while (next_ <= high) {
    // Complete layers of bricks, so that none is decoded twice.
    const std::int64_t layer = bricks.owner(domain.first().z + next_);
    Box box = needed_;
    box.low.z = next_;
    box.high.z = std::min(domain.samples_at(bricks.owned_box({0, 0, layer})).high.z, needed_.high.z);
    next_ = box.high.z + 1;
    if (box.high.z < low) continue;
    const Index3 strides = bytes_of_sample * box.strides();
    Layer& added = layers_.emplace_back(Layer{box, {}});
    added.bytes.resize(static_cast<std::size_t>(box.count() * bytes_of_sample));
    read_region(file_, Region{domain.points_of(box)},
                {added.bytes.data(), {strides.x, strides.y, strides.z}, numbers_}, threads_);
  }
}

template <class Number, class NumberOf>
std::vector<Number> SampleWindow::numbers(const Box& box, NumberOf number) const {
  std::vector<Number> result(static_cast<std::size_t>(box.count()));
  with_sample_type(type_, [&](auto type) {
    using T = decltype(type);
    for (const Layer& layer : layers_) {
      const Box part = intersection(box, layer.box);
      if (part.empty()) continue;
      const Samples<T> samples{layer.box, reinterpret_cast<const T*>(layer.bytes.data())};
      const auto row = static_cast<std::size_t>(part.size().x);
      for (std::int64_t z = part.low.z; z <= part.high.z; ++z)
        for (std::int64_t y = part.low.y; y <= part.high.y; ++y) {
          const T* const from = &samples.at({part.low.x, y, z});
          Number* const to = result.data() + box.offset({part.low.x, y, z});
          for (std::size_t i = 0; i < row; ++i) to[i] = number(from[i]);
        }
    }
  });
  return result;
}

std::vector<Material> SampleWindow::labels(const Box& box) const {
  return numbers<Material>(box, [](auto sample) { return static_cast<Material>(sample); });
}

std::vector<float> SampleWindow::values(const Box& box, double reference) const {
  return numbers<float>(box, [reference](auto sample) {
    const double value = static_cast<double>(sample) - reference;
    return static_cast<float>(value > -largest_value ? std::min(value, largest_value) : -largest_value);
  });
}

std::uint64_t SampleWindow::working_bytes(const CodingParameters& parameters, const WrittenNumbers& numbers,
                                          const Box& needed, std::int64_t slices) {
  // A layer may begin below the window, and one may end above it.
  const std::int64_t most = std::min(slices + 2 * parameters.bricks().length(), needed.size().z);
  return static_cast<std::uint64_t>(needed.size().x * needed.size().y * most) *
         size_of(numbers.type(parameters.type));
}

}  // namespace tagrid
