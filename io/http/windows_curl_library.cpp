#include "io/errors/errors.h"
#include "io/http/curl_library.h"

namespace tagrid {
namespace {

CurlLibrary start() {
  if (curl_global_init(CURL_GLOBAL_DEFAULT) != CURLE_OK)
    throw WorldError("needs libcurl, which does not start");
  return {curl_global_init,  curl_easy_init,    curl_easy_cleanup,  curl_easy_reset,   curl_easy_setopt,
          curl_easy_getinfo, curl_easy_perform, curl_easy_strerror, curl_slist_append, curl_slist_free_all};
}

}  // namespace

// Nobody can be expected to have libcurl on Windows, so it is a part of the program.
const CurlLibrary& curl_library() {
  static const CurlLibrary curl = start();
  return curl;
}

}  // namespace tagrid
