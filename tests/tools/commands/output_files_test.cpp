// Files: names, overwriting, permissions, times, removal, and leftovers after failures.

#include <thread>

#include "io/errors/errors.h"
#include "tests/support/command_line.h"
#include "tests/support/tag_in_memory.h"

namespace tagrid {
namespace {

using Names = std::vector<std::string>;

class OutputFiles : public CommandLine {
 protected:
  /// Gives a file permissions and a time that a new file does not have.
  void age(const std::string& name) const {
    const timespec times[2] = {{978307200, 0}, {1000000000, 123456000}};
    ASSERT_EQ(utimensat(AT_FDCWD, path(name).c_str(), times, 0), 0);
    ASSERT_EQ(chmod(path(name).c_str(), 0640), 0);
  }
  void expect_aged(const std::string& name) const {
    const struct stat status = status_of(name);
    EXPECT_EQ(status.st_mode & 0777, 0640U) << name;
    EXPECT_EQ(status.st_mtim.tv_sec, 1000000000) << name;
    EXPECT_EQ(status.st_mtim.tv_nsec, 123456000) << name;
  }
};

TEST_F(OutputFiles, EncodeReplacesTheEndingByTagAndDecodeThatByNrrd) {
  make_tag();
  expect_ok(
      script("mkdir sub && mv volume.* sub && $TAGRID encode -f sub/volume.nrrd && rm sub/volume.nrrd && "
             "$TAGRID decode sub/volume.tag && ls sub/volume.nrrd"));
  EXPECT_EQ(names(), Names{"sub"});
}

TEST_F(OutputFiles, AnOutputThatExistsNeedsForce) {
  make_tag();
  const std::string before = content("volume.tag");
  fails("encode volume.nrrd --max-error=5", usage, "volume.tag: already exists; give -f");
  fails("decode volume.tag", usage, "volume.nrrd: already exists");
  fails("phantom --dims 4,4,4 -o volume.nrrd", usage, "already exists");
  EXPECT_EQ(content("volume.tag"), before);
  works("encode volume.nrrd --max-error=5 -f");
  EXPECT_NE(content("volume.tag"), before);
}

TEST_F(OutputFiles, TheInputIsNeverTheOutputByWhateverName) {
  phantom("volume.nrrd");
  phantom("volume.raw");
  const std::string before = content("volume.nrrd"), raw_before = content("volume.raw");
  expect_ok(script("ln volume.nrrd hard.nrrd; ln -s volume.nrrd soft.nrrd"));
  for (const char* name : {"volume.nrrd", "./volume.nrrd", "hard.nrrd", "soft.nrrd"})
    expect_error(tagrid({"encode", "volume.nrrd", "-fo", name}), usage, "is the input itself");
  expect_error(script("\"$TAGRID\" encode - -fo volume.nrrd < volume.nrrd"), usage, "is the input itself");
  expect_error(script("\"$TAGRID\" encode volume.nrrd -o - 1<> volume.nrrd"), usage, "is the input itself");
  fails("encode volume.nrrd --json hard.nrrd -f", usage, "is the input itself");
  expect_error(tagrid(with({"encode", "volume.raw", "-fo", "volume.raw"}, raw_)), usage,
               "is the input itself");
  EXPECT_EQ(content("volume.nrrd"), before);
  EXPECT_EQ(content("volume.raw"), raw_before);
}

TEST_F(OutputFiles, TheSamplesOfADetachedHeaderAreInputToo) {
  phantom("volume.nhdr");
  const std::string before = content("volume.raw");
  fails("encode volume.nhdr -fo volume.raw", usage, "is the input itself");
  works("encode volume.nhdr -o volume.tag");
  expect_ok(script("mv volume.tag strange.raw"));
  fails("decode strange.raw -fo strange.nhdr", usage, "is the input itself");
  EXPECT_EQ(content("volume.raw"), before);
}

TEST_F(OutputFiles, TheReportIsNoFileOfTheVolume) {
  make_tag();
  expect_ok(script("mkdir below"));
  for (const std::string json : {"y.raw", "./y.raw", "below/../y.raw", "y.nhdr"}) {
    expect_error(tagrid({"decode", "volume.tag", "-o", "y.nhdr", "--json", json}), usage,
                 "choose another file");
    expect_error(tagrid({"phantom", "--dims", "9,9,9", "-o", "y.nhdr", "--json", json}), usage,
                 "choose another file");
  }
  // A volume that begins as JSON does.
  file("brace.raw", std::string(8, '{'));
  works("encode brace.raw --dims 2,2,2 --type uint8 -q");
  fails("verify brace.tag --against brace.raw --dims 2,2,2 --type uint8 --json brace.raw -f", usage,
        "choose another file");
  EXPECT_EQ(content("brace.raw"), std::string(8, '{'));
  EXPECT_FALSE(std::filesystem::exists(path("y.raw")) || std::filesystem::exists(path("y.nhdr")));
}

TEST_F(OutputFiles, ARunThatFailsLeavesNoReportOfAnEarlierOne) {
  make_tag();
  file("broken.nrrd", "NRRD0004\nnothing");
  file("broken.tag", content("volume.tag").substr(0, 500));
  for (const std::string command : {"encode broken.nrrd -o x.tag", "encode missing.nrrd -o x.tag",
                                    "decode broken.tag -o x.nrrd", "mesh broken.tag -o x.vtu"}) {
    works("encode volume.nrrd -f --json x.json");
    ASSERT_TRUE(std::filesystem::exists(path("x.json")));
    EXPECT_NE(tagrid(words(command + " -f --json x.json")).code, 0) << command;
    EXPECT_FALSE(std::filesystem::exists(path("x.json"))) << command;
  }
  // What is no report stays, and so does one that may not be overwritten.
  file("x.json", "{\"name\": \"mine\"}");
  EXPECT_NE(tagrid(words("encode broken.nrrd -o x.tag -f --json x.json")).code, 0);
  EXPECT_EQ(content("x.json"), "{\"name\": \"mine\"}");
  works("encode volume.nrrd -f --json y.json");
  const std::string before = content("y.json");
  EXPECT_EQ(tagrid(words("encode broken.nrrd -o x.tag --json y.json")).code, usage);
  EXPECT_EQ(content("y.json"), before);
}

TEST_F(OutputFiles, PermissionsAndTimeAreThoseOfTheSamplesOfTheInput) {
  phantom("volume.nhdr");
  age("volume.raw");
  works("encode volume.nhdr");
  expect_aged("volume.tag");
  works("decode volume.tag -o again.nhdr");
  expect_aged("again.nhdr");
  expect_aged("again.raw");
  // From a pipe, a file is like any new one.
  phantom("volume.nrrd");
  age("volume.nrrd");
  expect_ok(script("umask 027; cat volume.nrrd | \"$TAGRID\" encode - -o pipe.tag"));
  EXPECT_EQ(status_of("pipe.tag").st_mode & 0777, 0640U);
  EXPECT_GT(status_of("pipe.tag").st_mtim.tv_sec, 1000000000);
}

TEST_F(OutputFiles, TheInputIsKeptUnlessItIsToBeRemoved) {
  make_tag({"-k"});
  EXPECT_EQ(names(), (Names{"volume.nrrd", "volume.tag"}));
  const std::string encode = "encode volume.nrrd -f --max-error 2 --grid derived --cube 8 --brick 1";
  works(encode);
  const std::string kept = content("volume.tag");
  works(encode + " --rm");
  EXPECT_EQ(names(), Names{"volume.tag"});
  EXPECT_TRUE(content("volume.tag") == kept);
  works("decode volume.tag -o copy.nhdr");
  works("encode copy.nhdr -fo volume.tag --strip");
  works("encode copy.nhdr --rm -o copy.tag");
  works("decode volume.tag --rm");
  EXPECT_EQ(names(), (Names{"copy.tag", "volume.nrrd"}));
  works("encode volume.nrrd --rm --grid-only --max-error 9");
  EXPECT_EQ(names(), (Names{"copy.tag", "volume.tag"}));
}

// What the format of the output cannot hold, or no volume can, would be lost with the .tag file.
TEST_F(OutputFiles, ATagFileIsNotRemovedForAVolumeThatHoldsLess) {
  phantom("volume.nrrd");
  const std::string head =
      "NRRD0004\ntype: short\ndimension: 3\nsizes: 52 40 36\nendian: little\nencoding: raw\n";
  const std::string samples = samples_of(content("volume.nrrd"));
  const Arguments by_pipe = {"by pipe"};
  const auto kept = [&](const std::string& fields, const Arguments& more, const std::string& output,
                        std::string_view why, const Arguments& encoding = {"--strip"}) {
    // An unknown spacing is lost, too.
    const char* spacing = fields.find("spac") == fields.npos ? "spacings: 1 1 1\n" : "";
    file("a.nrrd", head + spacing + fields + "\n" + samples);
    // What comes through a pipe has no source files.
    expect_ok(encoding == by_pipe ? tagrid({"encode", "-", "-qfo", "a.tag"}, content("a.nrrd"))
                                  : tagrid(with({"encode", "a.nrrd", "-qfo", "a.tag"}, encoding)));
    expect_error(tagrid(with({"decode", "a.tag", "--rm", "-o", output}, more)), usage, why);
    EXPECT_EQ(names(), (Names{"a.nrrd", "a.tag", "volume.nrrd"})) << output;
  };
  const std::string place =
      "space: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
      "space origin: (1,2,3)\n";
  kept(place, {}, "a.tif", "the spacing is not written: its unit is unknown");
  kept("rescale_slope:=0.1\nrescale_intercept:=0.3\n", {}, "a.tif", "TIFF rounds the intercept");
  kept("spacings: 1 1 1\nunits: \"furlong\" \"furlong\" \"furlong\"\n", {}, "a.nii.gz",
       "does not know the unit", by_pipe);
  kept("slice_positions:=0 0 0; 0 0 1; 0 0 9\n", {}, "a.mha", "slices lie at unequal distances");
  kept("slice_positions:=0 0 0; 0 0 1; 0 0 9\n", {}, "a.vdb", "slices lie at unequal distances");
  kept("spacings: nan nan nan\n", {}, "a.mha", "cannot record that a spacing is unknown");
  kept("", {}, "a.vti", "tagrid cannot read vti files");
  kept("", {}, "a.raw", "do not record their size and type");
  kept("", {"--vdb-tolerance", "2"}, "a.vdb", "--vdb-tolerance changes samples");
  kept("", {"--step", "2"}, "a.nrrd", "only a part of the volume");
  kept("", {}, "a.mha", "it stores only the grid", {"--grid-only", "--strip"});
  kept("", {}, "a.nrrd", "its mesh has a bound", {"--max-error", "5", "--mesh-error", "20", "--strip"});
  kept("", {}, "a.nrrd",
       "it keeps the source files, which a decoded volume does not replace; tagrid restore restores them",
       {});
  file("a.nrrd", head + "spacings: 1 1 1\n# by hand\nowner:=me\n\n" + samples);
  expect_ok(script("cat a.nrrd | $TAGRID encode - -fo a.tag"));
  fails("decode a.tag --rm -o a.mha", usage, "no place for 1 key/value pair (\"owner\"), comments");
  // Of these, decode does not warn, but nothing else has them.
  file("a.nrrd", head + "spacings: 1 1 1\ndicom_Modality:=CT\n\n" + samples);
  expect_ok(script("cat a.nrrd | $TAGRID encode - -fo a.tag"));
  fails("decode a.tag --rm -o a.mha", usage, "no place for 1 attribute of DICOM");
  // Nothing is lost here.
  file("a.nrrd", head + place + "\n" + samples);
  works("encode a.nrrd -fo a.tag --strip");
  works("decode a.tag --rm -o a.mha");
  EXPECT_EQ(names(), (Names{"a.mha", "a.nrrd", "volume.nrrd"}));
}

TEST_F(OutputFiles, NothingIsRemovedForAGridThatNothingBounds) {
  phantom("volume.nrrd");
  const std::string before = content("volume.nrrd");
  for (const Arguments& more : {Arguments{}, {"--mesh-error", "5"}, {"--resume"}, {"-f"}})
    expect_error(tagrid(with({"encode", "volume.nrrd", "--rm", "--grid-only"}, more)), usage,
                 "give --max-error E, or leave out --rm");
  fails("encode volume.nrrd --rm --grid-only --max-level 3", usage,
        "give --max-error E instead of --max-level, or leave out --rm");
  EXPECT_EQ(names(), Names{"volume.nrrd"});
  EXPECT_TRUE(content("volume.nrrd") == before);
  // Both pieces of advice work.
  works("encode volume.nrrd --grid-only");
  works("encode volume.nrrd --rm --grid-only --max-error 0 -f");
  EXPECT_EQ(names(), Names{"volume.tag"});
  works("decode volume.tag");
  EXPECT_TRUE(content("volume.nrrd") == before);
}

// Only the command describes headerless samples, and perhaps wrongly.
TEST_F(OutputFiles, AfterALossyEncodingHeaderlessSamplesGoOnlyIfTheirDescriptionIsTrusted) {
  phantom("volume.raw");
  for (const Arguments& more : {Arguments{"--max-error", "5"}, {"--grid-only", "--max-error", "5"}})
    expect_error(tagrid(with(with({"encode", "volume.raw", "--rm"}, more), raw_)), usage,
                 "volume.raw: cannot be removed: it has no header");
  expect_error(tagrid(with({"encode", "volume.raw", "--max-error", "5", "--trust-description"}, raw_)), usage,
               "--trust-description: has an effect only together with --rm; give --rm, or leave it out");
  fails("convert --manifest list.tsv --output-dir out --trust-description", usage,
        "give --remove-verified, or leave it out");
  EXPECT_EQ(names(), Names{"volume.raw"});
  expect_ok(tagrid(with({"encode", "volume.raw", "--rm", "--max-error", "5", "--trust-description"}, raw_)));
  EXPECT_EQ(names(), Names{"volume.tag"});
}

TEST_F(OutputFiles, WithoutLossOrWithAHeaderNobodyHasToTrustADescription) {
  phantom("volume.raw");
  // An error below one unit of integers is no loss.
  for (const char* bound : {"0", "0.5"}) {
    const Ending encoded = tagrid(with({"encode", "volume.raw", "-f", "--rm", "--max-error", bound}, raw_));
    EXPECT_EQ(encoded.code, 0) << encoded.err;
    EXPECT_EQ(has(encoded.err, "samples are integers, so this is 0 (lossless)"), bound != std::string("0"));
    EXPECT_EQ(names(), Names{"volume.tag"});
    works("decode volume.tag --format raw");
  }
  phantom("volume.nrrd");
  expect_ok(tagrid(with({"encode", "volume.nrrd", "-f", "--rm", "--max-error", "5"}, raw_)));
  EXPECT_EQ(names(), (Names{"volume.raw", "volume.tag"}));
}

TEST_F(OutputFiles, NothingIsRemovedForAnOutputThatDoesNotStayOrAfterAFailure) {
  make_tag();
  fails("encode volume.nrrd --rm -o -", usage, "--rm");
  fails("encode volume.nrrd --rm -o /dev/null", usage, "--rm");
  fails("decode volume.tag --rm -o /dev/null", usage, "--rm");
  expect_error(tagrid({"decode", "-", "--rm", "-o", "x.nrrd"}, content("volume.tag")), usage, "--rm");
  file("broken.tag", content("volume.tag").substr(0, content("volume.tag").size() - 1));
  fails("decode broken.tag --rm", broken_input, "broken.tag");
  fails("encode volume.nrrd --rm", usage, "already exists");
  EXPECT_EQ(names(), (Names{"broken.tag", "volume.nrrd", "volume.tag"}));
}

TEST_F(OutputFiles, NothingIsRemovedThatHoldsMoreThanSamples) {
  phantom("volume.raw");
  expect_ok(script("(echo header12; cat volume.raw) > more.raw"));
  const Arguments encode = with({"encode", "more.raw", "--offset", "9", "--rm"}, raw_);
  expect_error(tagrid(with(encode, {"--strip"})), usage, "--strip drops its files");
  EXPECT_EQ(names(), (Names{"more.raw", "volume.raw"}));
  // Nothing is lost if the .tag file has the other bytes, too.
  const std::string more = content("more.raw");
  expect_ok(tagrid(encode));
  EXPECT_EQ(names(), (Names{"more.tag", "volume.raw"}));
  works("restore more.tag -o .");
  EXPECT_TRUE(content("more.raw") == more);
}

// A header from elsewhere must not choose which files are removed.
TEST_F(OutputFiles, SamplesInAnotherFolderThanTheirHeaderAreNotRemoved) {
  phantom("volume.nhdr");
  expect_ok(script("mkdir other; mv volume.raw other; sed -i s,volume.raw,other/volume.raw, volume.nhdr"));
  fails("encode volume.nhdr -o x.tag --rm", usage, "in a different directory than its header");
  EXPECT_TRUE(std::filesystem::exists(folder_ / "other" / "volume.raw"));
  works("encode volume.nhdr -o x.tag");
}

TEST_F(OutputFiles, NothingIsRemovedThroughALink) {
  phantom("volume.nhdr");
  make_tag();
  expect_ok(
      script("ln -s volume.nrrd link.nrrd; ln -s volume.tag link.tag; mkdir sub; mv volume.raw sub; "
             "ln -s sub/volume.raw volume.raw"));
  fails("encode link.nrrd -o x.tag --rm", usage, "link.nrrd: cannot be removed: it is a symbolic link");
  fails("decode link.tag -o x.nrrd --rm", usage, "link.tag: cannot be removed: it is a symbolic link");
  fails("encode volume.nhdr -o x.tag --rm", usage, "volume.raw: cannot be removed: it is a symbolic link");
  EXPECT_EQ(names(), (Names{"link.nrrd", "link.tag", "sub", "volume.nhdr", "volume.nrrd", "volume.raw",
                            "volume.tag"}));
}

TEST_F(OutputFiles, NamesThatADetachedHeaderCannotSayAreRefused) {
  make_tag();
  for (const char* name : {"a\nb.nhdr", " a.nhdr", "LIST .nhdr", "s%03d 1 9 1.nhdr"})
    expect_error(tagrid({"decode", "volume.tag", "-o", name}), usage, "choose another name");
  EXPECT_EQ(names(), (Names{"volume.nrrd", "volume.tag"}));
  for (const std::string name : {"a b.nhdr", "LISTE.nhdr", "100 %.nhdr", "\xff.nhdr", "a:b.nhdr"}) {
    expect_ok(tagrid({"decode", "volume.tag", "-fo", name}));
    expect_ok(tagrid({"encode", name, "-fo", "again.tag"}));
    EXPECT_EQ(header_and_bricks(content("again.tag")), header_and_bricks(content("volume.tag"))) << name;
  }
}

TEST_F(OutputFiles, AWriteErrorIsReportedWhileTheInputIsIdle) {
  phantom("volume.nrrd", {"--dims", "40,40,100"});
  works("encode volume.nrrd --cube 8 --brick 1");
  const auto stuck = [&](Arguments arguments, const std::string& start) {
    arguments.insert(arguments.begin(), program_under_test());
    Process process(arguments, folder_.string());
    process.feed(start);
    // The rest never arrives.
    return process.wait();
  };
  expect_error(stuck({"encode", "-", "--cube=8", "--brick=1", "-o", "/dev/full"},
                     content("volume.nrrd").substr(0, 60000)),
               world, "/dev/full: cannot write");
  const std::string tag = content("volume.tag");
  expect_error(
      stuck({"decode", "-", "-o", "/dev/full"}, tag.substr(0, std::min<std::size_t>(tag.size() / 2, 60000))),
      world, "/dev/full: cannot write");
}

TEST_F(OutputFiles, WhatCannotBeWrittenLeavesNothing) {
  make_tag();
  expect_ok(script("mkdir folder.nrrd"));
  const std::tuple<const char*, int, const char*> cases[] = {
      {"encode volume.nrrd -o x.tag --json /dev/full", world, "/dev/full"},
      {"decode volume.tag -o x.nhdr --json /dev/full", world, "/dev/full"},
      {"mesh volume.tag -o x.vtu --json /dev/full", world, "/dev/full"},
      {"phantom --dims=9,9,9 -o x.raw --json /dev/full", world, "/dev/full"},
      {"encode volume.nrrd -o no/x.tag", world, "no/x.tag: cannot create"},
      {"decode volume.tag -o no/x.nrrd", world, "no/x.nrrd"},
      {"encode volume.nrrd -o x.tag --json no/x.json", world, "no/x.json"},
      {"encode volume.nrrd -fo folder.nrrd", usage, "is a directory"},
      {"decode volume.tag -fo folder.nrrd", usage, "is a directory"},
      {"decode volume.tag -o /dev/full", world, "No space left"},
      {"encode volume.nrrd -o - > /dev/full", world, "No space left"}};
  for (const auto& [words, code, what] : cases)
    expect_error(script(std::string("$TAGRID ") + words), code, what);
  // A limit on the size of files ends a write like a full disk.
  expect_error(script("ulimit -f 16; $TAGRID decode volume.tag -o x.nrrd"), world, "x.nrrd: cannot write");
  EXPECT_EQ(names(), (Names{"folder.nrrd", "volume.nrrd", "volume.tag"}));
}

TEST_F(OutputFiles, PermissionDeniedIsAFailureOfTheWorld) {
  // Root may do anything, so it runs as nobody, who may not be able to reach the program.
  const bool root = geteuid() == 0;
  const std::string run =
      root ? "setpriv --reuid=65534 --regid=65534 --clear-groups ./program " : "./program ";
  make_tag();
  expect_ok(
      script("cp \"$TAGRID\" program; chmod 755 . program; mkdir closed open; chmod 555 closed; "
             "chmod 777 open; cp volume.nrrd secret.nrrd; chmod 000 secret.nrrd"));
  expect_error(script(run + "decode volume.tag -o closed/x.nrrd"), world, "closed/x.nrrd: cannot create");
  expect_error(script(run + "encode secret.nrrd -o open/y.tag"), world, "secret.nrrd: cannot open");
  EXPECT_EQ(script("ls -A open closed").out, "closed:\n\nopen:\n");
}

TEST_F(OutputFiles, WhatAKilledRunLeftIsRemovedAndSaid) {
  if (!is_on_local_file_system()) GTEST_SKIP() << folder_ << " is on no local file system";
  make_tag();
  for (const char* name :
       {".volume.raw.partabcdef", ".volume.tag.partabcdef", ".report.json.part012345", "a.json"})
    file(name, "x");
  const Ending ending =
      tagrid({"decode", "volume.tag", "-o", "volume.nhdr", "--json", "report.json", "--progress=plain"});
  EXPECT_EQ(ending.code, 0) << ending.err;
  EXPECT_TRUE(has(ending.err, "removed 2 temporary files that a killed run left"));
  EXPECT_EQ(names(), (Names{".volume.tag.partabcdef", "a.json", "report.json", "volume.nhdr", "volume.nrrd",
                            "volume.raw", "volume.tag"}));
}

TEST_F(OutputFiles, AnInputWithTheNameOfATemporaryIsKept) {
  phantom("volume.nrrd", {"--dims", "4,4,4"});
  std::filesystem::rename(path("volume.nrrd"), path(".a.tag.partabcdef"));
  works("encode .a.tag.partabcdef -o a.tag");
  EXPECT_EQ(names(), (Names{".a.tag.partabcdef", "a.tag"}));
}

TEST_F(OutputFiles, ASignalRemovesTheTemporaryAndEndsTheProgram) {
  phantom("volume.nrrd");
  const std::string start = content("volume.nrrd").substr(0, 20000);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    Process process({program_under_test(), "encode", "-", "-o", "x.tag", "--json", "x.json"},
                    folder_.string());
    process.feed(start);
    for (int i = 0; names().size() < 3 && i < 1000; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const Names present = names();
    ASSERT_EQ(present.size(), 3U);
    EXPECT_EQ(present[0].rfind(".x.json.part", 0), 0U);
    EXPECT_EQ(present[1].rfind(".x.tag.part", 0), 0U);
    process.send(signal);
    const Ending ending = process.finish();
    EXPECT_EQ(ending.signal, signal);
    EXPECT_EQ(ending.err, "");
    EXPECT_EQ(names(), Names{"volume.nrrd"});
  }
}

}  // namespace
}  // namespace tagrid
