#include "io/http/object.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <random>
#include <thread>

#include "io/errors/errors.h"
#include "io/http/answer.h"
#include "io/http/curl_library.h"
#include "io/text/text.h"

namespace tagrid {

Patience patience_with_servers() {
  // A modem has twice this, and eight requests may share it.
  constexpr std::int64_t usual = 30, most = 3600, bytes_a_second = 4096;
  std::int64_t seconds = usual;
  if (const char* given = std::getenv("TAGRID_HTTP_TIMEOUT"); given != nullptr && *given != '\0') {
    const auto number = whole_number_of(given);
    if (!number || *number < 1 || *number > most)
      throw UsageError("TAGRID_HTTP_TIMEOUT: {}: must be a number of seconds from 1 to {}", quoted(given),
                       most);
    seconds = *number;
  }
  return {std::chrono::seconds(seconds),
          static_cast<std::uint64_t>(bytes_a_second * std::min(seconds, usual))};
}

bool Waiting::is_over(std::size_t bytes, std::size_t at_once, Clock::time_point now) {
  most_at_once_ = std::max(most_at_once_, at_once);
  if (!has_begun_ && bytes > 0) {
    has_begun_ = true;
    begin_ = now;
    before_ = 0;
  }
  if (now - begin_ < patience_.seconds) return false;
  if (!has_begun_ || bytes - before_ < patience_.bytes / most_at_once_) return true;
  begin_ = now;
  before_ = bytes;
  most_at_once_ = std::max<std::size_t>(at_once, 1);
  return false;
}

namespace {

constexpr int most_requests = 4;

// 0.25, 0.75 and 2.25 seconds, or what the server wants. Jobs that started together drift apart.
void wait_before_request(int number, int wanted) {
  static thread_local std::minstd_rand random(
      static_cast<unsigned>(std::chrono::steady_clock::now().time_since_epoch().count()));
  double seconds = 0.25;
  for (int i = 1; i < number; ++i) seconds *= 3;
  seconds *= std::uniform_real_distribution(0.75, 1.25)(random);
  std::this_thread::sleep_for(std::chrono::duration<double>(std::max(seconds, static_cast<double>(wanted))));
}

std::size_t take_header(char* line, std::size_t size, std::size_t count, void* answer) {
  return static_cast<Answer*>(answer)->take_header({line, size * count}) ? size * count : 0;
}

std::size_t take_body(char* bytes, std::size_t size, std::size_t count, void* answer) {
  const std::span all(bytes, size * count);
  return static_cast<Answer*>(answer)->take_body(std::as_bytes(all)) ? all.size() : 0;
}

/// What libcurl is asked about now and then while it waits.
struct Watch {
  const Answer& answer;
  const std::atomic<std::size_t>& at_once;
  Waiting waiting;
};

int is_over(void* watch, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  auto& [answer, at_once, waiting] = *static_cast<Watch*>(watch);
  return waiting.is_over(answer.taken(), at_once, Waiting::Clock::now()) ? 1 : 0;
}

/// Of a server that was given up after it had sent `bytes`.
Wrong too_slow(std::size_t bytes, const Patience& patience) {
  const auto seconds = patience.seconds.count();
  if (bytes == 0)
    return {fmt::format("the server does not answer in time: it has sent nothing of the file for {} seconds "
                        "(TAGRID_HTTP_TIMEOUT)",
                        seconds),
            true};
  return {
      fmt::format("the server does not answer in time: it sends less than {} bytes per second; to wait "
                  "longer, set TAGRID_HTTP_TIMEOUT to more than {} seconds",
                  patience.bytes / static_cast<std::uint64_t>(seconds), std::max<std::int64_t>(seconds, 30)),
      true};
}

/// The lines that a request has besides those that libcurl writes.
class RequestLines {
 public:
  explicit RequestLines(const CurlLibrary& curl) : curl_(curl) {}
  ~RequestLines() { curl_.slist_free_all(lines_); }
  RequestLines(const RequestLines&) = delete;
  RequestLines& operator=(const RequestLines&) = delete;
  void add(const std::string& line) {
    curl_slist* longer = curl_.slist_append(lines_, line.c_str());
    if (longer == nullptr) throw std::bad_alloc();
    lines_ = longer;
  }
  const curl_slist* get() const { return lines_; }

