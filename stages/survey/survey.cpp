#include "stages/survey/survey.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "stages/sample/sample_type.h"
#include "stages/sample/vector_code.h"

namespace tagrid {
namespace survey {

// Adds log2(1 + magnitude / step), in units of 2^-23, for a row. A float's bits are that logarithm if its
// mantissa is taken as the fraction.
TAGRID_VECTOR_CODE double bits_of_row(std::span<const float> magnitudes, float per_step) {
  double sum = 0;
  for (std::size_t first = 0; first < magnitudes.size(); first += 64) {
    const std::size_t end = std::min(first + 64, magnitudes.size());
    std::int64_t part = 0;
    for (std::size_t i = first; i < end; ++i)
      part += std::bit_cast<std::int32_t>(1 + std::min(magnitudes[i] * per_step, 1e30F)) - 0x3F800000;
    sum += static_cast<double>(part);
  }
  return sum;
}

// |sample - mean of its neighbours before|. At the low faces of the box there are fewer of them.
template <class T>
TAGRID_VECTOR_CODE void differences_of_row(const Samples<T>& samples, std::int64_t y, std::int64_t z,
                                           std::span<float> out) {
  const T* row = samples.row(y, z);
  const T* before_y = y > samples.box.low.y ? samples.row(y - 1, z) : row;
  const T* before_z = z > samples.box.low.z ? samples.row(y, z - 1) : before_y;
  if (y == samples.box.low.y) before_y = before_z;
  const auto difference = [](T value, T a, T b, T c) {
    const auto mean = (static_cast<double>(a) + static_cast<double>(b) + static_cast<double>(c)) * (1.0 / 3);
    const auto magnitude = static_cast<float>(std::fabs(static_cast<double>(value) - mean));
    return magnitude < std::numeric_limits<float>::infinity() ? magnitude : 0;
  };
  out[0] = difference(row[0], before_y[0], before_z[0], before_z[0]);
  for (std::size_t x = 1; x < out.size(); ++x)
    out[x] = difference(row[x], row[x - 1], before_y[x], before_z[x]);
}

}  // namespace survey

namespace {

constexpr Index3 block_size = {8, 8, 1};

// Sum of (i - (n - 1) / 2)^2 for i = 0 .. n-1.
double spread_of(std::int64_t n) {
  const auto m = static_cast<double>(n);
  return m * (m * m - 1) / 12;
}

// The deviation of the samples of a block from a plane; negative if one of them is not finite.
template <class T>
double deviation_of(const Samples<T>& samples, const Box& block) {
  const Index3 n = block.size();
  const double count = static_cast<double>(block.count());
  const double centre[3] = {static_cast<double>(n.x - 1) / 2, static_cast<double>(n.y - 1) / 2,
                            static_cast<double>(n.z - 1) / 2};
  // Numbers around the first sample are small, so that their squares are precise.
  const double first = static_cast<double>(samples.at(block.low));
  double sum = 0, squares = 0, slopes[3] = {0, 0, 0};
  for (std::int64_t z = 0; z < n.z; ++z)
    for (std::int64_t y = 0; y < n.y; ++y) {
      const T* row = samples.row(block.low.y + y, block.low.z + z) + (block.low.x - samples.box.low.x);
      double of_row = 0;
      for (std::int64_t x = 0; x < n.x; ++x) {
        const double v = static_cast<double>(row[x]) - first;
        of_row += v;
        squares += v * v;
        slopes[0] += v * (static_cast<double>(x) - centre[0]);
      }
      sum += of_row;
      slopes[1] += of_row * (static_cast<double>(y) - centre[1]);
      slopes[2] += of_row * (static_cast<double>(z) - centre[2]);
    }
  double explained = sum * sum / count, freedoms = count - 1;
  for (int axis = 0; axis < 3; ++axis) {
    if (n[axis] == 1) continue;
    const double spread = spread_of(n[axis]) * (count / static_cast<double>(n[axis]));
    explained += slopes[axis] * slopes[axis] / spread;
    --freedoms;
  }
  if (!std::isfinite(squares) || freedoms < 1) return -1;
  // The rounding of an exact plane is no noise.
  const double rest = squares - explained;
  return rest > 1e-9 * squares ? std::sqrt(rest / freedoms) : 0;
}

}  // namespace

template <class T>
std::vector<double> roughness(const Samples<T>& samples, std::span<const double> steps) {
  std::vector<double> bits(steps.size());
  const Box& box = samples.box;
  std::vector<float> row(static_cast<std::size_t>(box.size().x));
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y) {
      survey::differences_of_row(samples, y, z, row);
      for (std::size_t i = 0; i < steps.size(); ++i)
        bits[i] +=
            survey::bits_of_row(row, static_cast<float>(std::clamp(1 / steps[i], 1e-30, 1e30))) * 0x1p-23;
    }
  return bits;
}

template <class T>
void append_deviations(const Samples<T>& samples, std::vector<double>& deviations) {
  const Box& box = samples.box;
  Index3 edge;
  for (int axis = 0; axis < 3; ++axis) edge[axis] = std::min(box.size()[axis], block_size[axis]);
  const Index3 step = edge - Index3{1, 1, 1};
  for (std::int64_t z = box.low.z; z + step.z <= box.high.z; z += edge.z)
    for (std::int64_t y = box.low.y; y + step.y <= box.high.y; y += edge.y)
      for (std::int64_t x = box.low.x; x + step.x <= box.high.x; x += edge.x) {
        const Index3 low{x, y, z};
        const double deviation = deviation_of(samples, {low, low + step});
        if (deviation > 0) deviations.push_back(deviation);
      }
}

double usual_deviation(std::span<double> deviations) {
  if (deviations.empty()) return 0;
  std::ranges::sort(deviations);
  // How many lie between a deviation and 1.5 times it.
  std::vector<std::uint32_t> within(deviations.size());
  std::uint32_t most = 0;
  for (std::size_t first = 0, end = 0; first < deviations.size(); ++first) {
    while (end < deviations.size() && deviations[end] <= 1.5 * deviations[first]) ++end;
    within[first] = static_cast<std::uint32_t>(end - first);
    most = std::max(most, within[first]);
  }
  // The first cluster, even if a later one is a little larger.
  std::size_t low = 0;
  while (5 * within[low] < 3 * most) ++low;
  std::size_t best = low;
  for (std::size_t first = low; first < deviations.size() && deviations[first] <= 2 * deviations[low];
       ++first)
    if (within[first] > within[best]) best = first;
  return deviations[best + within[best] / 2];
}

bool is_doubtful(double usual, std::span<const double> deviations) {
  const auto calmer = std::ranges::count_if(deviations, [&](double d) { return 2 * d < usual; });
  return 6 * static_cast<std::size_t>(calmer) > deviations.size();
}

#define TAGRID_INSTANTIATE(T)                                                               \
  template std::vector<double> roughness(const Samples<T>&, std::span<const double> steps); \
  template void append_deviations(const Samples<T>&, std::vector<double>&);
TAGRID_FOR_EACH_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
