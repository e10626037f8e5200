#include "io/files/errors.h"

#include <fmt/format.h>

#include <cerrno>
#include <system_error>

namespace tagrid {
namespace {

std::string_view advice(int error_number) {
  switch (error_number) {
    case ENOENT:
    case ENOTDIR:
      return "; check the name and that its folder exists";
    case EACCES:
    case EPERM:
    case EROFS:
      return "; check the permissions of the file and its folder";
    case ENOSPC:
    case EDQUOT:
      return "; free some space or choose another folder";
    case EMFILE:
    case ENFILE:
      return "; raise the limit of open files (ulimit -n)";
    case ENAMETOOLONG:
      return "; choose a shorter name";
    default:
      return "";
  }
}

constexpr std::uint64_t mebibyte = std::uint64_t{1} << 20;

std::uint64_t mebibytes(std::uint64_t bytes) { return (bytes + mebibyte - 1) / mebibyte; }

std::string text(const std::string& work, std::uint64_t allowed, std::uint64_t needed,
                 std::optional<std::uint64_t> needed_with_spool) {
  const std::string spool = needed_with_spool
                                ? fmt::format(", or --spool DIR, a folder for the samples, and -M {}M",
                                              mebibytes(*needed_with_spool))
                                : "";
  const std::string limit =
      allowed < mebibyte ? fmt::format("{} B", allowed) : fmt::format("{} MiB", allowed / mebibyte);
  return fmt::format("{} needs at least {} MiB of memory, and {} are allowed: give -M {}M{}", work,
                     mebibytes(needed), limit, mebibytes(needed), spool);
}

}  // namespace

WorldError world_error(std::string_view what, std::string_view path, int error_number) {
  return WorldError(fmt::format("{}: {}: {}{}", path, what, std::generic_category().message(error_number),
                                advice(error_number)));
}

MemoryLimit::MemoryLimit(const std::string& work, std::uint64_t allowed, std::uint64_t needed,
                         std::optional<std::uint64_t> needed_with_spool)
    : UsageError(text(work, allowed, needed, needed_with_spool)),
      needed_(needed),
      needed_with_spool_(needed_with_spool) {}

}  // namespace tagrid
