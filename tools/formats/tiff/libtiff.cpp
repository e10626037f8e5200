#include "tools/formats/tiff/libtiff.h"

#include <array>
#include <cstdarg>
#include <cstdio>
#include <string_view>

namespace tagrid {

std::string last_reason, last_warning;
TiffRemarks of_tags;

namespace {

std::string text_of(const char* format, va_list values) {
  std::array<char, 500> text = {};
  std::vsnprintf(text.data(), text.size(), format, values);
  return text.data();
}

void keep_reason(const char* /*where*/, const char* format, va_list values) {
  last_reason = text_of(format, values);
}

/// Of warnings while samples are read, those that speak of how they are stored, not of what is missing.
bool is_harmless(std::string_view warning) {
  return warning.starts_with("Old-style LZW codes") ||
         warning.starts_with("JPEG strip size exceeds expected dimensions");
}

void keep_warning(const char* /*where*/, const char* format, va_list values) {
  const std::string warning = text_of(format, values);
  if (!is_harmless(warning)) last_warning = warning;
  if (warning.find("calculating from imagelength") != warning.npos)
    of_tags.warn(
        "its StripByteCounts are absent, or not what its samples need; samples are read from where "
        "they begin");
  else if (warning.find("ignor") != warning.npos)
    of_tags.miss("a tag of it cannot be read (" + warning + ")");
}

}  // namespace

void listen_to_libtiff() {
  TIFFSetErrorHandler(keep_reason);
  TIFFSetWarningHandler(keep_warning);  // mostly of tags that it does not know
}

}  // namespace tagrid
