// Samples as numbers of a lattice, so that a chunk may be coded again and again.
//
// HDF5 decodes and encodes a chunk whenever a part of it is written. If every encoding added an error of its
// own, no bound would hold. So a sample is rounded to a lattice that depends on nothing but its type and the
// bound, not on samples beside it, and the number of its place on the lattice is stored losslessly. A rounded
// sample is its own place: coding it again changes nothing. tagrid._lattice does the same for the package of
// Python.
#pragma once

#include <concepts>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "tagrid/tagrid.hpp"

namespace tagrid::hdf5 {

/// The type of the numbers: that of the samples, or int32 for floats.
template <class T>
using NumberOf = std::conditional_t<std::floating_point<T>, std::int32_t, T>;

/// The bits of a float, or an integer itself.
template <class T>
using BitsOf = std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint32_t>;

/// The distance between places of the lattice; 0 if only the sample itself is within the bound. For integers,
/// it is 2 E + 1, where E is the integer part of the bound. For floats, it is the largest m * 2^n, with m
/// below 32, that is at most twice the bound. Its products with small numbers are exact.
double lattice_step(tagrid_type type, double max_error);

/// A lattice: anchor + number * step. The fill value of a data set marks missing samples, so it is not
/// rounded. For integers, it is a place of the lattice; for floats, it is stored separately.
template <class T>
struct Lattice {
  double max_error, step;
  T fill;
  std::int32_t anchor = 0;  ///< of integers; at most half a step
  bool keeps_fill = false;  ///< of floats: the fill value is no place
};

/// REQUIRES: lattice_step(type_of<T>(), max_error) > 0.
template <class T>
Lattice<T> lattice_for(double max_error, T fill);

/// The samples of a chunk: places, or the limit of the type if that is nearer to 0.
template <class T>
struct OnLattice {
  std::vector<NumberOf<T>> numbers;
  /// Samples that are not rounded (NaN, infinities, what is too far from 0, the fill value), and the numbers
  /// that stand for them.
  std::vector<std::pair<NumberOf<T>, BitsOf<T>>> others;
};

/// Rounds samples; each is within the bound of the original. Nothing if too many different samples cannot be
/// rounded.
template <class T>
std::optional<OnLattice<T>> to_lattice(std::span<const T> samples, const Lattice<T>& lattice);

/// The samples, in their order. REQUIRES: samples.size() == numbers.size().
template <class T>
void from_lattice(const OnLattice<T>& places, const Lattice<T>& lattice, std::span<T> samples);

/// The lattice in a chunk's file, as lines of an NRRD header: the step and the anchor (as rescale_slope and
/// rescale_intercept, so that every reader of .tag files gives the right values), the type of the samples,
/// and others.
template <class T>
std::string lattice_lines(const OnLattice<T>& places, const Lattice<T>& lattice);

/// True if the lines of an NRRD header say that the file has numbers of a lattice.
bool has_lattice(const std::string& header);

/// Reads the samples that are not rounded from the lines. Throws Error unless they say this lattice and the
/// type T.
template <class T>
void read_lattice_lines(const std::string& header, const Lattice<T>& lattice, OnLattice<T>& places);

}  // namespace tagrid::hdf5
