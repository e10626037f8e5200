#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "io/errors/errors.h"
#include "io/http/address.h"
#include "io/http/answer.h"
#include "io/http/object.h"
#include "io/text/addresses.h"

namespace tagrid {
namespace {

const Address server = {.name = "http://host/a.tag", .url = "http://host/a.tag"};

std::vector<std::byte> bytes_of(std::size_t size, std::byte value) {
  return std::vector<std::byte>(size, value);
}

RC_GTEST_PROP(Answer, WritesOnlyWhereItShouldAndIsRightOnlyIfAllOfItCame, ()) {
  // Lines that servers send, in any order and number, with numbers that are near the right ones.
  const auto number = [] { return std::to_string(*rc::gen::inRange(0, 40)); };
  constexpr std::size_t position = 10, size = 20, margin = 64;
  std::vector<std::byte> memory = bytes_of(size + 2 * margin, std::byte{0xAA});
  const std::optional<ObjectVersion> version =
      *rc::gen::arbitrary<bool>() ? std::optional(ObjectVersion{30, "\"a\"", ""}) : std::nullopt;
  Answer answer(server, position, std::span(memory).subspan(margin, size), version);
  const bool is_near = *rc::gen::inRange(0, 3) > 0;
  answer.take_header(is_near ? "HTTP/1.1 206 Partial Content\r\n"
                             : "HTTP/1.1 " + *rc::gen::element<std::string>("200", "206", "302", "416", "5") +
                                   "\r\n");
  if (is_near && *rc::gen::inRange(0, 3) > 0)
    answer.take_header("Content-Range: bytes 10-29/" + std::string(version ? "30" : number()) + "\r\n");
  for (int lines = *rc::gen::inRange(0, 4); lines > 0; --lines)
    answer.take_header(
        *rc::gen::element<std::string>("Content-Range: bytes " + number() + "-" + number() + "/" + number(),
                                       "content-range: bytes */0", "Content-Encoding: gzip", "ETag: \"a\"",
                                       "ETag: \"b\"", "", ":", "Retry-After: 99999999999", "HTTP/2 206"));
  std::size_t sent = 0;
  for (int parts = *rc::gen::inRange(0, 4); parts > 0; --parts) {
    const auto part = *rc::gen::inRange<std::size_t>(1, 21);
    if (!answer.take_body(bytes_of(part, std::byte{1}))) break;
    sent += part;
  }
  const auto wrong = answer.wrong();
  RC_ASSERT(
      std::ranges::all_of(std::span(memory).first(margin), [](std::byte b) { return b == std::byte{0xAA}; }));
  RC_ASSERT(
      std::ranges::all_of(std::span(memory).last(margin), [](std::byte b) { return b == std::byte{0xAA}; }));
  if (wrong) return;
  if (answer.taken() == 0) return RC_ASSERT(!version);  // an empty file
  RC_ASSERT(sent == answer.taken());
  if (version) RC_ASSERT(sent == size);
  RC_ASSERT(sent == std::min<std::uint64_t>(position + size, answer.version().size) - position);
}

/// An answer of the first four bytes of an object of which nothing is known.
struct FirstBytes {
  std::vector<std::byte> to = std::vector<std::byte>(4);
  const std::optional<ObjectVersion> none;
  Answer answer{server, 0, to, none};
};

TEST(Answer, ARightOneIsOfTheLastServerAfterRedirections) {
  FirstBytes first;
  Answer& answer = first.answer;
  for (const char* line :
       {"HTTP/1.1 302 Found\r\n", "ETag: \"old\"\r\n", "Content-Encoding: gzip\r\n", "\r\n", "HTTP/2 206\r\n",
        "etag: \"new\"\r\n", "Last-Modified: now\r\n", "content-range: bytes 0-3/9\r\n", "\r\n"})
    answer.take_header(line);
  EXPECT_TRUE(answer.take_body(bytes_of(4, std::byte{1})));
  EXPECT_FALSE(answer.wrong());
  EXPECT_EQ(answer.version().etag, "\"new\"");
  EXPECT_EQ(answer.version().modified, "now");
  EXPECT_EQ(answer.version().size, 9u);
}

TEST(Answer, NothingAfterTheBodyChangesWhatWasChecked) {
  for (const char* trailer :
       {"Content-Range: x\r\n", "Content-Range: bytes 0-0/1\r\n", "ETag: \"new\"\r\n"}) {
    FirstBytes first;
    Answer& answer = first.answer;
    for (const char* line : {"HTTP/1.1 206 Partial Content\r\n", "ETag: \"old\"\r\n",
                             "Content-Range: bytes 0-3/9\r\n", "Transfer-Encoding: chunked\r\n", "\r\n"})
      answer.take_header(line);
    EXPECT_TRUE(answer.take_body(bytes_of(4, std::byte{1})));
    answer.take_header(trailer);
    EXPECT_FALSE(answer.wrong()) << trailer;
    EXPECT_EQ(answer.version().size, 9u) << trailer;
    EXPECT_EQ(answer.version().etag, "\"old\"");
  }
}

TEST(Answer, AStatusMayFollowSeveralBlanksAndMustBeThere) {
  for (const auto& [status, is_right] :
       {std::pair("HTTP/1.1  206 x", true), {"HTTP/1.1 x", false}, {"HTTP/1.1", false}}) {
    FirstBytes first;
    Answer& answer = first.answer;
    answer.take_header(status);
    answer.take_header("Content-Range: bytes 0-3/9\r\n");
    answer.take_body(bytes_of(4, std::byte{1}));
    EXPECT_EQ(!answer.wrong(), is_right) << status;
  }
  EXPECT_TRUE(FirstBytes().answer.wrong());
}

TEST(Answer, OnlyWhatPassesIsAskedForAgain) {
  std::vector<std::byte> to(4);
  const std::optional<ObjectVersion> none;
  for (const auto& [status, again] : {std::pair(503, true),
                                      {500, true},
                                      {429, true},
                                      {408, true},
                                      {404, false},
                                      {403, false},
                                      {412, false},
                                      {200, false},
                                      {501, false}}) {
    Answer answer(server, 0, to, none);
    answer.take_header("HTTP/1.1 " + std::to_string(status) + " x\r\n");
    answer.take_header("Retry-After: 7\r\n");
    ASSERT_TRUE(answer.wrong());
    EXPECT_EQ(answer.wrong()->again, again) << status;
    EXPECT_EQ(answer.wrong()->seconds, again ? 7 : answer.wrong()->seconds);
  }
}

TEST(Address, OnlyThreeSchemesAreAddresses) {
  for (const char* text : {"http://a/b", "https://a/b", "HTTPS://a", "s3://bucket/key"})
    EXPECT_TRUE(is_address(text)) << text;
  for (const char* text :
       {"a.tag", "-", "", "http:/a", "http:", "./http://a", "file:///a", "ftp://a/b", "s3:", "dir/http://a"})
    EXPECT_FALSE(is_address(text)) << text;
}

TEST(Address, OtherSchemesAreSeen) {
  for (const char* text : {"gs://a/b", "az://a", "http:/a", "FILE:///a", "git+ssh://a", "s3://a/b", "gs:/a"})
    EXPECT_TRUE(has_scheme(text)) << text;
  for (const char* text :
       {"", ":/", "://a", "a:b", "a", "./gs://a", "d/gs://a", "1a:/b", "a b:/c", "C:/scans"})
    EXPECT_FALSE(has_scheme(text)) << text;
}

TEST(Address, MessagesHaveNoSecrets) {
  const std::pair<const char*, const char*> cases[] = {
      {"https://host/a.tag", "https://host/a.tag"},
      {"HTTPS://host:8080/a%20b.tag", "https://host:8080/a%20b.tag"},
      {"https://user:secret@host/a.tag", "https://host/a.tag"},
      {"https://user:s@cret@host/a.tag", "https://host/a.tag"},
      {"https://user@host/a@b.tag", "https://host/a@b.tag"},
      {"https://host/a@b.tag", "https://host/a@b.tag"},
      {"https://host:80/a@b.tag", "https://host:80/a@b.tag"},
      {"https://user:se/cret@host/a.tag", "https://host/a.tag"},
      {"https://host/a.tag?X-Amz-Signature=abc", "https://host/a.tag"},
      {"https://host?key=abc", "https://host"},
      {"https://user:a?b@host/x", "https://host/x"},
      {"https://host:80/a?mail=a@b", "https://host:80/a"},
      {"https://[::1]:80/a", "https://[::1]:80/a"},
      {"https://[::1]/a@b", "https://[::1]/a@b"},
      {"https://host/a.tag#part", "https://host/a.tag"},
      {"s3://bucket/a@b?c", "s3://bucket/a@b?c"},
      {"s3://key:secret@bucket/k", "s3://bucket/k"},
      {"s3://key:sec/ret@bucket/k", "s3://bucket/k"},
      {"s3://bucket/k?X-Amz-Signature=abc", "s3://bucket/k"},
      {"gs://bucket/x.tag?X-Goog-Signature=SECRET", "gs://bucket/x.tag"},
      {"ftp://ann:PW@host/x.tag", "ftp://host/x.tag"},
      {"sftp://ann:P/W@host/x.tag", "sftp://host/x.tag"},
      {"AZ://container/x.tag?sig=SECRET", "az://container/x.tag"},
      {"http:/ann:pw@host/x.tag?s", "http:/host/x.tag"},
      {"git+ssh://ann@host/x", "git+ssh://host/x"},
      {"file:///home/a@b.tag", "file:///home/a@b.tag"},
      {"file:///", "file:///"},
      {"dir/gs://a?b", "dir/gs://a?b"},
      {"2x:/a?b", "2x:/a?b"},
      {"a:b?c", "a:b?c"},
      {"scan@2x?.tag", "scan@2x?.tag"}};
  for (const auto& [text, shown] : cases) EXPECT_EQ(shown_address(text), shown);
}

class ObjectAddress : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "AWS_SESSION_TOKEN", "AWS_REGION",
                             "AWS_DEFAULT_REGION", "AWS_ENDPOINT_URL", "AWS_ENDPOINT_URL_S3"})
      unsetenv(name);
  }
};

