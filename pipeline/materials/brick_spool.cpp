#include "pipeline/materials/brick_spool.h"

#include <cstring>
#include <stdexcept>
#include <type_traits>

namespace tagrid {
namespace {

// Calls visit(vector) for all lists of a brick.
template <class Brick, class Visit>
void for_each_list(Brick& brick, Visit visit) {
  visit(brick.nodes);
  visit(brick.elements);
  visit(brick.faces);
  visit(brick.open_faces);
  visit(brick.parts);
}

}  // namespace

std::vector<std::byte> bytes_of(const BrickMesh& brick) {
  std::vector<std::byte> bytes;
  for_each_list(brick, [&](const auto& list) {
    using Entry = typename std::remove_cvref_t<decltype(list)>::value_type;
    static_assert(std::is_trivially_copyable_v<Entry>);
    const std::uint64_t count = list.size();
    const std::size_t end = bytes.size(), size = count * sizeof(Entry);
    bytes.resize(end + sizeof count + size);
    std::memcpy(bytes.data() + end, &count, sizeof count);
    if (size > 0) std::memcpy(bytes.data() + end + sizeof count, list.data(), size);
  });
  return bytes;
}

BrickMesh brick_of(std::span<const std::byte> bytes) {
  BrickMesh brick;
  for_each_list(brick, [&](auto& list) {
    using Entry = typename std::remove_cvref_t<decltype(list)>::value_type;
    std::uint64_t count = 0;
    if (bytes.size() < sizeof count) throw std::logic_error("a brick of a mesh is truncated");
    std::memcpy(&count, bytes.data(), sizeof count);
    bytes = bytes.subspan(sizeof count);
    if (count > bytes.size() / sizeof(Entry)) throw std::logic_error("a brick of a mesh is truncated");
    list.resize(count);
    if (count > 0) std::memcpy(list.data(), bytes.data(), count * sizeof(Entry));
    bytes = bytes.subspan(count * sizeof(Entry));
  });
  if (!bytes.empty()) throw std::logic_error("a brick of a mesh has more bytes than it should");
  return brick;
}

void BrickSpool::add(std::int64_t number, std::span<const std::byte> bytes) {
  places_[number] = {file_.size(), bytes.size()};
  file_.write(bytes);
}

std::vector<std::byte> BrickSpool::bytes(std::int64_t number) {
  const Place place = places_.at(number);
  std::vector<std::byte> bytes(place.size);
  file_.read_at(place.position, bytes);
  return bytes;
}

std::vector<std::int64_t> BrickSpool::numbers() const {
  std::vector<std::int64_t> numbers;
  for (const auto& [number, place] : places_) numbers.push_back(number);
  return numbers;
}

}  // namespace tagrid
