#include "io/vdb/tree_writer.h"

#include <algorithm>
#include <optional>
#include <tuple>

#include "io/bytes/byte_fields.h"
#include "io/vdb/format.h"
#include "io/vdb/values.h"

namespace tagrid {
namespace {

using Slots = std::span<const VdbSlot>;

/// Calls use(part) for each run of slots that lie in one node of edge 2^log.
template <class Use>
void for_each_node(Slots slots, int log, Use use) {
  const auto node = [&](const VdbSlot& slot) {
    return std::make_tuple(slot.x >> log, slot.y >> log, slot.z >> log);
  };
  while (!slots.empty()) {
    const auto outside = [&](const VdbSlot& slot) { return node(slot) != node(slots.front()); };
    const auto end = std::find_if(slots.begin(), slots.end(), outside);
    const auto count = static_cast<std::size_t>(end - slots.begin());
    use(slots.first(count));
    slots = slots.subspan(count);
  }
}

/// If all `full` slots of a node are tiles of one value: the bits of that value.
std::optional<std::uint64_t> only_value(Slots slots, std::size_t full) {
  const auto is_first = [&](const VdbSlot& slot) {
    return slot.size == 0 && slot.where == slots.front().where;
  };
  if (slots.size() != full || !std::all_of(slots.begin(), slots.end(), is_first)) return std::nullopt;
  return slots.front().where;
}

template <class T>
class TopologyWriter {
 public:
  TopologyWriter(const VdbSink& sink, SpoolFile* spool) : sink_(sink), spool_(spool) {}

  void write(T background, Slots slots) {
    FieldWriter root;
    std::uint32_t tiles = 0, children = 0;
    FieldWriter tile_entries;
    for_each_node(slots, vdb::upper_log, [&](Slots part) {
      if (!only_value(part, vdb::upper_values * vdb::lower_values)) return void(++children);
      ++tiles;
      put_low(tile_entries, part.front());
      tile_entries.put(vdb_tile_value<T>(part.front()));
      tile_entries.put(std::uint8_t{1});
    });
    root.put(std::int32_t{1});  // the number of buffers
    root.put(background);
    root.put(tiles);
    root.put(children);
    root.put_bytes(tile_entries.bytes());
    sink_(root.bytes());
    for_each_node(slots, vdb::upper_log, [&](Slots part) {
      if (only_value(part, vdb::upper_values * vdb::lower_values)) return;
      FieldWriter low;
      put_low(low, part.front());
      sink_(low.bytes());
      write_upper(part);
    });
  }

 private:
  static void put_low(FieldWriter& out, const VdbSlot& slot) {
    for (const std::int32_t c : {slot.x, slot.y, slot.z})
      out.put(static_cast<std::int32_t>(c & -static_cast<std::int32_t>(vdb::upper_edge)));
  }

  static std::size_t entry_of(const VdbSlot& slot, int log, int child_log) {
    const int bits = log - child_log;
    const auto in_node = [&](std::int32_t c) { return (c >> child_log) & ((1 << bits) - 1); };
    return vdb::entry(in_node(slot.x), in_node(slot.y), in_node(slot.z), bits);
  }

  void write_upper(Slots slots) {
    vdb::Mask<vdb::upper_values> children, tiles;
    std::vector<T> values;
    for_each_node(slots, vdb::lower_log, [&](Slots part) {
      const std::size_t entry = entry_of(part.front(), vdb::upper_log, vdb::lower_log);
      const auto value = only_value(part, vdb::lower_values);
      (value ? tiles : children).set(entry);
      if (value) values.push_back(vdb_tile_value<T>(part.front()));
    });
    write_node(children, tiles, values);
    for_each_node(slots, vdb::lower_log, [&](Slots part) {
      if (!only_value(part, vdb::lower_values)) write_lower(part);
    });
  }

  void write_lower(Slots slots) {
    vdb::Mask<vdb::lower_values> children, tiles;
    std::vector<T> values;
    for (const VdbSlot& slot : slots) {
      const std::size_t entry = entry_of(slot, vdb::lower_log, vdb::leaf_log);
      (slot.size == 0 ? tiles : children).set(entry);
      if (slot.size == 0) values.push_back(vdb_tile_value<T>(slot));
    }
    write_node(children, tiles, values);
    for (const VdbSlot& slot : slots) {
      if (slot.size == 0) continue;
      std::byte mask[vdb::leaf_values / 8] = {};
      if (spool_ != nullptr) spool_->read_at(slot.where, mask);
      sink_(mask);
    }
  }

  template <std::size_t count>
  void write_node(const vdb::Mask<count>& children, const vdb::Mask<count>& tiles,
                  const std::vector<T>& values) {
    std::vector<std::byte> node;
    for (const auto* mask : {&children, &tiles}) {
      const auto bytes = mask->bytes();
      node.insert(node.end(), bytes.begin(), bytes.end());
    }
    node.push_back(static_cast<std::byte>(vdb::Inactive::background));
    append_vdb_values(node, values.data(), values.size());
    sink_(node);
  }

  const VdbSink& sink_;
  SpoolFile* spool_;
};

}  // namespace

void sort_vdb_slots(std::vector<VdbSlot>& slots) {
  const auto order = [](const VdbSlot& slot) {
    const auto at = [&](int log) { return std::make_tuple(slot.x >> log, slot.y >> log, slot.z >> log); };
    return std::make_tuple(at(vdb::upper_log), at(vdb::lower_log), at(vdb::leaf_log));
  };
  std::sort(slots.begin(), slots.end(),
            [&](const VdbSlot& a, const VdbSlot& b) { return order(a) < order(b); });
}

template <class T>
void write_vdb_topology(const VdbSink& sink, T background, Slots slots, SpoolFile* spool) {
  TopologyWriter<T>(sink, spool).write(background, slots);
}

void write_vdb_buffers(const VdbSink& sink, Slots slots, SpoolFile& spool) {
  std::vector<std::byte> record;
  for (const VdbSlot& slot : slots) {
    if (slot.size == 0) continue;
    record.resize(slot.size);
    spool.read_at(slot.where, record);
    sink(record);
  }
}

template void write_vdb_topology(const VdbSink&, float, Slots, SpoolFile*);
template void write_vdb_topology(const VdbSink&, double, Slots, SpoolFile*);
template void write_vdb_topology(const VdbSink&, std::int32_t, Slots, SpoolFile*);

}  // namespace tagrid
