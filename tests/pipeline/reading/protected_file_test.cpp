// Parity of real files: damage to any part of a file comes back, and what is lost with the parity is only that.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "io/errors/errors.h"
#include "io/parity/parity.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "io/tag/whole_bricks.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/tag_in_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

using Random = std::mt19937_64;

std::uint64_t below(Random& random, std::uint64_t end) { return random() % end; }

/// A part of a file, from its first byte to the byte after its last one.
struct Part {
  std::string name;
  std::uint64_t begin = 0, end = 0;
};

// 16 x 16 x 20 bricks: two pages of the index. Encoded once, for all tests.
class ProtectedTag : public TemporaryFolder {
 protected:
  static EncodeOptions options(bool with_parity) {
    EncodeOptions options = {.grid = GridOrigin::derived, .max_error = 0, .cube_size = 4, .brick_edge = 1};
    if (with_parity) options.parity = 5000;
    return options;
  }
  EncodeRun run(const std::string& output, bool with_parity, const Resources& resources) const {
    return {.input = path("in.nrrd"),
            .output = path(output),
            .overwrite = true,
            .options = options(with_parity),
            .resources = resources,
            .keep_files = true};
  }
  void make_volume() const {
    const Index3 dims = {65, 65, 81};
    write_nrrd(path("in.nrrd"), dims, blobs<std::uint8_t>(dims, 3));
  }
  std::string encoded(bool with_parity) const {
    Ranks alone;
    make_volume();
    committed(tagrid::encode_volume(alone, run("a.tag", with_parity, Resources(2))));
    return content("a.tag");
  }

  ProtectedTag() {
    static const std::string file = encoded(true);
    whole_ = file;
    plain_ =
        whole_.substr(0, whole_.size() - TagBricks(std::make_shared<MemorySource>(whole_)).sizes().parity);
    layout_ = parity_at_end(MemorySource(whole_)).value_or(ParityLayout::of(1, 5000));
    parts_ = parts();
  }

  std::vector<Part> parts() const {
    const TagBricks file(std::make_shared<MemorySource>(plain_));
    const std::uint64_t bricks = file.start(0), first_page = file.start(4095) + file.block_bytes(4095),
                        second = file.start(4096), last_page = file.start(5119) + file.block_bytes(5119),
                        envelope = file.end_of_pages(), footer = plain_.size() - footer_size;
    std::uint64_t directory = 0;
    EXPECT_TRUE(find_file_end(std::as_bytes(std::span(plain_)).subspan(footer, footer_size), directory).ok());
    const std::uint64_t base = plain_.size(), unit = layout_.block_size();
    return {
        {"header", 0, bricks},
        {"bricks", bricks, first_page},
        {"a page of the index", first_page, second},
        {"bricks behind it", second, last_page},
        {"the last page", last_page, envelope},
        {"envelope", envelope, directory},
        {"directory", directory, footer},
        {"footer", footer, base},
        {"head of the parity", base, base + parity_head_size},
        {"pages of the parity", layout_.first_unit(base), layout_.place_of_parity(base, 0)},
        {"parity", layout_.place_of_parity(base, 0), layout_.place_of_parity(base, layout_.parity_blocks())},
        {"pages behind it", layout_.place_of_parity(base, layout_.parity_blocks()), layout_.foot(base)},
        {"foot of the parity", layout_.foot(base), layout_.foot(base) + parity_head_size},
        {"the whole file", 0, base + unit}};
  }

  struct Repaired {
    bool found = false;
    ParityCondition condition;
    std::string bytes;
  };
  static Repaired repaired(const std::string& damaged) {
    const auto file = ProtectedFile::find(std::make_shared<MemorySource>(damaged));
    Repaired result;
    if (!file) return result;
    result.found = true;
    result.condition = file->repair([&](std::uint64_t position, std::span<const std::byte> part) {
      result.bytes.resize(std::max<std::size_t>(result.bytes.size(), position + part.size()));
      std::memcpy(result.bytes.data() + position, part.data(), part.size());
    });
    return result;
  }

