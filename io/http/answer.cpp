#include "io/http/answer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "io/text/text.h"

namespace tagrid {
namespace {

std::optional<std::uint64_t> size_in(std::string_view text) {
  const auto number = whole_number_of(text);
  return number && *number >= 0 ? std::optional(static_cast<std::uint64_t>(*number)) : std::nullopt;
}

/// Of all answers to a request: one, or the last one after redirections.
constexpr std::size_t most_header_bytes = std::size_t{256} << 10;

/// A value of a header for a message.
std::string shown(std::string_view value) { return quoted(value.empty() ? "nothing" : value); }

/// The code that object stores give in the text of an error: "AccessDenied".
std::string code_in(std::string_view text) {
  const std::size_t begin = text.find("<Code>");
  if (begin == text.npos) return "";
  const std::string_view code = text.substr(begin + 6, text.find('<', begin + 6) - begin - 6);
  const bool is_word = std::ranges::all_of(
      code, [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || is_digit(c); });
  return is_word && code.size() <= 60 ? std::string(code) : "";
}

const char* words_of_status(int status) {
  switch (status) {
    case 401:
      return "name and password are wanted; ~/.netrc can have them";
    case 403:
      return "not allowed";
    case 404:
      return "not found";
    case 407:
      return "the proxy wants a name and a password";
    case 429:
      return "too many requests";
    case 503:
      return "busy";
    default:
      return "";
  }
}

}  // namespace

std::optional<ContentRange> content_range_of(std::string_view text) {
  constexpr std::string_view unit = "bytes ";
  if (lower_case(text.substr(0, unit.size())) != unit) return std::nullopt;
  text = trimmed(text.substr(unit.size()));
  const std::size_t slash = text.find('/');
  if (slash == text.npos) return std::nullopt;
  const std::string_view places = text.substr(0, slash), size = text.substr(slash + 1);
  ContentRange range;
  if (places != "*") {
    const std::size_t dash = places.find('-');
    if (dash == places.npos) return std::nullopt;
    range.first = size_in(places.substr(0, dash));
    range.last = size_in(places.substr(dash + 1));
    if (!range.first || !range.last || *range.first > *range.last) return std::nullopt;
  }
  if (size == "*") return range;
  range.size = size_in(size);
  if (!range.size || (range.last && *range.last >= *range.size)) return std::nullopt;
  return range;
}

bool Answer::take_header(std::string_view line) {
  header_bytes_ += line.size();
  if (header_bytes_ > most_header_bytes) return false;
  line = trimmed(line.substr(0, line.find_last_not_of("\r\n") + 1));
  if (line.starts_with("HTTP/")) {
    range_.reset();
    wrong_.reset();
    are_headers_checked_ = false;
    expected_ = taken_ = 0;
    etag_ = modified_ = encoding_ = type_ = region_ = text_ = "";
    seconds_ = 0;
    const std::size_t blank = line.find(' ');
    const auto status =
        blank == line.npos ? std::nullopt : whole_number_of(trimmed(line.substr(blank)).substr(0, 3));
    status_ = static_cast<int>(status.value_or(0));
    return true;
  }
  // What follows the body, in a trailer, was not checked.
  if (are_headers_checked_) return true;
  const std::size_t colon = line.find(':');
  if (colon == line.npos) return true;
  const std::string name = lower_case(line.substr(0, colon));
  const std::string_view value = trimmed(line.substr(colon + 1));
  constexpr std::size_t longest = 1000;
  if (value.size() > longest) return true;
  if (name == "content-range") range_ = content_range_of(value).value_or(ContentRange{});
  if (name == "etag") etag_ = value;
  if (name == "last-modified") modified_ = value;
  if (name == "content-encoding") encoding_ = lower_case(value);
  if (name == "content-type") type_ = lower_case(value.substr(0, value.find(';')));
  if (name == "x-amz-bucket-region") region_ = value;
  if (name == "retry-after")
    seconds_ = static_cast<int>(std::clamp<std::int64_t>(whole_number_of(value).value_or(0), 0, 30));
  return true;
}

Wrong Answer::wrong_status() const {
  if (status_ == 200)
    return {
        type_ == "text/html"
            ? "the server answers with a page (text/html), not with a file"
            : "the server does not give parts of the file (it answers 200 to a range); download the file"};
  if (status_ == 412) return {"was changed while it was being read"};
  if (status_ == 416)
    return {version_ ? "became shorter while it was being read, or the server is wrong about its size"
                     : "has no bytes, or the server does not give parts of it (it answers 416 to a range)"};
  if (!region_.empty() && (status_ == 301 || status_ == 307 || status_ == 400))
    return {fmt::format("its bucket is in the region {}; set AWS_REGION", quoted(region_))};
  const std::string code = code_in(text_), words = code.empty() ? words_of_status(status_) : code;
  std::string what = fmt::format("the server answers {}{}", status_, words.empty() ? "" : " (" + words + ")");
  if (address_.is_object && address_.key.empty() && (status_ == 401 || status_ == 403))
    what += "; AWS_ACCESS_KEY_ID is not set";
  const bool again = status_ == 408 || status_ == 425 || status_ == 429 || status_ == 500 || status_ == 502 ||
                     status_ == 503 || status_ == 504;
  return {std::move(what), again, seconds_};
}

std::optional<Wrong> Answer::wrong_headers() {
  if (is_empty_file()) return std::nullopt;
  if (status_ != 206) return wrong_status();
  if (!encoding_.empty() && encoding_ != "identity")
    return Wrong{fmt::format(
        "the server compresses what it sends (Content-Encoding: {}), so that its ranges are not those of "
        "the file; it must not do so with .tag files",
        shown(encoding_))};
  if (!range_ || !range_->first)
    return Wrong{"the server does not say which part of the file it sends (no right Content-Range)"};
  if (!range_->size) return Wrong{"the server does not say how long the file is"};
  if (version_) {
    const bool is_other = range_->size != version_->size ||
                          (!etag_.empty() && !version_->etag.empty() && etag_ != version_->etag) ||
                          (version_->etag.empty() && !modified_.empty() && modified_ != version_->modified);
    if (is_other) return Wrong{"was changed while it was being read"};
  }
  const std::uint64_t most = position_ + to_.size(), end = std::min(most, *range_->size);
  if (*range_->first != position_ || *range_->last >= most)
    return Wrong{fmt::format("the server sends bytes {} to {} instead of {} to {}", *range_->first,
                             *range_->last, position_, end - 1)};
  if (*range_->last + 1 < end) return Wrong{"the server sends less than was asked for", true};
  expected_ = static_cast<std::size_t>(end - position_);
  return std::nullopt;
}

bool Answer::take_body(std::span<const std::byte> bytes) {
  if (!are_headers_checked_) {
    are_headers_checked_ = true;
    wrong_ = wrong_headers();
  }
  if (wrong_) {
    // The text of an error has its code. Of anything else, the rest is of no use.
    constexpr std::size_t enough = 4096;
    if (status_ < 300 || text_.size() >= enough) return false;
    text_.append(reinterpret_cast<const char*>(bytes.data()), std::min(bytes.size(), enough - text_.size()));
    return true;
  }
  if (is_empty_file()) return true;
  if (bytes.size() > expected_ - taken_) {
    wrong_ = Wrong{"the server sends more than it announces"};
    return false;
  }
  std::memcpy(to_.data() + taken_, bytes.data(), bytes.size());
  taken_ += bytes.size();
  return true;
}

std::optional<Wrong> Answer::wrong() {
  if (header_bytes_ > most_header_bytes)
    return Wrong{fmt::format("the server sends more than {} KiB of headers", most_header_bytes >> 10)};
  if (status_ == 0) return Wrong{"the server answers with something else than HTTP"};
  if (!are_headers_checked_ || (wrong_ && status_ >= 300)) wrong_ = wrong_headers();
  are_headers_checked_ = true;
  if (!wrong_ && taken_ < expected_)
    return Wrong{fmt::format("the answer ends after {} of {} bytes", taken_, expected_), true};
  return wrong_;
}

}  // namespace tagrid
