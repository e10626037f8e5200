// A text with some parts replaced.
#pragma once

#include <string>
#include <string_view>

namespace tagrid {

class TextChanges {
 public:
  /// `text` must outlive this.
  explicit TextChanges(std::string_view text) : text_(text) {}

  /// Replaces a part of the text. REQUIRES: parts are replaced from front to back.
  void replace(std::string_view part, std::string_view by) {
    const auto begin = static_cast<std::size_t>(part.data() - text_.data());
    changed_.append(text_.substr(done_, begin - done_)).append(by);
    done_ = begin + part.size();
  }
  /// The entire text. To be called once.
  std::string finish() { return std::move(changed_.append(text_.substr(done_))); }

 private:
  std::string_view text_;
  std::size_t done_ = 0;  ///< bytes of the text that are in changed_, or replaced there
  std::string changed_;
};

}  // namespace tagrid
