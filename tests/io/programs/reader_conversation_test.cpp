// Readers that say what they may, and readers that do not.

#include "io/programs/reader_conversation.h"
#include "io/metadata/text.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include "io/errors/errors.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* hello_line = R"({"tagrid-reader": 1, "name": "test", "version": "1"})";

class ReaderConversationTest : public TemporaryFolder {
 protected:
  /// A program that says these lines: the first one at once, the others one after each request.
  std::string program(const std::vector<std::string>& lines) {
    std::string script = "#!/bin/sh\n";
    for (std::size_t i = 0; i < lines.size(); ++i)
      script += (i > 0 ? "read -r line\n" : "") + ("cat << 'END'\n" + lines[i]) + "\nEND\n";
    const std::string name = file("reader", script + "read -r line\n");
    chmod(name.c_str(), 0700);
    return name;
  }
  ReaderVolume described(const std::string& answer) {
    return ReaderConversation(program({hello_line, answer})).describe("scan.x", {});
  }
  /// A description with these members besides the usual ones.
  ReaderVolume described_with(const std::string& members) {
    return described(R"({"answer": "volume", "dims": [4, 3, 5], "type": "int16", )" + members + "}");
  }
  std::string wrong(const std::string& answer) {
    return message_of<WorldError>([&] { described(answer); });
  }
  std::string wrong_with(const std::string& members) {
    return message_of<WorldError>([&] { described_with(members); });
  }
};

TEST_F(ReaderConversationTest, AVolumeHasWhatItsReaderSays) {
  const ReaderVolume volume = described_with(
      R"("spacing": [0.5, 1, 2], "units": "mm", "pairs": {"key": "a value"}, "warnings": ["take care"],)"
      R"("files": ["a", "b"], "order": "next", "memory": 1000000000, "unheard of": 7,)"
      R"("places": [{"file": 1, "offset": 99, "slices": 2, "step": 30, "big_endian": true}, {"slices": 3}])");
  EXPECT_EQ(volume.info.dims, (Index3{4, 3, 5}));
  EXPECT_EQ(volume.info.type, SampleType::int16);
  EXPECT_THAT(text_of(volume.info.metadata),
              testing::AllOf(HasSubstr("spacings: 0.5 1 2"), HasSubstr("mm"), HasSubstr("key:=a value")));
  EXPECT_THAT(volume.warnings, ElementsAre("take care"));
  EXPECT_THAT(volume.files, ElementsAre("a", "b"));
  EXPECT_THAT(volume.places, ElementsAre(SliceRun{1, 99, 2, 30, true}, SliceRun{0, 0, 3, 24, false}));
  const ReaderVolume with_rows = described_with(
      R"("places": [{"bottom_up": true}, {"row_step": 9, "slices": 3}, {"row_step": 11, "bottom_up": true, "step": 99}])");
  EXPECT_THAT(with_rows.places, ElementsAre(SliceRun{.step = 24, .row_step = 8, .bottom_up = true},
                                            SliceRun{.slices = 3, .step = 26, .row_step = 9},
                                            SliceRun{.step = 99, .row_step = 11, .bottom_up = true}));
  EXPECT_FALSE(volume.any_order);
  EXPECT_EQ(volume.memory, 1000000000u);
}

TEST_F(ReaderConversationTest, WhatIsNotSaidHasADefault) {
  const ReaderVolume volume = described(R"({"answer": "volume", "dims": [4, 3, 5], "type": "uint8"})");
  EXPECT_THAT(volume.files, ElementsAre("scan.x"));
  EXPECT_TRUE(volume.places.empty() && volume.warnings.empty() && volume.any_order);
  EXPECT_EQ(volume.memory, std::uint64_t{256} << 20);
}

TEST_F(ReaderConversationTest, SignsOfLifeMayComeBeforeAnAnswer) {
  const ReaderVolume volume = described(R"({"answer": "working"}
{"answer": "working"}
{"answer": "volume", "dims": [4, 3, 5], "type": "uint8"})");
  EXPECT_EQ(volume.info.dims, (Index3{4, 3, 5}));
}

TEST_F(ReaderConversationTest, OtherVersionsAndOtherProgramsAreRefused) {
  const auto begins = [&](const std::string& line) {
    return message_of<WorldError>([&] { ReaderConversation(program({line})); });
  };
  EXPECT_THAT(begins(R"({"tagrid-reader": 2, "name": "later"})"), HasSubstr("speaks version 2"));
  for (const char* other :
       {"hello", "[]", "{}", R"({"tagrid-reader": "1"})", R"({"tagrid-reader": -1})", "1"})
    EXPECT_THAT(begins(other), StartsWith(path("reader") + ": ")) << other;
}