TEST_F(ObjectAddress, BucketsAreHostsWhereTheirNamesFitACertificate) {
  EXPECT_EQ(address_of("s3://bucket/a/b c.tag").url, "https://bucket.s3.us-east-1.amazonaws.com/a/b%20c.tag");
  setenv("AWS_DEFAULT_REGION", "eu-west-1", 1);
  EXPECT_EQ(address_of("s3://my.bucket/k").url, "https://s3.eu-west-1.amazonaws.com/my.bucket/k");
  setenv("AWS_REGION", "eu-west-2", 1);
  EXPECT_EQ(address_of("s3://bucket/k").region, "eu-west-2");
}

// Keys are no paths: the server is asked for what they are.
TEST_F(ObjectAddress, KeysKeepTheirBytes) {
  setenv("AWS_ENDPOINT_URL", "http://minio", 1);
  const std::pair<const char*, const char*> cases[] = {{"a/../b", "a/../b"},
                                                       {"../other/x", "../other/x"},
                                                       {"./a", "./a"},
                                                       {"a//b", "a//b"},
                                                       {"/a", "/a"},
                                                       {"%2e%2e/a", "%252e%252e/a"},
                                                       {"a?b=c#d", "a%3Fb%3Dc%23d"},
                                                       {"100%", "100%25"},
                                                       {"a b", "a%20b"},
                                                       {"\xE2\x82\xAC", "%E2%82%AC"},
                                                       {"a/", "a/"},
                                                       {"~-_.", "~-_."}};
  for (const auto& [key, path] : cases)
    EXPECT_EQ(address_of(std::string("s3://bucket/") + key).url, std::string("http://minio/bucket/") + path);
}

