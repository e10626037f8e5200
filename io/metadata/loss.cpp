#include "io/metadata/loss.h"

#include <algorithm>

#include "io/metadata/fields.h"
#include "io/metadata/entries.h"

namespace tagrid {
namespace {

constexpr std::string_view separator = "; ", mark = "lossy source: ";

}  // namespace

std::string loss_after(std::string_view earlier, std::string_view later) {
  std::string both(earlier);
  if (!earlier.empty() && !later.empty()) both += separator;
  return both.append(later);
}

std::string with_loss(const std::string& nrrd_fields, std::string_view loss) {
  if (loss.empty()) return nrrd_fields;
  std::string lines;
  for (const NrrdLine& line : nrrd_lines(nrrd_fields))
    if (line.key != lossy_source_key) lines.append(line.text).append("\n");
  const std::string all = loss_after(text_of_key(nrrd_fields, lossy_source_key), loss);
  return lines + nrrd_fields_of({}, {{std::string(lossy_source_key), all}});
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
