// What all calls of the library share: status codes, structs, and conversions of what is described.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>

#include "io/errors/errors.h"
#include "io/tag/blocks.h"
#include "io/tag/header.h"
#include "io/tag/index.h"
#include "io/volume/volume_info.h"
#include "stages/grid/box.h"
#include "stages/sample/samples.h"
#include "tagrid/tagrid.h"

namespace tagrid::library {

/// The messages of a handle that is used by one thread at a time. The last message is returned to any thread.
class SharedMessage {
 public:
  void set(std::string text) noexcept { text_ = std::move(text); }
  const char* get() const { return text_.c_str(); }

 private:
  std::string text_;
};

/// The status of an error.
tagrid_status status_of(const SortedError& error);

/// Sets a struct of a caller to its defaults, which was compiled with an older or a newer header: `size` bytes of it
/// are there.
template <class Struct>
void set_up(Struct* given, std::size_t size, Struct defaults = {}) {
  if (given == nullptr) return;
  defaults.struct_size = size;
  std::memset(given, 0, size);
  std::memcpy(given, &defaults, std::min(size, sizeof defaults));
}

/// Reads a struct of a caller that was compiled with an older or a newer header: missing members get their
/// defaults, unknown ones are ignored. `first_size`: of the struct's first version.
template <class Struct>
Struct taken_over(const Struct* given, void (*init)(Struct*), std::size_t first_size) {
  Struct result;
  init(&result);
  if (given == nullptr) return result;
  require(given->struct_size >= first_size, "a struct was not set up: call its init function first");
  std::memcpy(&result, given, std::min(given->struct_size, sizeof result));
  result.struct_size = sizeof result;
  return result;
}

/// The reverse: writes as much of a result as the caller's struct can hold.
template <class Struct>
void hand_over(Struct result, Struct* to, std::size_t first_size) {
  require(to != nullptr, "there is no struct to fill");
  require(to->struct_size >= first_size, "struct_size must be set to the size of the struct");
  result.struct_size = to->struct_size;
  std::memcpy(to, &result, std::min(to->struct_size, sizeof result));
}

/// A caller's half-open box within `dims`, with both ends included. Throws UsageError.
Box box_of(const tagrid_box& box, const Index3& dims);
/// The reverse.
tagrid_box half_open(const Box& box);
/// `strides`; if null, those of `shape` samples without gaps.
Strides strides_of(const std::int64_t* strides, const Index3& shape, std::size_t sample_size);

tagrid_geometry geometry_of_volume(const Geometry& geometry);
tagrid_info info_of(const TagHeader& header, const TagIndex& index, const TagSizes& sizes);
/// See tagrid_reader_overviews().
void list_overviews(const TagIndex& index, std::int64_t* factors);

}  // namespace tagrid::library