TEST_F(ReaderConversationTest, ErrorsOfItsFilesAreThoseOfTheUser) {
  const auto answer = [](const char* kind) {
    return R"({"answer": "error", "message": "scan.x: ends early", "kind": ")" + std::string(kind) + "\"}";
  };
  EXPECT_EQ(message_of<BrokenInput>([&] { described(answer("input")); }), "scan.x: ends early");
  EXPECT_EQ(message_of<UsageError>([&] { described(answer("usage")); }), "scan.x: ends early");
  EXPECT_EQ(message_of<WorldError>([&] { described(answer("world")); }), "scan.x: ends early");
  EXPECT_THAT(wrong(answer("strange")), HasSubstr("unknown kind \"strange\": scan.x: ends early"));
  EXPECT_THAT(wrong(R"({"answer": "error", "kind": "input"})"), HasSubstr("an error without a message"));
  try {
    described(R"({"answer": "error", "kind": "input", "message": "a gap", "option": "gaps-ok"})");
    ADD_FAILURE() << "nothing was thrown";
  } catch (const BrokenInput& error) {
    EXPECT_EQ(error.detail().problem, Problem::slices_missing);
  }
}

TEST_F(ReaderConversationTest, SeveralVolumesAreListed) {
  try {
    described(
        R"({"answer": "several", "option": "series", "list": [{"name": "a", "text": "small"}, {"name": "b"}]})");
    ADD_FAILURE() << "nothing was thrown";
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), HasSubstr("scan.x: holds 2 volumes"));
    EXPECT_THAT(error.detail().choices, ElementsAre(Choice{"a", "small"}, Choice{"b", ""}));
  }
  EXPECT_THAT(wrong(R"({"answer": "several", "option": "color", "list": []})"), HasSubstr("\"color\""));
  EXPECT_THAT(wrong(R"({"answer": "several", "option": "series", "list": [1]})"), HasSubstr("\"list\""));
}

TEST_F(ReaderConversationTest, WrongDescriptionsNameTheFileAndTheReader) {
  for (const char* answer :
       {"text", "[]", R"({"answer": "unknown"})", R"({"answer": 1})", R"({"answer": "volume"})",
        R"({"answer": "volume", "dims": [4, 3], "type": "int16"})",
        R"({"answer": "volume", "dims": [4, 3, 1.5], "type": "int16"})",
        R"({"answer": "volume", "dims": [4, 3, 0], "type": "int16"})",
        R"({"answer": "volume", "dims": [4, 3, -5], "type": "int16"})",
        R"({"answer": "volume", "dims": [9000000000000000000, 3, 5], "type": "int16"})",
        R"({"answer": "volume", "dims": [18446744073709551615, 3, 5], "type": "int16"})",
        R"({"answer": "volume", "dims": [4, 3, 5], "type": "int12"})",
        R"({"answer": "volume", "dims": [4, 3, 5]})", "{\"answer\": \"volume\", \"type\": \"\xff\"}"})
    EXPECT_THAT(wrong(answer), StartsWith("scan.x: " + path("reader") + ": ")) << answer;
  for (const char* members : {R"("spacing": 1)",
                              R"("spacing": [1, 2])",
                              R"("spacing": [1, 2, "3"])",
                              R"("spacing": [1, 2, 0])",
                              R"("directions": [[1, 0, 0], [0, 1, 0]])",
                              R"("directions": [[1, 0, 0], [0, 1, 0], 1])",
                              R"("origin": {})",
                              R"("pairs": ["a"])",
                              R"("pairs": {"a": 1})",
                              R"("files": "a")",
                              R"("files": [1])",
                              R"("files": ["-"])",
                              R"("files": [""])",
                              R"("warnings": "a")",
                              R"("order": "back")",
                              R"("order": 1)",
                              R"("memory": -1)",
                              R"("memory": "much")",
                              R"("memory": 18446744073709551615)",
                              R"("places": {})",
                              R"("places": [1])",
                              R"("places": [{"slices": 4}])",
                              R"("places": [{"slices": 6}])",
                              R"("places": [{"slices": 0}, {"slices": 5}])",
                              R"("places": [{"slices": 9000000000000000000}])",
                              R"("places": [{"slices": 5, "file": 1}])",
                              R"("places": [{"slices": 5, "file": -1}])",
                              R"("places": [{"slices": 5, "offset": -1}])",
                              R"("places": [{"slices": 5, "offset": 1e300}])",
                              R"("places": [{"slices": 5, "row_step": 7}])",
                              R"("places": [{"slices": 5, "row_step": 4611686018427387904}])",
                              R"("places": [{"slices": 5, "bottom_up": 1}])",
                              R"("places": [{"slices": 5, "big_endian": 1}])"})
    EXPECT_THAT(wrong_with(members), StartsWith("scan.x: " + path("reader") + ": ")) << members;
}