TEST_F(ObjectAddress, AnotherServerHasBucketsInItsPaths) {
  setenv("AWS_ENDPOINT_URL", "http://minio:9000/", 1);
  EXPECT_EQ(address_of("s3://bucket/\xC3\xA4+b").url, "http://minio:9000/bucket/%C3%A4%2Bb");
  setenv("AWS_ENDPOINT_URL_S3", "https://s3.example/x", 1);
  EXPECT_EQ(address_of("s3://bucket/k").url, "https://s3.example/x/bucket/k");
  for (const char* wrong : {"minio:9000", "file:///", "s3://a/b", "http://minio/?x=", "http://minio/#"}) {
    setenv("AWS_ENDPOINT_URL_S3", wrong, 1);
    EXPECT_THROW(address_of("s3://bucket/k"), UsageError);
  }
}

TEST_F(ObjectAddress, WhatIsNoBucketOrHasHalfOfTheKeysIsRefused) {
  for (const char* text : {"s3://", "s3://bucket", "s3://bucket/", "s3://a/k", "s3://user:x@host/k",
                           "s3:///k", "s3://../host/k", "s3://.../k", "s3://a..b/k", "s3://.ab/k",
                           "s3://ab-/k", "s3://a%2e/k", "s3://host/k?X-Amz-Signature=x"})
    EXPECT_THROW(address_of(text), UsageError) << text;
  setenv("AWS_ACCESS_KEY_ID", "key", 1);
  EXPECT_THROW(address_of("s3://bucket/k"), UsageError);
}

