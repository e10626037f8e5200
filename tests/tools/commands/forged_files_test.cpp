// Files with right checksums and absurd sizes: an error, quickly, and with little memory.

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/bytes/zstd_bytes.h"
#include "io/tag/file.h"
#include "stages/activity/coding.h"
#include "stages/grid/lattice.h"
#include "tests/support/command_line.h"
#include "tests/support/points.h"

namespace tagrid {
namespace {

constexpr std::size_t megabyte = std::size_t{1} << 20;

class ForgedFiles : public CommandLine {
 protected:
  static CodingParameters parameters(Index3 dims, int cube_size, int brick_edge, FileMode mode) {
    CodingParameters p{.dims = dims,
                       .type = SampleType::int16,
                       .mode = mode,
                       .cube_size = cube_size,
                       .brick_edge = brick_edge,
                       .max_level = max_level(cube_size),
                       .field_scale = 1};
    return p;
  }
  static std::string text_of(std::span<const std::byte> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  static std::string header_of(const CodingParameters& p) { return text_of(serialize_header({p, {}})); }
  /// With this text as metadata, whatever it says.
  static std::string header_of(const CodingParameters& p, const std::string& metadata) {
    const std::string packed = text_of(zstd_compress(std::as_bytes(std::span(metadata))));
    std::string bytes = header_of(p).substr(0, 116) + number(static_cast<std::uint32_t>(metadata.size())) +
                        number(static_cast<std::uint32_t>(packed.size())) + packed;
    bytes.replace(12, 4, number(static_cast<std::uint32_t>(bytes.size() + 8)));
    return bytes + number(checksum_of({std::as_bytes(std::span(bytes))}));
  }
  static std::uint64_t last_number(const std::string& file) {
    return load_little_endian<std::uint64_t>(
        reinterpret_cast<const std::byte*>(file.data() + file.size() - 8));
  }
  static std::string number(auto value) {
    FieldWriter field;
    field.put(value);
    return text_of(field.bytes());
  }
  /// `file`, and a block whose checksum is right for that place.
  static std::string with_block(const std::string& file, const std::string& block) {
    return file + block +
           number(chained_checksum(checksum_of({std::as_bytes(std::span(block))}), last_number(file)));
  }
  /// A brick: the grid of its root corners, and one value for all voxels.
  static std::string with_constant_brick(const std::string& file, const CodingParameters& p,
                                         std::int64_t id) {
    const Index3 position = p.bricks().position(id);
    LatticeBits active(p.bricks().closed_box(position));
    const Box& box = active.box();
    for (const auto [x, y, z] : points_of(box, p.cube_size)) active.set({x, y, z});
    std::vector<std::uint8_t> activity;
    const std::vector<std::int16_t> samples(static_cast<std::size_t>(p.bricks().owned_box(position).count()),
                                            5);
    encode_activity(active, forecast_activity<std::int16_t>(samples, p, position), p.cube_size, p.max_level,
                    activity);
    const std::string values("\0\5\0", 3);
    return with_block(file, number(static_cast<std::uint32_t>(12 + activity.size() + values.size())) +
                                number(static_cast<std::uint64_t>(id)) +
                                number(static_cast<std::uint32_t>(activity.size())) +
                                std::string(activity.begin(), activity.end()) + values);
  }

  void expect_refused(const Ending& ending, std::size_t most_memory) const {
    EXPECT_EQ(ending.code, broken_input) << ending.err << " signal " << ending.signal;
    EXPECT_EQ(std::count(ending.err.begin(), ending.err.end(), '\n'), 1) << ending.err;
    EXPECT_LT(ending.cpu_seconds, program_is_sanitized() ? 30 : 3);
    // Sanitizers need memory of their own.
    if (!program_is_sanitized()) {
      EXPECT_LT(ending.peak_bytes, most_memory);
    }
  }
  /// Refused by every command, from a file and from a pipe.
  void expect_refused_everywhere(const std::string& bytes, std::size_t most_memory) const {
    file("forged.tag", bytes);
    for (const Arguments& command : {words("decode -o x.raw"), words("decode -o -"), words("info"),
                                     words("verify"), words("mesh --padded -o x.vtu")}) {
      SCOPED_TRACE(command[0]);
      expect_refused(tagrid(with(command, {"forged.tag"})), most_memory);
      expect_refused(tagrid(with(command, {"-"}), bytes), most_memory);
    }
    expect_refused(tagrid({"preview", "forged.tag", "-o", "x.png"}), most_memory);
    EXPECT_EQ(names(), std::vector<std::string>{"forged.tag"});
  }
};

constexpr std::int64_t most = std::int64_t{1} << 31;

TEST_F(ForgedFiles, HugeDimsOfAFileThatEndsWithItsHeader) {
  for (const Index3 dims : {Index3{most, 1, 1},
                            {1, most, 1},
                            {1, 1, most},
                            {most, most >> 2, 1},
                            {std::int64_t{1} << 20, std::int64_t{1} << 19, std::int64_t{1} << 19}})
    for (const auto& [cube_size, brick_edge] : {std::pair{4, 1}, {256, 2}}) {
      SCOPED_TRACE(testing::Message() << dims.x << ' ' << dims.y << ' ' << dims.z << ", " << cube_size);
      expect_refused_everywhere(header_of(parameters(dims, cube_size, brick_edge, FileMode::voxels)),
                                40 * megabyte);
    }
}

// The header claims a layer of 115 GB. Memory depends on the bricks that exist.
TEST_F(ForgedFiles, AWideLayerOfWhichFewBricksAreThere) {
  for (const FileMode mode : {FileMode::voxels, FileMode::grid}) {
    const CodingParameters p = parameters({30000, 30000, 64}, 32, 2, mode);
    std::string bytes = header_of(p);
    if (mode == FileMode::voxels)
      for (std::int64_t id = 0; id < 4; ++id) bytes = with_constant_brick(bytes, p, id);
    expect_refused_everywhere(bytes, 64 * megabyte);
  }
}

TEST_F(ForgedFiles, ABrickThatSaysItIsLarge) {
  const CodingParameters p = parameters({513, 513, 513}, 256, 2, FileMode::voxels);
  for (const std::uint32_t length :
       {std::uint32_t{0}, std::uint32_t{11}, std::uint32_t{600} << 20, 0xFFFFFFFFU}) {
    SCOPED_TRACE(length);
    const std::string bytes =
        header_of(p) + number(length) + number(std::uint64_t{0}) + number(std::uint32_t{0});
    expect_refused_everywhere(bytes + std::string(3000, 'x'), 40 * megabyte);
  }
}

TEST_F(ForgedFiles, AnIndexThatSaysItIsLarge) {
  const CodingParameters p = parameters({9, 9, 9}, 4, 2, FileMode::voxels);
  std::string bricks = with_constant_brick(header_of(p), p, 0);
  std::uint64_t checksum = last_number(bricks);
  bricks += text_of(packed_block(sizes_marker, std::vector<std::byte>(sizes_entry), checksum));
  bricks += text_of(packed_block(statistics_marker, std::vector<std::byte>(statistics_entry), checksum));
  const std::uint64_t size = least_directory_size(1, index_form(p));
  for (const std::uint64_t claimed : {size, std::uint64_t{1} << 40, ~std::uint64_t{0}})
    for (const std::uint64_t packed :
         {std::uint64_t{0}, size + 1000, std::uint64_t{1} << 40, ~std::uint64_t{0}}) {
      const std::string index =
          number(std::uint32_t{0}) + number(claimed) + number(packed) + std::string(64, 'x');
      expect_refused_everywhere(
          with_block(bricks, index) + number(bricks.size()) + number(last_number(header_of(p))) + "TAG END\n",
          40 * megabyte);
    }
}

TEST_F(ForgedFiles, FieldsThatUnpackToMoreThanTheySay) {
  const CodingParameters p = parameters({9, 9, 9}, 4, 2, FileMode::voxels);
  const std::string bomb = text_of(zstd_compress(std::vector<std::byte>(64 * megabyte)));
  const std::string window("\x28\xB5\x2F\xFD\x00\x88\x09\0\0x", 10);  // 2^27 bytes, for one
  for (const std::string& packed : {bomb, window})
    for (const std::uint32_t size : {std::uint32_t{1}, std::uint32_t{1} << 24, std::uint32_t{0xFFFFFFFF}}) {
      std::string bytes = header_of(p).substr(0, 116) + number(size) +
                          number(static_cast<std::uint32_t>(packed.size())) + packed;
      bytes.replace(12, 4, number(static_cast<std::uint32_t>(bytes.size() + 8)));
      bytes += number(checksum_of({std::as_bytes(std::span(bytes))}));
      if (size == 1 && packed == window) continue;  // its size is right, except for the window
      // All 64 MB, in a vector that grows, would take more than 100. The heap keeps what the vector had before.
      expect_refused_everywhere(bytes, 76 * megabyte);
    }
}

TEST_F(ForgedFiles, ImpossibleNumbersOfVolumes) {
  const auto refused = [&](const Index3& dims, std::uint32_t volumes, const std::string& words) {
    std::string bytes = header_of(parameters(dims, 4, 2, FileMode::voxels));
    bytes.replace(112, 4, number(volumes));
    const auto fields = bytes.substr(0, bytes.size() - 8);
    bytes = fields + number(checksum_of({std::as_bytes(std::span(fields))}));
    file("several.tag", bytes);
    fails("info several.tag", broken_input, words);
  };
  for (const std::uint32_t volumes : {0u, 10001u, 0xFFFFFFFFu})
    refused({9, 9, 9}, volumes, "the number of volumes is not from 1 to 10000");
  refused({1, 1, 1 << 20}, 5000, "more than 2^31 slices");
  refused({1 << 20, 1 << 20, 1 << 18}, 2, "more than 2^31 slices or 2^58 samples");
  refused({1 << 16, 1 << 14, 9}, 9000, "no room for so many volumes");
  refused({9, 9, 9}, 2, "truncated");
}

TEST_F(ForgedFiles, FieldsOfTheSourceThatAreNone) {
  const CodingParameters p = parameters({9, 9, 9}, 4, 2, FileMode::voxels);
  for (const char* fields :
       {"no field\n", "spacings: 1 1\n", "sizes: 9 9 9\n", "content: a", "content: a\r\n", "\n"}) {
    SCOPED_TRACE(fields);
    file("forged.tag", header_of(p, fields));
    for (const char* command : {"decode", "info", "verify", "mesh"})
      expect_error(tagrid({command, "forged.tag"}), broken_input, "forged.tag: the source's fields");
  }
}

}  // namespace
}  // namespace tagrid
