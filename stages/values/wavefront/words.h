// Where the words of eight lanes are: the states of some lanes give out a word, or take one in.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

namespace tagrid {

/// Numbers of bytes of a vector, by the set of lanes. Taking in: word n goes to the n-th lane of the set.
/// Giving out: the words of the set go to the end of the vector, in the order of the lanes.
struct WordTables {
  std::uint8_t taken[256][16], given[256][16];
};
constexpr WordTables make_word_tables() {
  WordTables w{};
  for (int set = 0; set < 256; ++set) {
    int n = 0;
    for (int i = 0; i < 8; ++i) n += set >> i & 1;
    int at = 0;
    for (int i = 0; i < 16; ++i) w.given[set][i] = 0x80;
    for (int i = 0; i < 8; ++i) {
      const bool in = set >> i & 1;
      w.taken[set][2 * i] = static_cast<std::uint8_t>(in ? 2 * at : 0x80);
      w.taken[set][2 * i + 1] = static_cast<std::uint8_t>(in ? 2 * at + 1 : 0x80);
      if (!in) continue;
      w.given[set][2 * (8 - n + at)] = static_cast<std::uint8_t>(2 * i);
      w.given[set][2 * (8 - n + at) + 1] = static_cast<std::uint8_t>(2 * i + 1);
      ++at;
    }
  }
  return w;
}
alignas(64) inline constexpr WordTables word_tables = make_word_tables();

/// Words that are given out from the last to the first.
class WordsBackward {
 public:
  static constexpr std::size_t chunk_size = 16384;
  /// What a step of sixteen lanes may give out, and what a vector writes below it.
  static constexpr std::size_t most_at_once = 32;

  /// The word before which the next ones are written. There is room for a step.
  std::uint16_t*& room() {
    if (chunks_.empty() || static_cast<std::size_t>(first_ - chunks_.back().get()) < most_at_once)
      begin_chunk();
    return first_;
  }
  std::size_t size() const {
    std::size_t words = full_;
    if (!chunks_.empty()) words += static_cast<std::size_t>(chunks_.back().get() + chunk_size - first_);
    return words;
  }
  /// In the order of reading.
  void copy_to(std::uint16_t* to) {
    if (chunks_.empty()) return;
    begins_.push_back(first_);
    for (std::size_t i = chunks_.size(); i-- > 0;) {
      const auto count = static_cast<std::size_t>(chunks_[i].get() + chunk_size - begins_[i]);
      std::memcpy(to, begins_[i], count * sizeof *to);
      to += count;
    }
    begins_.pop_back();
  }

 private:
  void begin_chunk() {
    if (!chunks_.empty()) {
      begins_.push_back(first_);
      full_ += static_cast<std::size_t>(chunks_.back().get() + chunk_size - first_);
    }
    chunks_.push_back(std::make_unique_for_overwrite<std::uint16_t[]>(chunk_size));
    first_ = chunks_.back().get() + chunk_size;
  }

  std::vector<std::unique_ptr<std::uint16_t[]>> chunks_;
  std::vector<std::uint16_t*> begins_;  ///< of all chunks but the last
  std::uint16_t* first_ = nullptr;
  std::size_t full_ = 0;
};

}  // namespace tagrid
