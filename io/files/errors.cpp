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

}  // namespace

WorldError world_error(std::string_view what, std::string_view path, int error_number) {
  return WorldError(fmt::format("{}: {}: {}{}", path, what, std::generic_category().message(error_number),
                                advice(error_number)));
}

}  // namespace tagrid
