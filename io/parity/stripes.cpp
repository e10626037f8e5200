#include "io/parity/stripes.h"

#include "io/bytes/memory_size.h"

namespace tagrid {

StripeBand::StripeBand(const ParityLayout& layout, std::uint64_t memory) : layout_(layout) {
  const std::uint64_t stripe = static_cast<std::uint64_t>(rows()) * layout.block_size();
  most_ = std::clamp<std::uint64_t>(memory / stripe, 1, layout.stripes);
  buffer_.resize(memory_size(most_ * stripe));
  for (int row = 0; row < rows(); ++row) row_starts_.push_back(row_of(row));
}

bool StripeBand::next() {
  first_ += count_;
  count_ = std::min<std::uint64_t>(most_, layout_.stripes - first_);
  return count_ > 0;
}

std::optional<std::uint64_t> StripeBand::number(int row, std::uint64_t i) const {
  const std::uint64_t stripe = first_ + i, stripes = layout_.stripes;
  if (row < layout_.data()) {
    const std::uint64_t block = static_cast<std::uint64_t>(row) * stripes + stripe;
    return block < layout_.blocks() ? std::optional(block) : std::nullopt;
  }
  return layout_.blocks() + static_cast<std::uint64_t>(row - layout_.data()) * stripes + phase(stripe);
}

void StripeBand::for_each_run(bool parity, const std::function<void(const BlockRun&)>& use) {
  for (int row = parity ? layout_.data() : 0; row < (parity ? rows() : layout_.data()); ++row) {
    for (std::uint64_t i = 0; i < count_;) {
      const auto from = number(row, i);
      if (!from) break;
      // A run ends with the band, with the file, and where a row of parity begins again.
      std::uint64_t end = i + 1;
      while (end < count_ && number(row, end) == *from + (end - i)) ++end;
      use({parity,
           *from - (parity ? layout_.blocks() : 0),
           {block(row, i).data(), (end - i) * layout_.block_size()}});
      i = end;
    }
  }
}

void StripeBand::fill_up() {
  const int last = layout_.data() - 1;
  for (std::uint64_t i = 0; i < count_; ++i)
    if (!number(last, i)) std::ranges::fill(block(last, i), std::byte{0});
}

}  // namespace tagrid
