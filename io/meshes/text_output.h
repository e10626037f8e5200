// Text files with many numbers.
#pragma once

#include <fmt/compile.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "io/files/output_file.h"

namespace tagrid {

/// Writes text through a buffer of a fixed size.
class TextOutput {
 public:
  explicit TextOutput(OutputFile& output) : output_(output), buffer_(std::size_t{1} << 18) {}

  void put(std::string_view text) {
    while (!text.empty()) {
      make_room();
      const std::size_t size = std::min(text.size(), most_at_once);
      std::copy_n(text.begin(), size, buffer_.begin() + static_cast<std::ptrdiff_t>(end_));
      end_ += size;
      text.remove_prefix(size);
    }
  }
  void put(char c) {
    make_room();
    buffer_[end_++] = c;
  }
  void put(std::int64_t number) {
    make_room();
    end_ = static_cast<std::size_t>(fmt::format_to(buffer_.data() + end_, FMT_COMPILE("{}"), number) -
                                    buffer_.data());
  }
  /// As many digits as lead back to the same number.
  void put(double number) {
    make_room();
    end_ = static_cast<std::size_t>(fmt::format_to(buffer_.data() + end_, FMT_COMPILE("{}"), number) -
                                    buffer_.data());
  }
  /// The same, or fewer digits if these are more than `most` characters, at least 8.
  void put(double number, std::size_t most) {
    const std::size_t begin = end_ < buffer_.size() - most_at_once ? end_ : 0;
    put(number);
    for (int digits = 16; end_ - begin > most && digits > 0; --digits)
      end_ = static_cast<std::size_t>(
          fmt::format_to(buffer_.data() + begin, FMT_COMPILE("{:.{}g}"), number, digits) - buffer_.data());
  }
  /// Numbers with `separator` between them.
  void put(std::span<const std::int64_t> numbers, char separator) {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (i > 0) put(separator);
      put(numbers[i]);
    }
  }
  void flush() {
    output_.write(std::string_view(buffer_.data(), end_));
    end_ = 0;
  }

 private:
  static constexpr std::size_t most_at_once = 1 << 12;

  void make_room() {
    if (end_ >= buffer_.size() - most_at_once) flush();
  }

  OutputFile& output_;
  std::vector<char> buffer_;
  std::size_t end_ = 0;  ///< of what waits
};

}  // namespace tagrid
