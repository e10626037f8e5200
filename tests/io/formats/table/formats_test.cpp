// The table of formats: all that it says of a format is so.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <map>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/formats/table/formats.h"
#include "io/formats/table/open_volume.h"
#include "io/formats/table/other_formats.h"
#include "io/metadata/text.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

using namespace std::string_literals;

std::string at(std::size_t place, const std::string& magic) { return std::string(place, ' ') + magic; }

/// How files of formats that are not read may begin, by the names of their rows.
std::map<std::string, std::vector<std::string>> other_beginnings() {
  return {{"tag", {"\x89TAG\r\n"}},
          {"gzip", {"\x1f\x8b\b"}},
          {"zstd", {"\x28\xb5\x2f\xfd"}},
          {"xz", {"\xfd\x37zXZ"}},
          {"bzip2", {"BZh9"}},
          {"zip", {"PK\x03\x04", "PK\x03\x04" + at(26, "\x4\0\0\0word"s).substr(4)}},
          {"NumPy archive", {"PK\x03\x04" + at(26, "\x5\0\0\0a.npy"s).substr(4)}},
          {"tar", {std::string(257, 'a') + "ustar"}},
          {"MATLAB", {"MATLAB 5.0 MAT-file"}},
          {"Analyze", {"\x5c\1\0\0"s + at(38, "r").substr(4) + std::string(400, '\0')}},
          {"PNG", {"\x89PNG\r\n\x1a\n"}},
          {"JPEG", {"\xff\xd8\xff\xe0"}},
          {"NetCDF", {"CDF\1", "CDF\5"}},
          {"VTK", {"# vtk DataFile Version 3.0\n", "<?xml version=\"1.0\"?>\n<VTKFile>"}}};
}

/// How files of each format that is read may begin.
std::map<std::string, std::vector<std::string>> beginnings() {
  return {
      {"nrrd", {"NRRD0001\n", "NRRD0005\r\n"}},
      {"vdb", {" BDV\0\0\0\0"s}},
      {"zarr",
       {"PK\x03\x04" + at(26, "\x9\0\0\0zarr.json"s).substr(4),
        "PK\x03\x04" + at(26, "\x9\0\x14\0a/.zarray"s).substr(4)}},
      {"dicom", {at(128, "DICM")}},
      {"nifti",
       {"\x5c\1\0\0"s + at(344, "n+1\0"s).substr(4), "\0\0\1\x5c"s + at(344, "ni1\0"s).substr(4),
        "\x1c\2\0\0n+2\0\r\n\032\n"s, "\0\0\2\x1cni2\0\r\n\032\n"s}},
      {"metaimage", {"ObjectType = Image\n", "NDims = 3\n"}},
      {"hdf5", {"\x89HDF\r\n\x1a\n", "MATLAB 7.3" + at(502, "\x89HDF\r\n\x1a\n")}},
      {"jp2", {"\xff\x4f\xff\x51", "\0\0\0\x0cjP  \r\n\x87\n"s}},
      {"bmp", {"BM" + std::string(12, '\x7') + "\x28\0\0\0"s, "BM" + std::string(12, '\0') + "\x7c\0\0\0"s}},
      {"png", {"\x89PNG\r\n\x1a\n" + at(16, "\x8\0"s), "\x89PNG\r\n\x1a\n" + at(16, "\x10\0"s)}},
      {"vgi", {"{volume1}\n", " \r\n{volume1}"}},
      {"xtekct", {"[XTekCT]\r\n", "\xEF\xBB\xBF[XTekCT]\n"}},
      {"isq", {"CTDATA-HEADER_V1"}},
      {"npy", {"\x93NUMPY\1"}},
      {"mrc", {at(208, "MAP DD"), at(208, "MAP\0\x11\x11"s)}},
      {"edf", {"{\nHeaderID = EH:000001:000000:000000 ;\n", "{\nEDF_DataBlockID = 1.Image.Psd ;\n"}},
      {"amira", {"# AmiraMesh BINARY-LITTLE-ENDIAN 2.1\n", "# Avizo BINARY 3.0\n"}},
      {"pyhst", {"! PyHST_SLAVE VOLUME INFO FILE\n", "NUM_X =  9\n"}},
      {"vff", {"ncaa\nrank=3;\n", "ncaa\r\nrank=3;\r\n"}},
      {"tiff", {"II*\0"s, "MM\0*"s}}};
}

