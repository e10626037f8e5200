#include "io/volume/one_of_several.h"

#include "io/errors/errors.h"
#include "io/text/text.h"

namespace tagrid {

std::int64_t number_of_volume(const std::string& name, const std::string& series, std::int64_t volumes,
                              const std::string& each) {
  // A header that claims more has no choices, as they would take memory.
  constexpr std::int64_t most_choices = 65536;
  if (series.empty() && volumes == 1) return 0;
  const Setting setting{"series", "the number of one"};
  if (series.empty()) {
    std::vector<Choice> choices;
    for (std::int64_t i = 1; i <= volumes && volumes <= most_choices; ++i)
      choices.push_back({std::to_string(i), each});
    throw UsageError(Sentence{"{}: holds {} volumes of {}; choose one with {}, by its number from 1 on",
                              {name, volumes, each, setting}},
                     std::move(choices));
  }
  const auto number = whole_number_of(series);
  if (!number || *number < 1 || *number > volumes)
    throw UsageError(Sentence{"{}: holds {} volumes; {} must be a number from 1 to {}, not {}",
                              {name, volumes, setting, volumes, series}});
  return *number - 1;
}

}  // namespace tagrid
