// What distinguishes images at one position: moments, echoes, energies, segments and others.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

class DcmItem;

namespace tagrid {

/// Values of attributes that tell images from each other, by the numbers of the attributes.
using Moments = std::vector<std::pair<std::uint8_t, std::string>>;

/// How many such attributes there are. Those that are to be tried first come first.
std::size_t count_of_moments();
/// The standard's name: "EchoTime".
std::string_view name_of_moment(std::size_t number);
/// True for times and numbers that may differ from slice to slice of one volume.
bool grows_from_slice_to_slice(std::size_t number);
/// True for the attributes that are always part of the lasting name of a volume. Names are stored
/// in lists and records, so they must not change when more attributes become known.
bool is_in_names(std::size_t number);

/// Sets the attributes that the item has; with `only_setup`, only those that are not part of names.
void read_moments(DcmItem& item, Moments& moments, bool only_setup = false);

/// The values that a file with many frames lists for them in vectors, such as EnergyWindowVector: of frame
/// `frame` of `frames`.
void read_vectors(DcmItem& dataset, std::vector<Moments*> frames);

/// The value; "" if there is none.
std::string_view value_in(const Moments& moments, std::size_t number);

}  // namespace tagrid