TEST(Formats, EachRowRecognisesItsOwnBeginningsAndNoOthers) {
  const auto all = beginnings();
  for (const Format& format : formats()) {
    ASSERT_EQ(format.reads.is_recognized(), all.contains(std::string(format.name))) << format.name;
    if (!format.reads.is_recognized()) continue;
    for (const auto& [name, texts] : all)
      for (const std::string& text : texts) {
        const std::string longer = text + std::string(400, '\n');
        EXPECT_EQ(format.reads.begins(longer), name == format.name) << format.name << ", " << text;
        if (name != format.name) continue;
        EXPECT_TRUE(format.reads.begins(longer.substr(0, format.reads.bytes_to_recognize())))
            << "these bytes are enough: " << format.name;
        EXPECT_LE(format.reads.bytes_to_recognize(), bytes_to_recognize());
        EXPECT_EQ(format_of(longer), &format);
        EXPECT_EQ(other_format_of(longer, "volume"), nullptr) << format.name;
        for (std::size_t size = 0; size < 2; ++size)
          EXPECT_FALSE(format.reads.begins(longer.substr(0, std::min(size, text.size() - 1)))) << format.name;
      }
  }
}

TEST(Formats, NamesAndExtensionsAreOfOneRowEach) {
  std::map<std::string_view, int> names, extensions;
  for (const Format& format : formats()) {
    ++names[format.name];
    EXPECT_FALSE(format.extensions.empty() || format.help.empty()) << format.name;
    for (const std::string_view extension : format.extensions) {
      ++extensions[extension];
      EXPECT_TRUE(extension.starts_with('.')) << extension;
    }
  }
  for (const auto& [name, count] : names) EXPECT_EQ(count, 1) << name;
  for (const auto& [extension, count] : extensions) EXPECT_EQ(count, 1) << extension;
}

TEST(Formats, TheNameOfAFileSaysTheFormatThatIsWritten) {
  for (const Format& format : formats())
    for (const std::string_view extension : format.extensions) {
      const Format* expected = format.writes.any() ? &format : nullptr;
      for (const std::string folder : {"", "a/b.c/", "/x.nrrd/"}) {
        EXPECT_EQ(format_with_extension(folder + "volume" + std::string(extension)), expected) << extension;
        EXPECT_EQ(format_with_extension(folder + std::string(extension)), nullptr) << "only an extension";
      }
      if (expected == nullptr) continue;
      EXPECT_EQ(&format_from_name("volume" + std::string(extension)), expected) << extension;
    }
  EXPECT_EQ(format_from_name("b.NHDR").name, "nhdr");
  EXPECT_EQ(format_from_name("-").name, "raw");
}

TEST(Formats, AreNamedByTheirEndingsToo) {
  const std::pair<const char*, const char*> names[] = {
      {"nii", "nifti"}, {"nii.gz", "nifti.gz"}, {"h5", "hdf5"}, {"tif", "tiff"}, {"vti", "vti"}};
  for (const auto& [ending, name] : names) EXPECT_EQ(format_named(ending).name, name) << ending;
  EXPECT_THROW(format_named(".nii"), UsageError);
  EXPECT_THROW(format_named(""), UsageError);
}

TEST(Formats, UnknownNamesListWhatThereIs) {
  const std::string file = message_of<UsageError>([] { format_from_name("b.jpg"); }),
                    name = message_of<UsageError>([] { format_named("jpg"); });
  for (const Format* format : written_formats()) {
    EXPECT_TRUE(has(file, format->extensions.front()));
    EXPECT_TRUE(has(file, format->help));
    EXPECT_TRUE(has(name, format->name));
  }
}

class FormatFiles : public TemporaryFolder {
 protected:
  FormatFiles() { setenv("TAGRID_READER_PATH", TAGRID_READERS, 1); }
  ~FormatFiles() override { unsetenv("TAGRID_READER_PATH"); }
};

