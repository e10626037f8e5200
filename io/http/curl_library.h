// libcurl, which is loaded when the first address is opened: a program that reads files starts without it.
#pragma once

#define CURL_DISABLE_TYPECHECK
#include <curl/curl.h>

namespace tagrid {

/// The functions of libcurl that are used, by their names there without "curl_".
struct CurlLibrary {
  decltype(&curl_global_init) global_init;
  decltype(&curl_easy_init) easy_init;
  decltype(&curl_easy_cleanup) easy_cleanup;
  decltype(&curl_easy_reset) easy_reset;
  decltype(&curl_easy_setopt) easy_setopt;
  decltype(&curl_easy_getinfo) easy_getinfo;
  decltype(&curl_easy_perform) easy_perform;
  decltype(&curl_easy_strerror) easy_strerror;
  decltype(&curl_slist_append) slist_append;
  decltype(&curl_slist_free_all) slist_free_all;
};

/// Loads the library when it is first called. Throws WorldError, whose sentence goes on after a name: "needs
/// libcurl, which is not installed ...".
const CurlLibrary& curl_library();

/// The most memory that the library takes, with the libraries that it needs and as many connections as
/// ReadAhead uses. 12 MiB were measured with OpenSSL.
inline constexpr unsigned long long memory_of_curl = 18ULL << 20;

}  // namespace tagrid
