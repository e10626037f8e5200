#include "pipeline/work_orders.h"

#include <exception>
#include <stdexcept>

#include "io/byte_fields.h"
#include "io/temporaries.h"

namespace tagrid {
namespace {

enum class Task : std::uint8_t { end, make_parts, place_parts, decode_parts };

// One description of an order for both directions.
class Writing {
 public:
  explicit Writing(Task task) { fields_.put(static_cast<std::uint8_t>(task)); }
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void operator()(const Number& number) { fields_.put(number); }
  void operator()(const std::string& text) {
    fields_.put(static_cast<std::uint64_t>(text.size()));
    fields_.put_bytes(std::as_bytes(std::span(text)));
  }
  void operator()(const Bytes& bytes) {
    fields_.put(static_cast<std::uint64_t>(bytes.size()));
    fields_.put_bytes(bytes);
  }
  template <class T>
  std::size_t size(const std::vector<T>& list) {
    fields_.put(static_cast<std::uint64_t>(list.size()));
    return list.size();
  }
  template <class T>
  bool present(const std::optional<T>& value) {
    fields_.put(static_cast<std::uint8_t>(value.has_value()));
    return value.has_value();
  }
  Bytes& bytes() { return fields_.bytes(); }

 private:
  FieldWriter fields_;
};

class Reading {
 public:
  explicit Reading(FieldReader& fields) : fields_(fields) {}
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void operator()(Number& number) { number = fields_.get<Number>(); }
  void operator()(std::string& text) {
    const auto bytes = fields_.get_bytes(fields_.get<std::uint64_t>());
    text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  void operator()(Bytes& to) {
    const auto bytes = fields_.get_bytes(fields_.get<std::uint64_t>());
    to.assign(bytes.begin(), bytes.end());
  }
  template <class T>
  std::size_t size(std::vector<T>& list) {
    list.resize(fields_.get<std::uint64_t>());
    return list.size();
  }
  template <class T>
  bool present(std::optional<T>& value) {
    if (fields_.get<std::uint8_t>() == 0) return false;
    value.emplace();
    return true;
  }

 private:
  FieldReader& fields_;
};

template <class Fields, class Given>
void describe_resources(Fields& fields, Given& resources) {
  fields(resources.threads);
  if (fields.present(resources.memory)) fields(*resources.memory);
  fields(resources.spool);
}

template <class Fields, class Raw>
void describe_raw(Fields& fields, Raw& raw) {
  if (!fields.present(raw)) return;
  fields(raw->dims.x);
  fields(raw->dims.y);
  fields(raw->dims.z);
  auto type = static_cast<std::uint8_t>(raw->type);
  fields(type);
  if constexpr (!std::is_const_v<Raw>) raw->type = static_cast<SampleType>(type);
  if (fields.present(raw->big_endian)) {
    auto big = static_cast<std::uint8_t>(*raw->big_endian);
    fields(big);
    if constexpr (!std::is_const_v<Raw>) raw->big_endian = big != 0;
  }
  if (fields.present(raw->spacing))
    for (auto& distance : *raw->spacing) fields(distance);
  fields(raw->offset);
}

template <class Fields, class Order>
requires std::is_same_v<std::remove_const_t<Order>, PartOrder>
void describe(Fields& fields, Order& order) {
  fields(order.input);
  describe_raw(fields, order.source.raw);
  fields(order.source.vdb_grid);
  fields(order.folder);
  fields(order.record);
  describe_resources(fields, order.resources);
  fields(order.code_after_signal);
}

template <class Fields, class Order>
requires std::is_same_v<std::remove_const_t<Order>, PlaceOrder>
void describe(Fields& fields, Order& order) {
  fields(order.folder);
  fields(order.record);
  fields(order.file);
  fields(order.name);
  const std::size_t count = fields.size(order.places);
  for (std::size_t i = 0; i < count; ++i) {
    fields(order.places[i].position);
    fields(order.places[i].checksum_before);
  }
}

template <class Fields, class Order>
requires std::is_same_v<std::remove_const_t<Order>, DecodeOrder>
void describe(Fields& fields, Order& order) {
  fields(order.input);
  fields(order.file);
  fields(order.name);
  fields(order.start);
  describe_resources(fields, order.resources);
}

template <class Order>
void send(Ranks& ranks, Task task, const Order& order) {
  if (ranks.count() == 1) return;
  Writing fields(task);
  describe(fields, order);
  ranks.broadcast(fields.bytes());
}

// What fails is told by rank 0, which then gives the last order.
template <class Order, class Do>
void obey(FieldReader& fields, Do work) {
  Order order;
  Reading reading(fields);
  describe(reading, order);
  if (!fields.complete()) throw std::logic_error("an order of rank 0 cannot be read");
  try {
    work(order);
  } catch (const std::exception&) {
  }
}

}  // namespace

void send_order(Ranks& ranks, const PartOrder& order) { send(ranks, Task::make_parts, order); }
void send_order(Ranks& ranks, const PlaceOrder& order) { send(ranks, Task::place_parts, order); }
void send_order(Ranks& ranks, const DecodeOrder& order) { send(ranks, Task::decode_parts, order); }

void dismiss(Ranks& ranks, int code) {
  if (ranks.count() == 1) return;
  Writing fields(Task::end);
  fields(code);
  ranks.broadcast(fields.bytes());
}

int serve(Ranks& ranks, const std::function<void()>& limit_memory) {
  for (;;) {
    Bytes bytes;
    ranks.broadcast(bytes);
    FieldReader fields(bytes);
    switch (static_cast<Task>(fields.get<std::uint8_t>())) {
      case Task::end:
        return fields.get<int>();
      case Task::make_parts:
        obey<PartOrder>(fields, [&](const PartOrder& order) {
          // A run that can be continued leaves its parts; of any other each rank sees to it that nothing is
          // left.
          const int slot = order.code_after_signal < 0 ? register_temporary_folder(order.folder) : -1;
          if (order.code_after_signal >= 0) end_signals_with(order.code_after_signal, "");
          if (order.resources.memory) limit_memory();
          make_parts(ranks, order);
          forget_temporary(slot);
        });
        break;
      case Task::place_parts:
        obey<PlaceOrder>(fields, [&](const PlaceOrder& order) { place_parts(ranks, order); });
        break;
      case Task::decode_parts:
        obey<DecodeOrder>(fields, [&](const DecodeOrder& order) {
          if (order.resources.memory) limit_memory();
          decode_parts(ranks, order);
        });
        break;
      default:
        throw std::logic_error("an order of rank 0 cannot be read");
    }
  }
}

}  // namespace tagrid
