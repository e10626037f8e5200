// The wavelet: Cohen, Daubechies and Feauveau's symmetric 9/7, by lifting (I. Daubechies and W. Sweldens, "Factoring
// wavelet transforms into lifting steps", 1998), in integers and without its scaling, which the steps of the bands
// contain. It is undone exactly, on every machine.
#pragma once

#include <cstdint>
#include <span>

#include "stages/values/transform/shape.h"

namespace tagrid {

/// The coefficients of a brick, x fastest, in place: low bands are in front of high ones along each axis.
/// REQUIRES: there are as many as the shape has.
void transform_forward(std::span<std::int32_t> coefficients, const TransformShape& shape);
void transform_back(std::span<std::int32_t> coefficients, const TransformShape& shape);

/// Parts of transform_forward(): it is split_slices() and then split_along_z() of each level from 0 on, unless
/// the split is dyadic.
void split_slices(std::span<std::int32_t> coefficients, const TransformShape& shape);
void split_along_z(std::span<std::int32_t> coefficients, const TransformShape& shape, int level);
/// Undoes split_along_z().
void join_along_z(std::span<std::int32_t> coefficients, const TransformShape& shape, int level);

}  // namespace tagrid