 private:
  const CurlLibrary& curl_;
  curl_slist* lines_ = nullptr;
};

void add_lines(RequestLines& lines, const Address& address, const std::optional<ObjectVersion>& version) {
  lines.add("Accept-Encoding: identity");
  // Weak tags (W/"...") never match; what the answer says is compared anyway.
  if (version && version->etag.starts_with('"'))
    lines.add("If-Match: " + version->etag);
  else if (version && !version->modified.empty())
    lines.add("If-Unmodified-Since: " + version->modified);
  if (address.key.empty()) return;
  // Of an empty body.
  lines.add("x-amz-content-sha256: e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  if (!address.token.empty()) lines.add("x-amz-security-token: " + address.token);
}

/// What libcurl says of a failure, without the texts that may contain a part of a wrongly written address.
Wrong failure_of(CURLcode code, const char* details, const CurlLibrary& curl, const Address& address,
                 bool is_redirected) {
  const std::string said = printable(*details != '\0' ? details : curl.easy_strerror(code));
  switch (code) {
    case CURLE_TOO_MANY_REDIRECTS:
      return {"is redirected again and again"};
    case CURLE_UNSUPPORTED_PROTOCOL:
      if (!is_redirected) return {said};  // such as an answer of another protocol
      return {address.url.starts_with("https")
                  ? "is redirected to an address that is not https"
                  : "is redirected to an address that is neither http nor https"};
    case CURLE_URL_MALFORMAT:
      return {"is no valid address; characters such as blanks are written as %20"};
    case CURLE_COULDNT_RESOLVE_HOST:
    case CURLE_COULDNT_RESOLVE_PROXY:
      return {curl.easy_strerror(code), true};
    case CURLE_PARTIAL_FILE:
      return {"the connection ended before all of the answer", true};
    case CURLE_PEER_FAILED_VERIFICATION:
    case CURLE_LOGIN_DENIED:
      return {said};
    default:
      return {said, true};
  }
}

void set_options(const CurlLibrary& curl, CURL* handle, const Address& address, const RequestLines& lines,
                 const Patience& patience) {
  const auto set = [&](CURLoption option, auto value) {
    if (curl.easy_setopt(handle, option, value) != CURLE_OK)
      throw WorldError(address.name + ": needs libcurl, which is too old here: it does not know an option");
  };
  const bool is_secure = address.url.size() > 5 && (address.url[4] == 's' || address.url[4] == 'S');
  set(CURLOPT_URL, address.url.c_str());
  set(CURLOPT_PROTOCOLS_STR, "http,https");
  // What was asked for secretly is not answered openly.
  set(CURLOPT_REDIR_PROTOCOLS_STR, is_secure ? "https" : "http,https");
  set(CURLOPT_FOLLOWLOCATION, address.is_object ? 0L : 1L);
  // Keys are not paths: "a/../b" is the name of an object, and "../x" does not lead to another
  // bucket. The path is signed as it is sent.
  set(CURLOPT_PATH_AS_IS, address.is_object ? 1L : 0L);
  set(CURLOPT_MAXREDIRS, 8L);
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_CONNECTTIMEOUT, static_cast<long>(patience.seconds.count()));
  set(CURLOPT_NOPROGRESS, 0L);
  set(CURLOPT_BUFFERSIZE, 128L << 10);
  set(CURLOPT_USERAGENT, "tagrid");
  set(CURLOPT_HTTPHEADER, lines.get());
  for (const char* name : {"CURL_CA_BUNDLE", "SSL_CERT_FILE"})
    if (const char* file = std::getenv(name); file != nullptr && *file != '\0') {
      set(CURLOPT_CAINFO, file);
      break;
    }
  if (!address.is_object) set(CURLOPT_NETRC, static_cast<long>(CURL_NETRC_OPTIONAL));
  if (address.key.empty()) return;
  set(CURLOPT_AWS_SIGV4, ("aws:amz:" + address.region + ":s3").c_str());
  set(CURLOPT_USERNAME, address.key.c_str());
  set(CURLOPT_PASSWORD, address.secret.c_str());
}

}  // namespace

Object::~Object() {
  for (CURL* handle : idle_) curl_library().easy_cleanup(handle);
}

// One that is still connected, if there is one.
CURL* Object::connection() {
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      CURL* handle = idle_.back();
      idle_.pop_back();
      return handle;
    }
  }
  CURL* handle = curl_library().easy_init();
  if (handle == nullptr) throw std::bad_alloc();
  return handle;
}

