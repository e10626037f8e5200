#include "tools/formats/tiff/remarks.h"

#include <algorithm>

namespace tagrid {
namespace {

void add_once(std::vector<std::string>& list, std::string sentence) {
  if (!sentence.empty() && std::ranges::find(list, sentence) == list.end())
    list.push_back(std::move(sentence));
}

}  // namespace

void TiffRemarks::warn(std::string sentence) { add_once(warnings, std::move(sentence)); }
void TiffRemarks::miss(std::string sentence) { add_once(not_understood, std::move(sentence)); }
void TiffRemarks::doubt(std::string sentence) {
  if (scale_doubt.empty()) scale_doubt = std::move(sentence);
}

void TiffRemarks::add(const TiffRemarks& others) {
  for (const std::string& sentence : others.warnings) warn(sentence);
  for (const std::string& sentence : others.not_understood) miss(sentence);
  doubt(others.scale_doubt);
}

}  // namespace tagrid
