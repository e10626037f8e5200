#include "io/volume/one_of_several.h"

#include "io/files/errors.h"
#include "io/files/text.h"

namespace tagrid {

std::int64_t number_of_volume(const std::string& name, const std::string& series, std::int64_t volumes) {
  if (series.empty() && volumes == 1) return 0;
  const Setting setting{"series", "the number of one"};
  if (series.empty())
    throw UsageError(Sentence{"{}: holds {} volumes; choose one with {}, by its number from 1 on",
                              {name, volumes, setting}});
  const auto number = whole_number_of(series);
  if (!number || *number < 1 || *number > volumes)
    throw UsageError(Sentence{"{}: holds {} volumes; {} must be a number from 1 to {}, not {}",
                              {name, volumes, setting, volumes, series}});
  return *number - 1;
}

}  // namespace tagrid