std::size_t Object::request(std::uint64_t position, std::span<std::byte> to,
                            std::optional<ObjectVersion>& version) {
  const CurlLibrary& curl = curl_library();
  const Patience patience = patience_with_servers();
  const auto give_back = [this](CURL* handle) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(handle);
  };
  for (int number = 1;; ++number) {
    const std::unique_ptr<CURL, decltype(give_back)> handle(connection(), give_back);
    RequestLines lines(curl);
    add_lines(lines, address_, version);
    curl.easy_reset(handle.get());
    set_options(curl, handle.get(), address_, lines, patience);
    Answer answer(address_, position, to, version);
    Watch watch{answer, at_once_, Waiting(patience, Waiting::Clock::now())};
    char details[CURL_ERROR_SIZE] = "";
    const std::string range = fmt::format("{}-{}", position, position + to.size() - 1);
    curl.easy_setopt(handle.get(), CURLOPT_RANGE, range.c_str());
    curl.easy_setopt(handle.get(), CURLOPT_HEADERFUNCTION, take_header);
    curl.easy_setopt(handle.get(), CURLOPT_HEADERDATA, static_cast<void*>(&answer));
    curl.easy_setopt(handle.get(), CURLOPT_WRITEFUNCTION, take_body);
    curl.easy_setopt(handle.get(), CURLOPT_WRITEDATA, static_cast<void*>(&answer));
    curl.easy_setopt(handle.get(), CURLOPT_XFERINFOFUNCTION, is_over);
    curl.easy_setopt(handle.get(), CURLOPT_XFERINFODATA, static_cast<void*>(&watch));
    curl.easy_setopt(handle.get(), CURLOPT_ERRORBUFFER, static_cast<char*>(details));
    ++at_once_;
    const CURLcode code = curl.easy_perform(handle.get());
    --at_once_;
    curl.easy_setopt(handle.get(), CURLOPT_ERRORBUFFER, static_cast<char*>(nullptr));
    const bool is_late = code == CURLE_OPERATION_TIMEDOUT || code == CURLE_ABORTED_BY_CALLBACK;
    std::optional<Wrong> wrong;
    if (is_late) wrong = too_slow(answer.taken(), patience);
    if (code == CURLE_OK || code == CURLE_WRITE_ERROR) wrong = answer.wrong();
    if (!wrong && code != CURLE_OK) wrong = failure_of(code, details, curl, address_, answer.is_redirected());
    if (!wrong) {
      if (!version) version = answer.version();
      return answer.taken();
    }
    // A server that was never reached is more likely to have another name than to be busy. One that is silent
    // takes long enough each time.
    const bool is_unreachable =
        !version && (code == CURLE_COULDNT_RESOLVE_HOST || code == CURLE_COULDNT_RESOLVE_PROXY ||
                     code == CURLE_COULDNT_CONNECT || code == CURLE_SSL_CONNECT_ERROR);
    const int most = is_late ? 2 : most_requests;
    if (!wrong->again || number >= most || is_unreachable)
      throw WorldError("{}: {}{}", address_.name, wrong->what,
                       number > 1 ? fmt::format(" ({} requests)", number) : "");
    wait_before_request(number, wrong->seconds);
  }
}

std::vector<std::byte> Object::open(std::size_t size) {
  try {
    curl_library();
  } catch (const WorldError& error) {
    throw WorldError(address_.name + ": " + error.what());
  }
  std::vector<std::byte> bytes(size);
  std::optional<ObjectVersion> version;
  bytes.resize(request(0, bytes, version));
  version_ = std::move(version);
  return bytes;
}

void Object::read(std::uint64_t position, std::span<std::byte> to) {
  std::optional<ObjectVersion> version = version_;
  request(position, to, version);
}

}  // namespace tagrid
