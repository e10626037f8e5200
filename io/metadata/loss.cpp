#include "io/metadata/loss.h"

#include <algorithm>

namespace tagrid {
namespace {

constexpr std::string_view separator = "; ", mark = "lossy source: ";

}  // namespace

std::string loss_after(std::string_view earlier, std::string_view later) {
  std::string both(earlier);
  if (!earlier.empty() && !later.empty()) both += separator;
  return both.append(later);
}

void add_loss(std::string_view loss, Metadata& metadata) {
  if (loss.empty()) return;
  const std::string all = loss_after(metadata.text_of(lossy_source_key), loss);
  metadata.erase(lossy_source_key);
  metadata.add_pairs({{std::string(lossy_source_key), all}});
}

std::string TextWithLoss::joined(std::size_t most) const {
  if (loss.empty()) return text.substr(0, most);
  const std::string end = (std::string(mark) + loss).substr(0, most);
  if (text.empty() || most < end.size() + separator.size()) return end;
  const std::string begin = text.substr(0, most - end.size() - separator.size());
  return begin.empty() ? end : begin + std::string(separator) + end;
}

TextWithLoss text_with_loss(std::string_view joined) {
  const std::size_t at = joined.find(mark);
  if (at == joined.npos || (at > 0 && !joined.substr(0, at).ends_with(separator)))
    return {std::string(joined), ""};
  return {std::string(joined.substr(0, at == 0 ? 0 : at - separator.size())),
          std::string(joined.substr(at + mark.size()))};
}

}  // namespace tagrid