TEST_F(ReaderConversationTest, SlicesComeInOrderAndNoOthers) {
  const auto hears = [&](const std::string& answer) {
    ReaderConversation reader(
        program({hello_line, R"({"answer": "volume", "dims": [1, 1, 9], "type": "uint8"})", answer}));
    reader.describe("scan.x", {});
    reader.ask_for_slices(2, 5);
    return reader.hear_of_slices(2, 5);
  };
  EXPECT_EQ(hears(R"({"answer": "slices", "from": 2, "to": 5})"), 5);
  EXPECT_EQ(hears(R"({"answer": "slices", "from": 2, "to": 3})"), 3);
  for (const char* answer :
       {R"({"answer": "slices", "from": 3, "to": 5})", R"({"answer": "slices", "from": 2, "to": 6})",
        R"({"answer": "slices", "from": 2, "to": 2})", R"({"answer": "slices", "from": 2})",
        R"({"answer": "unknown"})", R"({"answer": "volume"})", "bytes"})
    EXPECT_THAT(message_of<WorldError>([&] { hears(answer); }),
                StartsWith("scan.x: " + path("reader") + ": "))
        << answer;
  EXPECT_EQ(message_of<BrokenInput>(
                [&] { hears(R"({"answer": "error", "kind": "input", "message": "slice 2 is gone"})"); }),
            "slice 2 is gone");
}

TEST_F(ReaderConversationTest, ThePlainFormConsistsOfPiecesOfAllFiles) {
  const auto form_of = [&](const std::string& first, const std::string& second) {
    ReaderConversation conversation(program(
        {hello_line,
         R"({"answer": "volume", "dims": [4, 3, 2], "type": "int16", "files": ["a", "b"], "plain_form": true})",
         R"({"answer": "plain file", )" + first + "}", R"({"answer": "plain file", )" + second + "}"}));
    const ReaderVolume volume = conversation.describe("scan.x", {});
    EXPECT_TRUE(volume.has_plain_form);
    return conversation.plain_form(volume);
  };
  const std::string samples =
      R"("compression": "RLE", "pieces": [{"hex": "00fF"}, {"samples": 24}, {"from": 7, "to": 9}], )";
  const std::string of_slice_1 = samples + R"("places": [{"first": 1, "offset": 2, "bits": 12}])",
                    of_slice_0 = samples + R"("places": [{"first": 0, "offset": 2}])";
  const PlainForm form = form_of(of_slice_1, of_slice_0);
  EXPECT_EQ(form.why_not, std::nullopt);
  EXPECT_EQ(form.compression, "RLE");
  ASSERT_EQ(form.files.size(), 2U);
  EXPECT_TRUE(form.files[1].is_changed);
  EXPECT_EQ(form.files[1].path, "b");
  EXPECT_EQ(form.files[1].pieces[0].bytes, std::string("\0\xff", 2));
  EXPECT_EQ(form.files[1].pieces[2].file, 1U);
  EXPECT_EQ(form.files[1].pieces[2].offset, 7U);
  EXPECT_EQ(form.files[1].pieces[2].size, 2U);
  ASSERT_EQ(form.places.size(), 2U);
  EXPECT_EQ(form.places[0].file, 1U);
  EXPECT_EQ(form.places[1].stored.bits, 12);

  const PlainForm as_it_is =
      form_of(R"("pieces": [{"from": 0, "to": 48}], "places": [{"first": 0, "slices": 2}])",
              R"("pieces": [{"from": 0, "to": 1}])");
  EXPECT_FALSE(as_it_is.files[0].is_changed);
  EXPECT_EQ(form_of(of_slice_1, R"("why_not": "it is odd")").why_not, "b: it is odd");

  const auto wrong_form = [&](const std::string& first, const std::string& second) {
    return message_of<WorldError>([&] { form_of(first, second); });
  };
  EXPECT_THAT(wrong_form(of_slice_0, of_slice_0), HasSubstr("slice 1 has no place in a plain form, or two"));
  EXPECT_THAT(wrong_form(of_slice_0, R"("pieces": [])"), HasSubstr("slice 1 has no place in a plain form"));
  EXPECT_THAT(wrong_form(R"("pieces": [{"hex": "0"}])", ""), HasSubstr("\"hex\" is not a text of bytes"));
  EXPECT_THAT(wrong_form(R"("pieces": [{"hex": "0g"}])", ""), HasSubstr("\"hex\" is not a text of bytes"));
  EXPECT_THAT(wrong_form(R"("pieces": [{"from": 9, "to": 7}])", ""), HasSubstr("\"to\" is 7"));
  EXPECT_THAT(wrong_form(R"("pieces": [{"file": 2, "from": 0, "to": 7}])", ""),
              HasSubstr("in file 2, but there are 2"));
  EXPECT_THAT(wrong_form(samples + R"("places": [{"first": 1, "offset": 5}])", ""),
              HasSubstr("lies beyond its end"));
  EXPECT_THAT(
      wrong_form(samples + R"("places": [{"first": 1, "slices": 2, "step": 4611686018427387904}])", ""),
      HasSubstr("lies beyond its end"));
}

TEST_F(ReaderConversationTest, NamesThatAreNotTextAreRefused) {
  ReaderConversation reader(program({hello_line}));
  EXPECT_THAT(message_of<UsageError>([&] { reader.describe("scan\xff.x", {}); }), HasSubstr("UTF-8"));
}

}  // namespace
}  // namespace tagrid
