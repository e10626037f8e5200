#include "io/http/answer.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

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

TEST(Answer, ARightOneIsOfTheLastServerAfterRedirections) {
  std::vector<std::byte> to(4);
  const std::optional<ObjectVersion> none;
  Answer answer(server, 0, to, none);
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
    std::vector<std::byte> to(4);
    const std::optional<ObjectVersion> none;
    Answer answer(server, 0, to, none);
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
    std::vector<std::byte> to(4);
    const std::optional<ObjectVersion> none;
    Answer answer(server, 0, to, none);
    answer.take_header(status);
    answer.take_header("Content-Range: bytes 0-3/9\r\n");
    answer.take_body(bytes_of(4, std::byte{1}));
    EXPECT_EQ(!answer.wrong(), is_right) << status;
  }
  std::vector<std::byte> to(4);
  const std::optional<ObjectVersion> none;
  EXPECT_TRUE(Answer(server, 0, to, none).wrong());
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

}  // namespace
}  // namespace tagrid
