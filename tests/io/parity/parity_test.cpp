// Laws of parity: what the promise names always comes back; anything else is refused, never repaired wrongly.
#include "io/parity/parity.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <random>

#include "io/errors/errors.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

using Bytes = std::vector<std::byte>;
using Random = std::mt19937_64;

class BytesInMemory : public ByteSource {
 public:
  explicit BytesInMemory(Bytes bytes) : bytes_(std::move(bytes)) {}
  std::uint64_t size() const override { return bytes_.size(); }
  void read_at(std::uint64_t position, std::span<std::byte> to) const override {
    std::memcpy(to.data(), bytes_.data() + position, to.size());
  }
  const std::string& name() const override { return name_; }

 private:
  std::string name_ = "memory";
  Bytes bytes_;
};

WriteAt into(Bytes& bytes) {
  return [&bytes](std::uint64_t position, std::span<const std::byte> part) {
    if (bytes.size() < position + part.size()) bytes.resize(position + part.size());
    std::ranges::copy(part, bytes.begin() + static_cast<std::ptrdiff_t>(position));
  };
}

std::uint64_t below(Random& random, std::uint64_t end) { return random() % end; }

Bytes random_bytes(Random& random, std::size_t size) {
  Bytes bytes(size);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
  return bytes;
}

Bytes with_parity_after(const Bytes& file, ParityShare share, std::uint64_t memory = usual_parity_memory) {
  Bytes all = file;
  const std::uint64_t end = write_parity(BytesInMemory(file), share, file.size(), into(all), memory);
  EXPECT_EQ(end, all.size());
  return all;
}

struct Repaired {
  bool found = false;
  ParityCondition condition;
  Bytes bytes;
};

Repaired repaired(const Bytes& damaged, const Bytes* beside = nullptr) {
  const auto file = ProtectedFile::find(std::make_shared<BytesInMemory>(damaged),
                                        beside ? std::make_shared<BytesInMemory>(*beside) : nullptr);
  Repaired result;
  if (!file) return result;
  result.found = true;
  result.condition = file->repair(into(result.bytes), 1 << 20);
  const ParityCondition seen = file->survey(1 << 16);
  EXPECT_EQ(seen.damaged, result.condition.damaged);
  EXPECT_EQ(seen.is_repairable(), result.condition.is_repairable());
  return result;
}

void damage(Random& random, Bytes& bytes, std::uint64_t begin, std::uint64_t end) {
  for (std::uint64_t i = begin; i < std::min<std::uint64_t>(end, bytes.size()); ++i)
    bytes[i] = static_cast<std::byte>(random());
}

/// Sizes at which blocks, stripes and groups of pages begin: one stripe, several, a last block that is short.
struct Example {
  Bytes whole;
  ParityLayout layout;
};
std::vector<Example> examples() {
  Random random(1);
  std::vector<Example> all;
  for (const auto& [size, share] : {std::pair<std::size_t, ParityShare>{1, 5000},
                                    {511, 5000},
                                    {5'000, 20'000},
                                    {40'001, 5'000},
                                    {130'000, 100'000},
                                    {262'143, 10'000},
                                    {300'000, 1'000},
                                    {130'560, 3'000}}) {
    const Bytes file = random_bytes(random, size);
    Bytes all_bytes = with_parity_after(file, share);
    const auto layout = parity_at_end(BytesInMemory(all_bytes));
    EXPECT_TRUE(layout.has_value());
    all.push_back({std::move(all_bytes), *layout});
  }
  return all;
}

/// Where the aligned units of a file lie: blocks, pages and parity.
std::vector<std::uint64_t> units(const ParityLayout& layout) {
  std::vector<std::uint64_t> places;
  for (std::uint64_t i = 0; i < layout.blocks(); ++i) places.push_back(i << layout.log2_block);
  for (std::uint64_t p = layout.first_unit(layout.file_size); p < layout.foot(layout.file_size);
       p += layout.block_size())
    places.push_back(p);
  return places;
}

