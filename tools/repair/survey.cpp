#include "tools/repair/survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "io/files/file_attributes.h"
#include "io/files/open_source.h"
#include "io/text/text.h"
#include "pipeline/memory/parity.h"

namespace tagrid {

std::string damage_text(const ParityCondition& condition) {
  if (condition.is_file_intact()) return "only the parity is damaged";
  if (condition.damaged_blocks == 0) return "bytes follow the end";
  return fmt::format("{}{}", counted(condition.damaged_blocks, "damaged block"),
                     condition.damaged_parity > 0 || condition.damaged_frame ? "; parity, too" : "");
}

bool is_of_another_file(const SurveyedParity& parity) {
  // Parity makes up for half of a file at most.
  return parity.file.is_beside() && parity.condition.damaged_blocks > parity.file.layout().blocks() / 4 * 3;
}

std::optional<SurveyedParity> survey_parity(const std::string& path, const RunOptions& run,
                                            const std::string& work) {
  std::optional<std::uint64_t> limit = run.memory;
  if (limit) *limit -= std::min(*limit, memory_of_declared_sources());
  const auto surveyed = [&](const ProtectedFile& file) {
    return SurveyedParity{file, file.survey(memory_for_stripes(limit, file.layout(), work))};
  };
  const auto found = protected_file(path);
  if (!found) return std::nullopt;
  SurveyedParity parity = surveyed(*found);
  const auto bytes = open_source(path);
  if (found->is_beside()) {
    if (parity.condition.is_repairable() && bytes->size() <= found->whole_size()) return parity;
    // Parity in the file, whose foot is damaged, may be of more help, and is then rebuilt itself.
    if (const auto inside = ProtectedFile::find(bytes))
      if (SurveyedParity other = surveyed(*inside); other.condition.is_repairable()) return other;
  } else if (!parity.condition.is_repairable() && is_regular_input(parity_beside(path))) {
    // Parity beside the file may bring back what that in it cannot, though not that itself.
    const auto file = beginning_of(bytes, std::min(found->layout().file_size, bytes->size()));
    const auto beside = ProtectedFile::find(file, std::make_shared<FileSource>(parity_beside(path)));
    if (beside && beside->is_beside())
      if (SurveyedParity other = surveyed(*beside);
          other.condition.is_repairable() && !other.condition.is_file_intact())
        return other;
  }
  return parity;
}

std::string why_not_repairable(const SurveyedParity& parity, const std::string& path) {
  const auto& [file, condition] = parity;
  if (is_of_another_file(parity))
    return fmt::format("is not repairable: {} is of another file, or nearly all is damaged",
                       parity_beside(path));
  if (condition.unknown_pages > 0)
    return fmt::format("is not repairable: too much of the description of its parity is lost ({})",
                       counted(condition.unknown_pages, "page"));
  std::uint64_t bytes = 0;
  for (const Stretch& stretch : condition.lost) bytes += stretch.end - stretch.begin;
  return fmt::format(
      "is not repairable: the damage exceeds what the parity can repair; {} bytes in {} are lost", bytes,
      counted(condition.lost.size(), "place"));
}

}  // namespace tagrid
