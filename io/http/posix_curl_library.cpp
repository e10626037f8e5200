#include "io/http/curl_library.h"

#include <string>

#include "io/errors/errors.h"
#include "io/system/this_process.h"

namespace tagrid {
#ifdef TAGRID_STATIC

const CurlLibrary& curl_library() {
  throw WorldError(
      "needs libcurl, which this static program cannot load; download the file, or use a tagrid "
      "that is not static");
}

#else
namespace {

void* library() {
  // Debian has the library with OpenSSL, and with GnuTLS under another name.
  for (const char* name : {"libcurl.so.4", "libcurl-gnutls.so.4"})
    if (void* found = load_library(name); found != nullptr) return found;
  throw WorldError("needs libcurl, which is not installed; on Debian: apt-get install libcurl4");
}

template <class Function>
void find(void* in, const char* name, Function& function) {
  function = reinterpret_cast<Function>(function_of_library(in, name));
  if (function == nullptr)
    throw WorldError(std::string("needs libcurl, which is too old here: it has no ") + name);
}

CurlLibrary load() {
  void* in = library();
  CurlLibrary curl = {};
  find(in, "curl_global_init", curl.global_init);
  find(in, "curl_easy_init", curl.easy_init);
  find(in, "curl_easy_cleanup", curl.easy_cleanup);
  find(in, "curl_easy_reset", curl.easy_reset);
  find(in, "curl_easy_setopt", curl.easy_setopt);
  find(in, "curl_easy_getinfo", curl.easy_getinfo);
  find(in, "curl_easy_perform", curl.easy_perform);
  find(in, "curl_easy_strerror", curl.easy_strerror);
  find(in, "curl_slist_append", curl.slist_append);
  find(in, "curl_slist_free_all", curl.slist_free_all);
  if (curl.global_init(CURL_GLOBAL_DEFAULT) != CURLE_OK)
    throw WorldError("needs libcurl, which does not start");
  return curl;
}

}  // namespace

const CurlLibrary& curl_library() {
  static const CurlLibrary curl = load();
  return curl;
}

#endif
}  // namespace tagrid
