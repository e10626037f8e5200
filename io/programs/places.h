// Where samples lie, according to readers; docs/readers.md specifies it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "io/programs/answers.h"
#include "io/programs/reader_conversation.h"
#include "io/volume/slice_run.h"
#include "io/volume/volume_info.h"

namespace tagrid {

// All of these throw WrongAnswer.

/// The places of all slices of a volume in its `files`; none if the reader gives them.
std::vector<SliceRun> places_in(const Json& answer, const VolumeInfo& info, std::size_t files);
/// The plain form of the file with this number.
ReaderPlainFile plain_file_in(const Json& answer, std::size_t file, std::size_t files,
                              const VolumeInfo& info);
/// The runs from front to back. They must be `slices` slices.
std::vector<SliceRun> in_order(std::vector<NumberedRun> runs, std::int64_t slices);

/// The other side of the conversation.
nlohmann::ordered_json json_of(const SliceRun& run);
nlohmann::ordered_json json_of(const ReaderPlainFile& file);

}  // namespace tagrid