  /// Other bytes than those that are there.
  static void damage(Random& random, std::string& bytes, std::uint64_t begin, std::uint64_t end) {
    for (std::uint64_t i = begin; i < std::min<std::uint64_t>(end, bytes.size()); ++i)
      bytes[i] = static_cast<char>(bytes[i] ^ static_cast<char>(1 + below(random, 255)));
  }

  void expect_repaired(const std::string& damaged, const std::string& what, int i) const {
    const Repaired result = repaired(damaged);
    ASSERT_TRUE(result.found) << what << " " << i;
    ASSERT_TRUE(result.condition.is_repairable()) << what << " " << i;
    ASSERT_FALSE(result.condition.is_intact()) << what << " " << i;
    ASSERT_TRUE(result.bytes == whole_) << what << " " << i;
  }

  std::string plain_, whole_;
  ParityLayout layout_;
  std::vector<Part> parts_;
};

TEST_F(ProtectedTag, FollowsTheFileWithoutIt) {
  EXPECT_TRUE(encoded(false) == plain_);
  for (const Part& part : parts_) EXPECT_LT(part.begin, part.end) << part.name;
  ASSERT_GE(layout_.parity, 2);
  ASSERT_GE(layout_.stripes, 2U);
  const TagBricks file(std::make_shared<MemorySource>(whole_));
  EXPECT_EQ(file.parity(), layout_);
  EXPECT_EQ(file.sizes().file, whole_.size());
  EXPECT_EQ(file.sizes().parity, whole_.size() - plain_.size());
  write_content(path("whole.tag"), whole_);
  TagReader reader(path("whole.tag"));
  reader.read_to_end();
  EXPECT_EQ(reader.parity(), layout_);
  EXPECT_EQ(reader.sizes().file, whole_.size());
}

TEST_F(ProtectedTag, IsOpenedByThreeReads) {
  const auto source = std::make_shared<MemorySource>(whole_);
  const TagBricks file(source);
  EXPECT_EQ(source->reads().size(), 3U) << "the header, the end, and the end without parity";
  const auto plain = std::make_shared<MemorySource>(plain_);
  const TagBricks other(plain);
  EXPECT_EQ(plain->reads().size(), 2U);
}

TEST_F(ProtectedTag, AnyPartComesBackFromScatteredDamage) {
  Random random(1);
  for (int i = 0; i < damaged_files(); ++i) {
    const Part& part = parts_[static_cast<std::size_t>(i) % parts_.size()];
    std::string bytes = whole_;
    const std::uint64_t count = 1 + below(random, layout_.parity);
    for (std::uint64_t k = 0; k < count; ++k) {
      const std::uint64_t at = part.begin + below(random, std::min(part.end, bytes.size()) - part.begin);
      damage(random, bytes, at, at + 1);
    }
    if (bytes == whole_) continue;  // the same byte, twice
    expect_repaired(bytes, part.name, i);
    if (HasFatalFailure()) return;
  }
}

TEST_F(ProtectedTag, AnyPartComesBackFromABurst) {
  Random random(2);
  for (int i = 0; i < damaged_files(); ++i) {
    const Part& part = parts_[static_cast<std::size_t>(i) % parts_.size()];
    std::string bytes = whole_;
    const std::uint64_t begin = part.begin + below(random, std::min(part.end, bytes.size()) - part.begin);
    damage(random, bytes, begin, begin + 1 + below(random, layout_.burst()));
    expect_repaired(bytes, part.name, i);
    if (HasFatalFailure()) return;
  }
}

TEST_F(ProtectedTag, BothEndsMayBeMissing) {
  Random random(3);
  for (int i = 0; i < damaged_files(); ++i) {
    std::string bytes = whole_;
    const std::uint64_t length = 1 + below(random, layout_.burst());
    if (i % 3 == 0)
      bytes.resize(bytes.size() - length);
    else if (i % 3 == 1)
      std::fill_n(bytes.begin(), length, '\0');
    else
      bytes.append(length, 'x');  // bytes that follow
    expect_repaired(bytes, "ends", i);
    if (HasFatalFailure()) return;
  }
}