TEST(ContentRange, IsReadExactly) {
  const auto range = content_range_of("bytes 5-9/20");
  ASSERT_TRUE(range);
  EXPECT_EQ(range->first, 5u);
  EXPECT_EQ(range->last, 9u);
  EXPECT_EQ(range->size, 20u);
  EXPECT_FALSE(content_range_of("bytes 5-9/*")->size);
  EXPECT_FALSE(content_range_of("Bytes */20")->first);
  EXPECT_EQ(content_range_of("bytes */20")->size, 20u);
  for (const char* wrong :
       {"", "bytes", "bytes ", "bytes 5-9", "bytes 9-5/20", "bytes 5-20/20", "bytes -1-9/20", "bytes 5-/20",
        "bytes 5-9/x", "bytes 5-9/-1", "items 5-9/20", "bytes 5-9/99999999999999999999", "bytes 0x5-9/20"})
    EXPECT_FALSE(content_range_of(wrong)) << wrong;
}

using namespace std::chrono_literals;

const Waiting::Clock::time_point start{};

/// The second in which a server is given up that begins after `delay` and then sends `rate` bytes a second in steps of
/// `step`; -1 if it may send for an hour.
int given_up(const Patience& patience, int delay, double rate, int step = 1, std::size_t at_once = 1) {
  Waiting waiting(patience, start);
  for (int second = 0; second < 3600; ++second) {
    const int sent = second < delay ? 0 : (second - delay) / step * step;
    if (waiting.is_over(static_cast<std::size_t>(rate * sent), at_once, start + std::chrono::seconds(second)))
      return second;
  }
  return -1;
}

TEST(Waiting, WhoSendsTooLittleIsGivenUp) {
  unsetenv("TAGRID_HTTP_TIMEOUT");
  const Patience usual = patience_with_servers();
  EXPECT_EQ(given_up(usual, 3600, 0), 30);
  EXPECT_EQ(given_up(usual, 20, 120), 51);
  EXPECT_EQ(given_up(usual, 0, 3900), 31);
  // Little now and then.
  EXPECT_EQ(given_up(usual, 0, 120, 29), 59);
  // What came fast at first does not count later.
  Waiting waiting(usual, start);
  int end = 0;
  while (end < 100 && !waiting.is_over(2'000'000 + 100 * static_cast<std::size_t>(end), 1,
                                       start + std::chrono::seconds(end)))
    ++end;
  EXPECT_EQ(end, 60);
}

TEST(Waiting, SlowLinksAreNot) {
  const Patience usual = patience_with_servers();
  EXPECT_EQ(given_up(usual, 0, 16384), -1);
  EXPECT_EQ(given_up(usual, 29, 4200), -1);
  // Bursts, and eight requests that share a modem.
  EXPECT_EQ(given_up(usual, 0, 16384, 10), -1);
  EXPECT_EQ(given_up(usual, 0, 16384 / 8.0, 1, 8), -1);
}

TEST(Waiting, MoreSecondsAllowASlowerServer) {
  setenv("TAGRID_HTTP_TIMEOUT", "4", 1);
  EXPECT_EQ(given_up(patience_with_servers(), 0, 120), 5);
  EXPECT_EQ(given_up(patience_with_servers(), 0, 16384), -1);
  setenv("TAGRID_HTTP_TIMEOUT", "300", 1);
  EXPECT_EQ(given_up(patience_with_servers(), 0, 500), -1);
  EXPECT_EQ(given_up(patience_with_servers(), 0, 100), 301);
  for (const char* wrong : {"0", "-1", "x", "1.5", "3601"}) {
    setenv("TAGRID_HTTP_TIMEOUT", wrong, 1);
    EXPECT_THROW(patience_with_servers(), UsageError);
  }
  unsetenv("TAGRID_HTTP_TIMEOUT");
}

TEST(Answer, HeadersHaveAnEnd) {
  std::byte bytes[10];
  const std::optional<ObjectVersion> version;
  const Address address;
  Answer answer(address, 0, bytes, version);
  bool goes_on = true;
  for (int line = 0; line < 100'000 && goes_on; ++line)
    goes_on = answer.take_header(line % 1000 == 0 ? "HTTP/1.1 302 Found\r\n"
                                                  : "X: " + std::string(100, 'x') + "\r\n");
  EXPECT_FALSE(goes_on);
  ASSERT_TRUE(answer.wrong());
  EXPECT_NE(answer.wrong()->what.find("headers"), std::string::npos);
}

}  // namespace
}  // namespace tagrid