TEST_F(FormatFiles, WhatIsWrittenIsReadAgain) {
  const VolumeInfo info{{2, 3, 4}, SampleType::int16};
  const std::vector<std::byte> samples(48, std::byte{1});
  for (const Format* format : written_formats()) {
    if (sanitized && format->name == "vdb") continue;  // its programs take minutes to compile with sanitizers
    const std::string name = path(std::string(format->name) + std::string(format->extensions.front()));
    const auto sink = create_volume(*format, name, info, {});
    EXPECT_EQ(sink->any_order(), format->writes.any_order) << name;
    sink->write_slices(samples);
    sink->commit();
    EXPECT_TRUE(std::filesystem::exists(samples_path(name, *format))) << name;
    SourceDescription description;
    if (format->name == "raw") description.raw = RawDescription{info.dims, info.type, {}, 0};
    if (format->name == "vti") continue;  // only written
    const auto source = open_volume(name, description);
    std::vector<std::byte> read(48);
    source->read_slices(read.data(), 4);
    source->finish();
    EXPECT_EQ(read, samples) << name;
  }
}

TEST_F(FormatFiles, WhatIsNotReadIsNamed) {
  for (const auto& [name, texts] : other_beginnings())
    for (const std::string& text : texts) {
      const std::string content = text + std::string(60, ' ');
      const OtherFormat* format = other_format_of(content, "volume");
      ASSERT_NE(format, nullptr) << name;
      EXPECT_EQ(format->name, name);
      EXPECT_EQ(format_of(content), nullptr) << name;
      const std::string file_name = file("volume", content);
      RawDescription raw{{9, 9, 9}, SampleType::uint8, {}, 0};
      for (const SourceDescription& source : {SourceDescription(), SourceDescription(raw)}) {
        const std::string message = message_of<BrokenInput>([&] { open_volume(file_name, source); });
        EXPECT_TRUE(has(message, format->what)) << message;
      }
    }
}

TEST(OtherFormats, AreRecognizedByTheBytesThatAreLookedAt) {
  for (const OtherFormat& format : other_formats()) {
    EXPECT_FALSE(format.name.empty() || format.what.empty());
    EXPECT_TRUE(format.what.starts_with("is ")) << format.name;
    EXPECT_EQ(format.advice.empty(), format.problem == Problem::compressed_file) << format.name;
    EXPECT_FALSE(format.magic.empty() && format.is_mine == nullptr && format.extensions.empty())
        << format.name;
    for (const Magic& one : format.magic) EXPECT_LE(one.at + one.bytes.size(), most_bytes_of_others);
    // Any bytes are safe, and too few are no layout.
    for (const std::string& bytes : {std::string(), std::string(12, '\xff'), std::string(3000, '\0'),
                                     std::string(3000, '\xff'), std::string(3000, ' ')}) {
      if (format.is_mine != nullptr) format.is_mine(bytes);
      if (format.layout == nullptr) continue;
      const auto layout = format.layout(bytes);
      EXPECT_FALSE(layout && bytes.size() < 13) << format.name;
    }
  }
}

using WriteVolumeTest = TemporaryFolder;
using Names = std::vector<std::string>;

const std::string fields =
    "content: a foot\nspacings: 1 1 nan\nunits: \"mm\" \"mm\" \"mm\"\nwho:=nobody\n# end\n";

VolumeInfo info_of(SampleType type) {
  VolumeInfo info;
  info.dims = {5, 3, 4};
  info.type = type;
  info.metadata = parse_metadata(fields);
  return info;
}

std::vector<std::byte> samples_of(const VolumeInfo& info) {
  std::vector<std::byte> samples(*sample_bytes(info.dims, info.type));
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<std::byte>(i * 37);
  return samples;
}

void write_volume(const std::string& path, const VolumeInfo& info) {
  const auto writer = create_volume(format_from_name(path), path, info, {});
  const auto samples = samples_of(info);
  writer->write_slices(std::span(samples).first(samples.size() / 4));
  writer->write_slices(std::span(samples).subspan(samples.size() / 4));
  writer->commit();
}

TEST_F(WriteVolumeTest, EveryTypeAndFormatReadsBackWithAllThatWasSaid) {
  for (SampleType type : all_sample_types) {
    const VolumeInfo info = info_of(type);
    for (const std::string extension : {".nrrd", ".nhdr"}) {
      const std::string name = path(std::string(name_of(type)) + extension);
      write_volume(name, info);
      const auto reader = open_volume(name);
      EXPECT_EQ(reader->info().type, type);
      EXPECT_EQ(reader->info().dims, info.dims);
      EXPECT_EQ(text_of(reader->info().metadata), fields);
      std::vector<std::byte> samples(*sample_bytes(info.dims, type));
      reader->read_slices(samples.data(), info.dims.z);
      reader->finish();
      EXPECT_EQ(samples, samples_of(info)) << name;
    }
  }
}

