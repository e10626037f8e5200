// One place decides what an exception means, and the meaning survives being sent.
#include "io/errors/errors.h"

#include <new>
#include <stdexcept>
#include <system_error>

#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

template <class Thrown>
SortedError sorted(const Thrown& thrown) {
  return sorted_error(std::make_exception_ptr(thrown));
}

TEST(ErrorKinds, EveryExceptionHasOne) {
  EXPECT_EQ(sorted(UsageError("x")), (SortedError{ErrorKind::usage, "x"}));
  EXPECT_EQ(sorted(BrokenInput("x")), (SortedError{ErrorKind::broken_input, "x"}));
  EXPECT_EQ(sorted(ClosedPipe("x")), (SortedError{ErrorKind::closed_pipe, "x"}));
  EXPECT_EQ(sorted(WorldError("x")), (SortedError{ErrorKind::world, "x"}));
  EXPECT_EQ(sorted(std::logic_error("x")), (SortedError{ErrorKind::bug, "x"}));
  EXPECT_EQ(sorted(std::out_of_range("x")), (SortedError{ErrorKind::bug, "x"}));
  EXPECT_EQ(sorted(std::system_error(std::make_error_code(std::errc::io_error))).kind, ErrorKind::world);
  EXPECT_EQ(sorted(std::bad_alloc()).kind, ErrorKind::memory);
  EXPECT_EQ(sorted(std::bad_array_new_length()).kind, ErrorKind::memory);
  EXPECT_EQ(sorted(std::length_error("x")).kind, ErrorKind::memory);
  EXPECT_EQ(sorted(42).kind, ErrorKind::bug);
}

TEST(ErrorKinds, ThatThereAreNoMoreThreadsIsTheWorldsFaultAndSaysWhatHelps) {
  const SortedError error =
      sorted(std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again)));
  EXPECT_EQ(error.kind, ErrorKind::world);
  EXPECT_TRUE(has(error.message, "cannot create more threads"));
  EXPECT_TRUE(has(error.message, "ulimit -u"));
}

TEST(ErrorKinds, WhatIsThrownAgainIsOfTheSameKind) {
  for (const ErrorKind kind : {ErrorKind::usage, ErrorKind::broken_input, ErrorKind::closed_pipe,
                               ErrorKind::world, ErrorKind::memory, ErrorKind::bug}) {
    try {
      throw_sorted({kind, "x", {}});
    } catch (...) {
      const SortedError again = sorted_error(std::current_exception());
      EXPECT_EQ(again.kind, kind);
      EXPECT_TRUE(again.message == "x" || kind == ErrorKind::memory) << again.message;
    }
  }
}

TEST(ErrorKinds, CodeAndValuesAreThrownAgain) {
  const SortedError refused = sorted(UsageError(
      Sentence("{} {}: is a {}", Setting{"level", "the level"}, 0.5, "fraction"), Problem::output_exists));
  EXPECT_EQ(refused.message, "the level 0.5: is a fraction");
  EXPECT_EQ(refused.detail.with_options, "--level 0.5: is a fraction");
  const SortedError broken = sorted(BrokenInput("a.gz: is compressed", Problem::compressed_file));
  const SortedError world = sorted(WorldError("x", Problem::no_known_format));
  for (const SortedError& error : {refused, broken, world}) {
    EXPECT_NE(error.detail.problem, Problem::none);
    try {
      throw_sorted(error);
    } catch (...) {
      EXPECT_EQ(sorted_error(std::current_exception()), error);
    }
  }
}

TEST(ErrorKinds, ALimitOnMemoryIsThrownAgainAsOneWithItsNumbers) {
  try {
    throw_sorted(sorted(MemoryLimit("encoding", {.needed = 3'000'000'001, .allowed = 7, .with_spool = 5})));
  } catch (const MemoryLimit& again) {
    EXPECT_EQ(again.needs().needed, 3'000'000'001U);
    EXPECT_EQ(again.needs().with_spool, 5U);
  }
  try {
    throw_sorted(sorted(MemoryLimit("encoding", {.needed = 8, .allowed = 7})));
  } catch (const MemoryLimit& again) {
    EXPECT_FALSE(again.needs().with_spool);
  }
}

TEST(ErrorKinds, AnErrorHasTheOptionsOfASentenceInItsSentence) {
  const Setting level{"level", "the level"};
  const UsageError error("a.tag: {}; give {} {}", Sentence("{} is {}", level, 7), level, 3);
  EXPECT_STREQ(error.what(), "a.tag: the level is 7; give the level 3");
  EXPECT_EQ(error.detail().with_options, "a.tag: --level is 7; give --level 3");
  EXPECT_EQ(UsageError("{} is {}", "it", 7).detail().with_options, std::nullopt);
}

TEST(ErrorKinds, TextInASentenceIsTakenAsItIs) {
  EXPECT_EQ(Sentence("{}: is no {}", "a{0}{b.raw", "{}").text, "a{0}{b.raw: is no {}");
}

}  // namespace
}  // namespace tagrid
