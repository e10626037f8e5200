// Notes about a file, besides errors.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

namespace tagrid {

/// A sentence without a full stop and without the name of the file. Files of a series mostly have the same
/// ones; those about one thing are reported once.
struct DicomNote {
  std::string about;  ///< "RescaleSlope"
  std::string text;   ///< "RescaleSlope is empty; ..."
};

struct DicomNotes {
  std::vector<DicomNote> warnings;
  /// Those after which a lossy encoding must not replace the file; see SourceFacts.
  std::vector<DicomNote> not_understood;
  /// Those that leave the values of samples unknown.
  std::vector<DicomNote> scale_doubts;

  /// Adds a note, unless there is one about the same thing.
  static void add(std::vector<DicomNote>& notes, std::string about, std::string text) {
    if (std::ranges::find(notes, about, &DicomNote::about) == notes.end())
      notes.push_back({std::move(about), std::move(text)});
  }
};

}  // namespace tagrid