TEST_F(WriteVolumeTest, AVolumeThatMovesKeepsItsSamples) {
  write_volume(path("a.nhdr"), info_of(SampleType::int16));
  EXPECT_EQ(names(), (Names{"a.nhdr", "a.raw"}));
  EXPECT_TRUE(has(content("a.nhdr"), "data file: a.raw\n"));
  EXPECT_TRUE(has(content("a.nhdr"), "endian: little\n"));
}

TEST_F(WriteVolumeTest, NothingAppearsBeforeCommitAndNothingIsLeftWithout) {
  {
    const auto writer = create_volume(format_named("nhdr"), path("a.nhdr"), info_of(SampleType::uint8), {});
    writer->write_slices(samples_of(writer->info()));
    for (const auto& name : names()) EXPECT_TRUE(name.starts_with(".a.")) << name;
    EXPECT_EQ(names().size(), 2u);
  }
  EXPECT_EQ(names(), Names{});
}

TEST_F(WriteVolumeTest, NeitherFileOfADetachedVolumeIsOverwrittenUnasked) {
  file("a.raw", "precious");
  EXPECT_THROW(create_volume(format_named("nhdr"), path("a.nhdr"), info_of(SampleType::uint8), {}),
               UsageError);
  EXPECT_EQ(names(), Names{"a.raw"});
  file("b.nhdr", "precious");
  EXPECT_THROW(create_volume(format_named("nhdr"), path("b.nhdr"), info_of(SampleType::uint8), {}),
               UsageError);
  EXPECT_EQ(content("b.nhdr"), "precious");
}

TEST_F(WriteVolumeTest, SamplesDoNotStayWhenTheHeaderCannotAppear) {
  const auto writer = create_volume(format_named("nhdr"), path("a.nhdr"), info_of(SampleType::uint8), {});
  writer->write_slices(samples_of(writer->info()));
  file("a.nhdr", "somebody else's");
  EXPECT_THROW(writer->commit(), UsageError);
  EXPECT_FALSE(std::filesystem::exists(path("a.raw")));
  EXPECT_EQ(content("a.nhdr"), "somebody else's");
}

TEST_F(WriteVolumeTest, StandardOutputGetsSamplesAloneOrAfterAHeader) {
  const VolumeInfo info = info_of(SampleType::int16);
  write_volume(path("a.nrrd"), info);
  write_volume(path("a.raw"), info);
  for (const std::string name : {"nrrd", "raw"}) {
    fflush(stdout);
    const int kept = dup(STDOUT_FILENO);
    const int descriptor = open(path("out").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    dup2(descriptor, STDOUT_FILENO);
    close(descriptor);
    const auto writer = create_volume(format_named(name), "-", info, {});
    writer->write_slices(samples_of(info));
    writer->commit();
    dup2(kept, STDOUT_FILENO);
    close(kept);
    EXPECT_EQ(content("out"), content("a." + name));
  }
  EXPECT_THROW(create_volume(format_named("nhdr"), "-", info, {}), UsageError);
}

TEST(LittleEndian, StoresTheLowByteFirst) {
  std::array<std::byte, 9> bytes = {};
  store_little_endian(bytes.data() + 1, std::uint32_t{0x04030201});
  for (int i = 1; i <= 4; ++i) EXPECT_EQ(std::to_integer<int>(bytes[static_cast<std::size_t>(i)]), i);
  store_little_endian(bytes.data() + 1, 1.0);
  EXPECT_EQ(std::to_integer<int>(bytes[8]), 0x3f);
  EXPECT_EQ(load_little_endian<double>(bytes.data() + 1), 1.0);
}

RC_GTEST_PROP(LittleEndian, LoadsWhatWasStored, (std::int64_t value)) {
  std::array<std::byte, 8> bytes;
  store_little_endian(bytes.data(), value);
  RC_ASSERT(load_little_endian<std::int64_t>(bytes.data()) == value);
  store_little_endian(bytes.data(), static_cast<std::int16_t>(value));
  RC_ASSERT(load_little_endian<std::int16_t>(bytes.data()) == static_cast<std::int16_t>(value));
}

}  // namespace
}  // namespace tagrid
