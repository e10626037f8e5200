// What the samples of a brick are like, found much faster than by encoding it: how rough they are, and how
// noisy.
#pragma once

#include <span>
#include <vector>

#include "stages/sample/samples.h"

namespace tagrid {

/// Bits that a simple coder would spend on the samples of a box, for each of some steps of quantization: the
/// sum of log2(1 + |r| / step), where r is the difference of a sample from the mean of its neighbors before
/// it on the three axes. It is not a size, but it is nearly proportional to one. The logarithm is taken piece
/// by piece as a line. Differences that are not finite do not count. REQUIRES: steps > 0.
template <class T>
std::vector<double> roughness(const Samples<T>& samples, std::span<const double> steps);

/// Appends the standard deviations of the samples of small blocks, 8 x 8 within a slice where the box allows,
/// from the linear function that fits each block best. Where a scan is smooth, that is its noise; slices may
/// be so thick that nothing is smooth across them. Blocks with a sample that is not finite are left out, and
/// so are those without any deviation, such as air that was cut off.
template <class T>
void append_deviations(const Samples<T>& samples, std::vector<double>& deviations);

/// The noise of a volume from the deviations of its blocks: the lowest one around which many of them lie,
/// since blocks with structure have larger ones of all sizes. 0 if there is none. The deviations are
/// reordered.
double usual_deviation(std::span<double> deviations);

/// True if more than a sixth of the deviations are below half of the usual one. Uniform regions are then so
/// rare that structure was probably taken for noise: in small or coarse volumes, blocks with edges agree
/// better than those without. In scans with uniform regions, it is at most a sixteenth.
bool is_doubtful(double usual, std::span<const double> deviations);

}  // namespace tagrid
