#include "io/formats/table/formats.h"
#include "io/metadata/text.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/formats/table/open_volume.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

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

TEST_F(WriteVolumeTest, RawIsTheSamplesAlone) {
  const VolumeInfo info = info_of(SampleType::uint8);
  write_volume(path("a.raw"), info);
  const auto samples = samples_of(info);
  EXPECT_EQ(content("a.raw"), std::string(reinterpret_cast<const char*>(samples.data()), samples.size()));
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
