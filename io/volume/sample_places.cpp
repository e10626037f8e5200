#include "io/volume/sample_places.h"

#include "io/text/text.h"

namespace tagrid {

std::optional<std::uint64_t> span_of_slice(const SliceRun& run, const SliceRows& rows) {
  std::uint64_t span = 0;
  if (__builtin_mul_overflow(static_cast<std::uint64_t>(rows.count - 1),
                             run.row_step == 0 ? rows.bytes : run.row_step, &span) ||
      __builtin_add_overflow(span, rows.bytes, &span))
    return std::nullopt;
  return span;
}

std::optional<std::uint64_t> end_of_run(const SliceRun& run, const SliceRows& rows) {
  const auto span = span_of_slice(run, rows);
  std::uint64_t end = 0;
  if (!span || __builtin_mul_overflow(static_cast<std::uint64_t>(run.slices - 1), run.step, &end) ||
      __builtin_add_overflow(end, run.offset, &end) || __builtin_add_overflow(end, *span, &end))
    return std::nullopt;
  return end;
}

std::string plain_name(std::string_view name) {
  const std::string lower = lower_case(name);
  // A file that is called ".gz" keeps its name.
  const auto has_ending = [&](std::string_view ending) {
    return lower.ends_with(ending) && lower.size() > ending.size() &&
           lower[lower.size() - ending.size() - 1] != '/';
  };
  for (const std::string_view ending : {".gz", ".bz2"})
    if (has_ending(ending)) return std::string(name.substr(0, name.size() - ending.size()));
  if (has_ending(".zraw"))
    return std::string(name.substr(0, name.size() - 4)).append(name.substr(name.size() - 3));
  return std::string(name);
}

}  // namespace tagrid