// Beyond the promise, either everything comes back or it is said that something does not.
TEST_F(ProtectedTag, MoreDamageIsNeverRepairedWrongly) {
  Random random(4);
  int refused = 0;
  for (int i = 0; i < damaged_files(); ++i) {
    std::string bytes = whole_;
    const std::uint64_t count = 1 + below(random, 3 * layout_.parity);
    for (std::uint64_t k = 0; k < count; ++k) {
      const std::uint64_t begin = below(random, bytes.size());
      damage(random, bytes, begin, begin + 1 + below(random, 2 * layout_.burst()));
    }
    const Repaired result = repaired(bytes);
    if (result.found && result.condition.is_repairable()) {
      ASSERT_TRUE(result.bytes == whole_) << i;
    } else {
      ++refused;
    }
  }
  EXPECT_GT(refused, damaged_files() / 10);
}

TEST_F(ProtectedTag, SalvageFindsTheIndexWithoutTheFoot) {
  const TagBricks good(std::make_shared<MemorySource>(plain_));
  const auto lost_of = [](const std::string& bytes) {
    const WholeBricks salvaged(std::make_shared<MemorySource>(bytes));
    EXPECT_TRUE(salvaged.index().has_value());
    EXPECT_TRUE(salvaged.is_damaged_elsewhere());
    return salvaged.lost();
  };
  const std::vector<BrickRun> one = {{17, 17}};
  std::string bytes = whole_;
  bytes[good.start(17) + 8] ^= 1;
  for (const std::size_t cut : {std::size_t{1}, parity_head_size, std::size_t{1000},
                                static_cast<std::size_t>(whole_.size() - plain_.size() - 48)})
    EXPECT_EQ(lost_of(bytes.substr(0, bytes.size() - cut)), one) << cut;
  EXPECT_EQ(lost_of(bytes + "more"), one);
  std::string wrong_foot = bytes;
  wrong_foot[wrong_foot.size() - 20] ^= 1;
  EXPECT_EQ(lost_of(wrong_foot), one);
  std::string wrong_ends = wrong_foot;
  wrong_ends[plain_.size() + 20] ^= 1;
  EXPECT_EQ(lost_of(wrong_ends), one) << "a page says where the footer is";
  // A damaged brick and intact parity: as without parity.
  const WholeBricks salvaged(std::make_shared<MemorySource>(bytes));
  EXPECT_EQ(salvaged.lost(), one);
  EXPECT_FALSE(salvaged.is_damaged_elsewhere());
}

TEST_F(ProtectedTag, ReadersRefuseOtherBytesBehindTheFooter) {
  const auto refused = [&](const std::string& bytes) {
    write_content(path("bad.tag"), bytes);
    EXPECT_THROW(TagReader(path("bad.tag")).read_to_end(), BrokenInput);
    EXPECT_THROW(TagBricks(std::make_shared<MemorySource>(bytes)), BrokenInput);
  };
  refused(plain_ + "x");
  refused(whole_ + "x");
  for (std::size_t size = plain_.size() + 1; size < whole_.size(); size += 997)
    refused(whole_.substr(0, size));
  refused(whole_.substr(0, whole_.size() - 1));
  // The parity of another file.
  std::string other = whole_;
  other.insert(plain_.size(), 1, 'x');
  refused(other);
  other = whole_;
  other.erase(plain_.size() - 1, 1);
  refused(other);
}

TEST_F(ProtectedTag, TheSameBytesForAnyThreadsRanksAndMemory) {
  make_volume();
  for (const int threads : {1, 2, 4}) {
    Resources resources(threads);
    if (threads == 1) resources.memory = std::uint64_t{20} << 20;
    Ranks alone;
    committed(tagrid::encode_volume(alone, run("b.tag", true, resources)));
    EXPECT_TRUE(content("b.tag") == whole_) << threads;
    committed(encode_in_parts(alone, run("parts.tag", true, resources)));
    EXPECT_TRUE(content("parts.tag") == whole_) << threads;
  }
}

}  // namespace
}  // namespace tagrid
