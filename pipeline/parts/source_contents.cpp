
#include <algorithm>
#include <map>

#include "pipeline/parts/order_members.h"
#include "pipeline/parts/part_work.h"
#include "pipeline/parts/work_orders.h"
#include "pipeline/ranks/messages.h"
#include "pipeline/restore/restore.h"

namespace tagrid {
namespace {

// Messages between ranks are small.
constexpr std::size_t files_at_once = 4096;

/// Some files of a source, and no others.
SourceFiles only(const SourceFiles& all, std::size_t first, std::size_t end) {
  SourceFiles some;
  some.shape = all.shape;
  std::map<std::size_t, std::size_t> numbers;  // of paths, there and here
  for (std::size_t i = first; i < end; ++i) {
    some.files.push_back(all.files[i]);
    some.pieces.push_back(all.pieces[i]);
    for (PlainPiece& piece : some.pieces.back()) {
      if (piece.kind != PlainPiece::Kind::stretch && piece.kind != PlainPiece::Kind::content) continue;
      const auto [number, is_new] = numbers.emplace(piece.file, some.paths.size());
      if (is_new) some.paths.push_back(all.paths[piece.file]);
      piece.file = number->second;
    }
  }
  return some;
}

}  // namespace

void look_at_share(Ranks& ranks, ContentOrder& order) {
  const std::size_t files = order.source.files.size(), count = static_cast<std::size_t>(ranks.count());
  const auto begin_of = [&](std::size_t rank) { return files * rank / count; };
  const auto rank = static_cast<std::size_t>(ranks.rank());
  SourceFiles own;
  all_do(ranks, [&] {
    own = only(order.source, begin_of(rank), begin_of(rank + 1));
    look_at_contents(own, order.exact, of_this_rank(ranks, order.resources).threads);
  });
  const std::vector<Bytes> seen = ranks.gather(packed_order(own.files));
  for (std::size_t other = 0; other < seen.size(); ++other)
    std::ranges::move(unpacked_order<std::vector<EnvelopeFile>>(seen[other]),
                      order.source.files.begin() + static_cast<std::ptrdiff_t>(begin_of(other)));
}

void share_contents(Ranks& ranks, SourceFiles& source, bool exact, const Resources& resources) {
  for (std::size_t first = 0; first < source.files.size(); first += files_at_once) {
    const std::size_t end = std::min(first + files_at_once, source.files.size());
    ContentOrder order{only(source, first, end), exact, resources};
    send_order(ranks, order);
    look_at_share(ranks, order);
    std::ranges::move(order.source.files, source.files.begin() + static_cast<std::ptrdiff_t>(first));
  }
}

}  // namespace tagrid
