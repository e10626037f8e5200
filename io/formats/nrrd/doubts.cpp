#include "io/formats/nrrd/doubts.h"

#include "io/formats/nrrd/geometry.h"
#include "io/formats/nrrd/rescale.h"

namespace tagrid {
namespace {

std::string without_names(std::string sentence, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    const std::string prefix = name + ": ";
    if (name.empty()) continue;
    for (std::size_t at = 0; (at = sentence.find(prefix, at)) != sentence.npos;)
      if (at == 0 || sentence.compare(at - 2, 2, "; ") == 0)
        sentence.erase(at, prefix.size());
      else
        at += prefix.size();
  }
  return sentence;
}

}  // namespace

std::string lines_of_doubts(const SourceFacts& facts, const std::vector<std::string>& names) {
  const std::string& fields = facts.info.nrrd_fields;
  KeyValues pairs;
  if (!facts.scale_doubt.empty() && text_of_key(fields, scale_doubt_key).empty())
    pairs.emplace_back(scale_doubt_key, without_names(facts.scale_doubt, names));
  std::string all;
  for (const std::string& sentence : facts.not_understood)
    all += (all.empty() ? "" : "; ") + without_names(sentence, names);
  if (!all.empty() && text_of_key(fields, not_understood_key).empty())
    pairs.emplace_back(not_understood_key, all);
  return nrrd_fields_of({}, pairs);
}

std::string scale_doubt_in(std::string_view nrrd_fields) {
  std::string doubt = text_of_key(nrrd_fields, scale_doubt_key);
  if (!doubt.empty() || has_slopes_of_slices(nrrd_fields)) return doubt;
  return doubt_of_rescale(nrrd_fields, 1);
}

std::vector<std::string> doubts_in(std::string_view nrrd_fields) {
  std::vector<std::string> doubts;
  for (std::string sentence : {scale_doubt_in(nrrd_fields), text_of_key(nrrd_fields, not_understood_key)})
    if (!sentence.empty()) doubts.push_back(std::move(sentence));
  return doubts;
}

}  // namespace tagrid