/// Damages every example in many ways, and expects that it comes back.
void expect_whole_after(unsigned seed,
                        const std::function<void(Random&, int, const ParityLayout&, Bytes&)>& spoil) {
  const auto all = examples();
  Random random(seed);
  for (int i = 0; i < damaged_files(); ++i) {
    const Example& example = all[static_cast<std::size_t>(i) % all.size()];
    Bytes bytes = example.whole;
    spoil(random, i, example.layout, bytes);
    const Repaired result = repaired(bytes);
    ASSERT_TRUE(result.found) << i;
    ASSERT_TRUE(result.condition.is_repairable()) << i;
    ASSERT_EQ(result.bytes, example.whole) << i;
  }
}

TEST(Parity, ShareIsKept) {
  for (const Example& example : examples()) {
    const ParityLayout& layout = example.layout;
    EXPECT_TRUE(layout.is_valid());
    EXPECT_GE(layout.parity_blocks() * 100'000, layout.blocks() * layout.share);
    EXPECT_EQ(layout.end(layout.file_size), example.whole.size());
    EXPECT_LE(layout.data() + layout.parity, 255);
  }
}

TEST(Parity, BytesDoNotDependOnMemory) {
  Random random(2);
  const Bytes file = random_bytes(random, 700'000);
  EXPECT_EQ(with_parity_after(file, 5000, 0), with_parity_after(file, 5000));
  EXPECT_EQ(with_parity_after(file, 5000, 1 << 19), with_parity_after(file, 5000));
}

TEST(Parity, AnyBlocksUpToThePromiseComeBack) {
  expect_whole_after(3, [](Random& random, int, const ParityLayout& layout, Bytes& bytes) {
    auto places = units(layout);
    std::ranges::shuffle(places, random);
    const std::uint64_t count = std::min<std::uint64_t>(places.size(), layout.parity);
    for (std::uint64_t k = 0; k < count; ++k)
      damage(random, bytes, places[k],
             std::min(places[k] + layout.block_size(),
                      places[k] < layout.file_size ? layout.file_size : bytes.size()));
  });
}

TEST(Parity, AnyBurstUpToThePromiseComesBack) {
  expect_whole_after(4, [](Random& random, int, const ParityLayout& layout, Bytes& bytes) {
    const std::uint64_t length = layout.burst(),
                        begin =
                            below(random, bytes.size() - std::min<std::uint64_t>(length, bytes.size() - 1));
    damage(random, bytes, begin, begin + length);
  });
}

TEST(Parity, EndsThatAreCutOrOverwrittenComeBack) {
  expect_whole_after(5, [](Random& random, int i, const ParityLayout& layout, Bytes& bytes) {
    const std::uint64_t length = below(random, layout.burst() + 1);
    if (i % 3 == 0)
      damage(random, bytes, 0, length);  // the header
    else if (i % 3 == 1)
      bytes.resize(bytes.size() - length);
    else
      damage(random, bytes, bytes.size() - length, bytes.size());
  });
}

TEST(Parity, FlippedBitsInDescriptionsComeBack) {
  expect_whole_after(6, [](Random& random, int, const ParityLayout& layout, Bytes& bytes) {
    const std::uint64_t base = layout.file_size;
    // One of the promise is left for head and foot, which are in no stripe.
    for (int k = 0; k < layout.parity; ++k) {
      const std::uint64_t page = below(random, layout.all_pages());
      const std::uint64_t places[] = {base, layout.foot(base), layout.place_of_page(base, page)};
      bytes[places[below(random, 3)] + below(random, 48)] ^= std::byte{1} << below(random, 8);
    }
  });
}

TEST(Parity, BeyondThePromiseNothingIsWrong) {
  const auto all = examples();
  Random random(7);
  int refused = 0;
  for (int i = 0; i < damaged_files(); ++i) {
    const Example& example = all[static_cast<std::size_t>(i) % all.size()];
    Bytes bytes = example.whole;
    const int count = 1 + static_cast<int>(below(random, 40));
    for (int k = 0; k < count; ++k) {
      const std::uint64_t begin = below(random, bytes.size());
      damage(random, bytes, begin, begin + 1 + below(random, 1 + bytes.size() / 8));
    }
    if (i % 4 == 0) bytes.resize(below(random, bytes.size()) + 1);
    const Repaired result = repaired(bytes);
    if (result.found && result.condition.is_repairable()) {
      ASSERT_EQ(result.bytes, example.whole) << i;
    } else {
      ++refused;
    }
  }
  EXPECT_GT(refused, damaged_files() / 4);
}

TEST(Parity, BesideTheFile) {
  Random random(8);
  const Bytes file = random_bytes(random, 300'000);
  Bytes parity;
  write_parity(BytesInMemory(file), 5000, 0, into(parity));
  const ParityLayout layout = ParityLayout::of(file.size(), 5000);
  for (int i = 0; i < damaged_files() / 10; ++i) {
    Bytes damaged = file, damaged_parity = parity;
    const std::uint64_t begin = below(random, file.size() - layout.burst());
    if (i % 3 == 0)
      damaged.resize(file.size() - layout.burst());
    else
      damage(random, damaged, begin, begin + layout.burst());
    if (i % 2 == 0) damage(random, damaged_parity, 0, 500);
    if (i % 5 == 0) damaged_parity.resize(parity.size() - 500);
    const Repaired result = repaired(damaged, &damaged_parity);
    ASSERT_TRUE(result.found && result.condition.is_repairable()) << i;
    ASSERT_EQ(result.bytes, file) << i;
  }
}

TEST(Parity, AnIntactFileIsIntact) {
  for (const Example& example : examples()) {
    const Repaired result = repaired(example.whole);
    EXPECT_TRUE(result.condition.is_intact());
    EXPECT_EQ(result.bytes, example.whole);
  }
}

// A description that claims a huge file must take neither memory nor time.
TEST(Parity, FalseDescriptionsAreRefused) {
  Random random(9);
  const Bytes file = random_bytes(random, 40'000);
  for (int i = 0; i < damaged_files(); ++i) {
    ParityLayout layout =
        ParityLayout::of(1 + (random() >> below(random, 64)) % (std::uint64_t{1} << 54), 5000);
    layout.stripes ^= static_cast<std::uint32_t>(random() >> below(random, 64)) & (i % 2 ? ~0U : 0U);
    if (!layout.is_valid()) continue;
    Bytes bytes = file;
    const auto foot = serialize_description(layout, i % 3 ? foot_number : head_number, {});
    bytes.insert(bytes.end(), foot.begin(), foot.end());
    const Repaired result = repaired(bytes, &foot);
    EXPECT_FALSE(result.found && result.condition.is_repairable() && result.bytes == bytes);
  }
}

TEST(Parity, DescriptionsOfOtherFilesAreNotMixed) {
  Random random(10);
  const Bytes one = with_parity_after(random_bytes(random, 100'000), 5000),
              other = with_parity_after(random_bytes(random, 100'000), 5000);
  const auto layout = parity_at_end(BytesInMemory(one));
  Bytes bytes = one;
  const auto place = static_cast<std::ptrdiff_t>(layout->place_of_page(100'000, 0));
  std::copy_n(other.begin() + place, layout->block_size(), bytes.begin() + place);
  const Repaired result = repaired(bytes);
  EXPECT_TRUE(result.condition.is_repairable());
  EXPECT_EQ(result.condition.damaged_parity, 1U);
  EXPECT_EQ(result.bytes, one);
}

TEST(Parity, SharesAreWrittenAsTheyWereGiven) {
  EXPECT_EQ(text_of_share(5000), "5 %");
  EXPECT_EQ(text_of_share(12'500), "12.5 %");
  EXPECT_EQ(text_of_share(100), "0.1 %");
}

}  // namespace
}  // namespace tagrid
