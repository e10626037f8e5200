// What runs report on a volume and its .tag file, for people and for scripts.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "pipeline/run/run.h"

namespace tagrid {

/// One line on an encoding: size, ratio, bits per voxel, largest error.
std::string summary(const EncodeResult& result);
/// One line on a decoding: sizes, the ratio if it is that of these sizes, and the largest error in the file.
std::string summary(const DecodeResult& result);

/// One line on memory: the planned and the used amount, and how often samples were read, if that matters.
std::string memory_summary(std::uint64_t planned, std::optional<double> times_read = std::nullopt);

/// The lines of a table of the processor time that the nodes of the flow graphs took, and how many times as fast as
/// one thread 16 and 64 threads could be at most, as some nodes run on one thread at a time.
std::vector<std::string> times_summary(const TagHeader& header);

/// An error of samples: "2", "2 HU", "2 in stored samples (5 HU)", as the volume says what samples mean; if slices have
/// individual slopes, "2 in stored samples (at most 5 in values)".
std::string error_text(double error, const TagHeader& header);
/// The same of a sample.
std::string sample_text(double sample, const TagHeader& header);

/// "space left-posterior-superior, in mm": in which coordinates a mesh or a surface lies.
std::string coordinates_text(const TagHeader& header);
/// True if the slices of the source lie at unequal distances.
bool has_uneven_slices(const TagHeader& header);

/// Says that the samples span far more or far less than the usual range of their type, for which the grid was made: it
/// may be too fine, or miss detail. "" if they do not, or if another range was chosen.
std::string doubt_of_range(const TagHeader& header, const Statistics& total);

/// JSON as it is written to files and to standard output: on one line, or with lines indented by `indent` columns.
/// Bytes that are not UTF-8 become U+FFFD. Characters on which a terminal would act are escaped (\u009b): the text
/// can be shown, and its values are the same.
std::string written_json(const nlohmann::ordered_json& json, int indent = -1);

/// `bytes` as text that JSON can hold, as file names may contain any bytes.
std::string json_text(const std::string& bytes);
/// The same; null if there are none.
nlohmann::ordered_json json_text_or_null(const std::string& bytes);

}  // namespace tagrid
