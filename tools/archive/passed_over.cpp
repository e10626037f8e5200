#include "tools/archive/passed_over.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "io/files/file_bytes.h"
#include "io/formats/table/formats.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// Extensions of files that often hold samples alone.
constexpr std::array samples_alone = {".raw", ".vol", ".bin", ".dat", ".img", ".rec"};

}  // namespace

void PassedOver::add(const fs::path& file, const std::string& why) {
  names_[{file.parent_path().string(), why}].push_back(file.filename().string());
}

void PassedOver::belongs(const std::string& file) { of_volumes_.insert(fs::weakly_canonical(file).string()); }

void PassedOver::report(const fs::path& root,
                        const std::function<void(const std::string&, std::size_t)>& use) const {
  constexpr std::size_t most_names = 5;
  for (const auto& [where, names] : names_) {
    std::string listed;
    std::size_t count = 0;
    for (const std::string& name : names) {
      if (of_volumes_.contains((fs::path(where.first) / name).string())) continue;
      if (++count <= most_names) listed += fmt::format("{}{}", listed.empty() ? "" : ", ", name);
    }
    if (count == 0) continue;
    if (count > most_names) listed += fmt::format(" and {} more", count - most_names);
    use(fmt::format("{}: {}: {}", fs::path(where.first).lexically_relative(root).string(), listed,
                    where.second),
        count);
  }
}

std::string why_no_volume(const std::string& path) {
  FileBytes file(path);
  const std::string_view beginning = file.peek(bytes_to_recognize());
  if (beginning.empty()) return "empty";
  if (const Format* other = format_of(beginning, false)) {
    const std::string_view what = other->what;
    return std::string(what.substr(0, what.find(';')));
  }
  const std::string extension = lower_case(fs::path(path).extension().string());
  if (std::ranges::find(samples_alone, extension) != samples_alone.end())
    return "perhaps samples without a header: a line needs the columns dims= and type=";
  return "no known format";
}

}  // namespace tagrid
