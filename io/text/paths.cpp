#include "io/text/paths.h"

#include <algorithm>
#include <array>

#include "io/errors/errors.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

bool is_device(std::string_view step) {
  // Windows looks at what is before the first dot or colon, without the spaces there.
  std::string_view stem = step.substr(0, step.find_first_of(".:"));
  while (stem.ends_with(' ')) stem.remove_suffix(1);
  const std::string name = lower_case(stem);
  constexpr std::array<std::string_view, 7> devices = {"con",    "prn",     "aux",   "nul",
                                                       "conin$", "conout$", "clock$"};
  if (std::ranges::count(devices, std::string_view(name)) > 0) return true;
  if (!name.starts_with("com") && !name.starts_with("lpt")) return false;
  // The superscripts are digits to Windows.
  constexpr std::array<std::string_view, 13> numbers = {"0", "1", "2", "3",        "4",        "5",       "6",
                                                        "7", "8", "9", "\xC2\xB9", "\xC2\xB2", "\xC2\xB3"};
  return std::ranges::count(numbers, std::string_view(name).substr(3)) > 0;
}

bool is_step_on_windows(std::string_view step) {
  const auto is_forbidden = [](char c) {
    return static_cast<unsigned char>(c) < 32 ||
           std::string_view("<>:\"\\|?*").find(c) != std::string_view::npos;
  };
  return !step.ends_with('.') && !step.ends_with(' ') && std::ranges::none_of(step, is_forbidden) &&
         !is_device(step);
}

/// "//server/share" of "//server/share/a" on Windows; "" if the path does not begin with a share.
std::string_view share_of(std::string_view path) {
  if (!is_windows || !path.starts_with("//")) return "";
  const std::size_t end_of_server = path.find('/', 2);
  return end_of_server == path.npos ? path : path.substr(0, path.find('/', end_of_server + 1));
}

}  // namespace

std::filesystem::path path_of(std::string_view text) {
  const auto is_slash = [](char c) { return c == '/' || c == '\\'; };
  std::string path(text);
  if (is_windows && path.size() > 1 && is_slash(path[0]) && is_slash(path[1])) {
    if (path.size() == 2 || is_slash(path[2]) || path[2] == '?' || path[2] == '.')
      throw UsageError("{}: is not a path of a file; give it as C:\\file or \\\\server\\share\\file",
                       printable(text));
    // Windows takes further slashes for one.
    const auto are_slashes = [&](char a, char b) { return is_slash(a) && is_slash(b); };
    path.erase(std::unique(path.begin() + 1, path.end(), are_slashes), path.end());
  }
  return std::u8string(path.begin(), path.end());
}

std::string text_of(const std::filesystem::path& path) {
  // The generic form would also join slashes, and take a share for a directory: here, a path stays as it was given.
  const std::u8string given = path.u8string();
  std::string text(given.begin(), given.end());
  if (is_windows) std::ranges::replace(text, '\\', '/');
  return text;
}

bool is_absolute(const std::filesystem::path& path) {
  return path.is_absolute() || !share_of(text_of(path)).empty();
}

std::filesystem::path absolute_path(const std::filesystem::path& path) {
  if (path.empty() || is_absolute(path)) return path;
  std::error_code gone;
  const std::filesystem::path absolute = std::filesystem::absolute(path, gone);
  if (gone) throw world_error("cannot find the current directory for", text_of(path), gone.value());
  return absolute;
}

std::filesystem::path normal_path(const std::filesystem::path& path) {
  const std::string text = text_of(path);
  const std::string_view share = share_of(text);
  if (share.empty()) return path.lexically_normal();
  const std::filesystem::path below = path_of(std::string_view(text).substr(share.size())).lexically_normal();
  return path_of(std::string(share) + text_of(below));
}

std::filesystem::path relative_path(const std::filesystem::path& path, const std::filesystem::path& folder) {
  if (share_of(text_of(path)) != share_of(text_of(folder))) return {};
  return path.lexically_relative(folder);
}

std::string name_of_path(std::string_view path) { return text_of(path_of(path).filename()); }

std::string extension_of(std::string_view path) { return lower_case(text_of(path_of(path).extension())); }

std::string path_in(std::string_view folder, std::string_view name) {
  const std::filesystem::path path = path_of(name);
  return text_of(is_absolute(path) ? path : path_of(folder) / path);
}

bool is_relative_name(std::string_view name) {
  const auto is_step = [](std::string_view step) { return !step.empty() && step != "." && step != ".."; };
  return name.find('\0') == name.npos && std::ranges::all_of(split(name, '/'), is_step);
}

bool is_name_on_windows(std::string_view name) {
  return is_utf8(name) && std::ranges::all_of(split(name, '/'), is_step_on_windows);
}

bool is_safe_name(std::string_view name) { return is_relative_name(name) && is_name_here(name); }

}  // namespace tagrid
