#include "pipeline/parts/work_orders.h"

#include <exception>
#include <stdexcept>

#include "io/files/temporaries.h"
#include "pipeline/parts/order_members.h"
#include "pipeline/ranks/messages.h"

namespace tagrid {
namespace {

enum class Task : std::uint8_t {
  end,
  make_parts,
  place_parts,
  decode_parts,
  verify_parts,
  look_at_share,
  of_program
};

// Sends an order. The task comes last in the message.
void send(Ranks& ranks, Task task, Bytes order) {
  if (ranks.count() == 1) return;
  order.push_back(static_cast<std::byte>(task));
  ranks.broadcast(order);
}

// Unpacks an order and carries it out. Ignores failures: rank 0 reports them, and then sends the final order.
template <class Order, class Do>
void obey(const Bytes& bytes, const std::function<void(std::uint64_t)>& limit_memory, Do work) {
  auto order = unpacked_order<Order>(bytes);
  if constexpr (requires { order.resources; })
    if (order.resources.memory) limit_memory(*order.resources.memory);
  try {
    work(order);
  } catch (const std::exception&) {
  }
}

}  // namespace

void send_order(Ranks& ranks, const PartOrder& order) { send(ranks, Task::make_parts, packed_order(order)); }
void send_order(Ranks& ranks, const PlaceOrder& order) {
  send(ranks, Task::place_parts, packed_order(order));
}
void send_order(Ranks& ranks, const DecodeOrder& order) {
  send(ranks, Task::decode_parts, packed_order(order));
}
void send_order(Ranks& ranks, const VerifyOrder& order) {
  send(ranks, Task::verify_parts, packed_order(order));
}
void send_order(Ranks& ranks, const ContentOrder& order) {
  send(ranks, Task::look_at_share, packed_order(order));
}
void send_order(Ranks& ranks, const Bytes& order) { send(ranks, Task::of_program, order); }

void dismiss(Ranks& ranks, int code) {
  FieldWriter fields;
  fields.put(code);
  send(ranks, Task::end, fields.bytes());
}

int serve(Ranks& ranks, const std::function<void(std::uint64_t)>& limit_memory,
          const std::function<void(const Bytes&)>& obey_program) {
  for (;;) {
    Bytes bytes;
    ranks.broadcast(bytes);
    const Task task = static_cast<Task>(bytes.back());
    bytes.pop_back();
    switch (task) {
      case Task::end:
        return FieldReader(bytes).get<int>();
      case Task::make_parts: {
        int slot = -1;
        obey<PartOrder>(bytes, limit_memory, [&](const PartOrder& order) {
          // A run that can be continued leaves its parts. In any other run, each rank makes sure that nothing is left.
          if (order.code_after_signal < 0)
            slot = register_temporary_folder(order.folder);
          else
            end_signals_with(order.code_after_signal, "");
          make_parts(ranks, order);
        });
        forget_temporary(slot);
        break;
      }
      case Task::place_parts:
        obey<PlaceOrder>(bytes, limit_memory, [&](const PlaceOrder& order) { place_parts(ranks, order); });
        break;
      case Task::decode_parts:
        obey<DecodeOrder>(bytes, limit_memory, [&](const DecodeOrder& order) { decode_parts(ranks, order); });
        break;
      case Task::verify_parts:
        obey<VerifyOrder>(bytes, limit_memory, [&](const VerifyOrder& order) { verify_parts(ranks, order); });
        break;
      case Task::look_at_share:
        obey<ContentOrder>(bytes, limit_memory, [&](ContentOrder& order) { look_at_share(ranks, order); });
        break;
      case Task::of_program:
        obey_program(bytes);
        break;
      default:
        throw std::logic_error("a task from rank 0 cannot be read");
    }
  }
}

}  // namespace tagrid
