#include "io/vdb/metadata.h"

#include "io/vdb/bytes.h"

namespace tagrid {

void VdbMetadata::add_name(std::string_view name, std::string_view type) {
  put_vdb_text(entries_, name);
  put_vdb_text(entries_, type);
  ++count_;
}

template <class T>
void VdbMetadata::add_number(std::string_view name, std::string_view type, T number) {
  add_name(name, type);
  entries_.put(static_cast<std::uint32_t>(sizeof(T)));
  entries_.put(number);
}

void VdbMetadata::add(std::string_view name, std::string_view text) {
  add_name(name, "string");
  put_vdb_text(entries_, text);
}

void VdbMetadata::add(std::string_view name, const Index3& vector) {
  add_name(name, "vec3i");
  entries_.put(static_cast<std::uint32_t>(3 * sizeof(std::int32_t)));
  for (int axis = 0; axis < 3; ++axis) entries_.put(static_cast<std::int32_t>(vector[axis]));
}

void VdbMetadata::add(std::string_view name, double number) { add_number(name, "double", number); }
void VdbMetadata::add(std::string_view name, std::int64_t number) { add_number(name, "int64", number); }

void VdbMetadata::put_to(FieldWriter& out) const {
  out.put(count_);
  out.put_bytes(entries_.bytes());
}

}  // namespace tagrid
