// What a volume loses in files of other formats, in words.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "io/formats/table/formats.h"
#include "io/metadata/loss.h"
#include "io/text/text.h"
#include "io/volume/given_spacing.h"

namespace tagrid {
namespace {

/// True for pairs that say nothing more: their content is in the samples and in the geometry, or belongs to
/// one kind of files.
bool is_said_otherwise(std::string_view key, std::string_view value, const Format& format) {
  constexpr std::array<std::string_view, 18> said = {"rescale_",
                                                     "applied_",
                                                     "slice_applied_",
                                                     "slice_positions",
                                                     "slice_slopes",
                                                     "slice_intercepts",
                                                     "dicom_added_intercept",
                                                     given_spacing_key,
                                                     "hdf5_dataset",
                                                     "hdf5_element_size_um",
                                                     "metaimage_AnatomicalOrientation",
                                                     "nifti_pixdim",
                                                     "nifti_scl_",
                                                     "nifti_qoffset_",
                                                     "nifti_quatern_",
                                                     "nifti_qform_",
                                                     "nifti_sform_",
                                                     "nifti_srow_"};
  if (key == lossy_source_key) return format.keeps.loss;
  const auto begins = [&](std::string_view beginning) { return key.starts_with(beginning); };
  // ITK writes it into every file.
  if (key == "metaimage_CenterOfRotation" &&
      std::ranges::all_of(words_of(value), [](auto word) { return number_of(word) == 0.0; }))
    return true;
  return begins("vdb_") || std::ranges::any_of(said, begins) ||
         (!format.keeps.own_pairs.empty() && begins(format.keeps.own_pairs));
}

/// False for the two lines that NRRD's own library puts into every header.
bool is_remark(std::string_view comment) {
  return !trimmed(comment).empty() && comment.find("NRRD file format specification") == comment.npos &&
         comment.find("teem.sourceforge.net/nrrd/format") == comment.npos;
}

/// True for the unit that values of CT have everywhere.
bool is_usual_unit(std::string_view unit) { return trimmed(unit) == "HU"; }

/// True if a file of the format has no place for the unit of values.
bool loses_unit(const Format& format, const VolumeInfo& info) {
  return !format.keeps.header && !format.keeps.units(info);
}

/// True for what the reader of DICOM notes for each series.
bool is_of_dicom(std::string_view key) {
  return key.starts_with("dicom_") || key == "slice_sop_instance_uids";
}

/// "2 key/value pairs ("owner", "year")"
std::string in_words(const std::vector<std::string>& keys, std::string_view one, std::string_view several) {
  constexpr std::size_t most = 3;
  std::vector<std::string> shown;
  for (std::size_t i = 0; i < std::min(keys.size(), most); ++i)
    shown.push_back(quoted(std::string_view(keys[i])));
  return fmt::format("{} {} ({}{})", keys.size(), keys.size() == 1 ? one : several, fmt::join(shown, ", "),
                     keys.size() > most ? ", ..." : "");
}

std::string no_place_for(const Format& format, const std::string& what) {
  return fmt::format("{} files have no place for {}; the .tag file and .nrrd files have them",
                     format.extensions.front(), what);
}

/// The texts of a header that a file of the format loses, in words; "" if it keeps all of them.
std::string lost_texts(const Format& format, const VolumeInfo& info) {
  std::vector<std::string> keys, others;
  for (const auto& [key, value] : info.metadata.pairs())
    if (!is_said_otherwise(key, value, format) && !is_of_dicom(key)) keys.push_back(key);
  bool has_comments = false;
  for (const MetadataEntry& entry : info.metadata.entries()) {
    has_comments =
        has_comments || (entry.kind == MetadataEntry::Kind::comment && is_remark(entry.line.substr(1)));
    for (const std::string_view field :
         {"content", "labels", "thicknesses", "sample units", "measurement frame"})
      if (entry.field == field) others.push_back(fmt::format("the field {}", quoted(field)));
  }
  if (has_comments) others.emplace_back("comments");
  if (!keys.empty()) others.insert(others.begin(), in_words(keys, "key/value pair", "key/value pairs"));
  return others.empty() ? "" : no_place_for(format, fmt::format("{}", fmt::join(others, ", ")));
}

}  // namespace

std::string usual_losses(const Format& format, const VolumeInfo& info) {
  if (!format.keeps.slices_are_alike || format.keeps.header) return "";
  std::vector<std::string> keys, lost;
  for (const auto& [key, value] : info.metadata.pairs()) {
    if (!is_said_otherwise(key, value, format) && is_of_dicom(key)) keys.push_back(key);
    if (key == "rescale_units" && is_usual_unit(value) && loses_unit(format, info))
      lost.emplace_back("the unit of values (HU)");
  }
  if (!keys.empty()) lost.insert(lost.begin(), in_words(keys, "attribute of DICOM", "attributes of DICOM"));
  return lost.empty() ? "" : no_place_for(format, fmt::format("{}", fmt::join(lost, ", ")));
}

std::vector<std::string> losses(const Format& format, const VolumeInfo& info) {
  std::vector<std::string> all = format.keeps.lost(info);
  if (!format.keeps.slices_are_alike) return all;
  if (!format.keeps.header)
    if (std::string texts = lost_texts(format, info); !texts.empty()) all.push_back(std::move(texts));
  std::vector<std::string> differences;
  for (const auto& [key, value] : info.metadata.pairs()) {
    // On its own: whoever measures in the file measures wrong.
    if (key == "slice_positions")
      all.push_back(
          fmt::format("slices lie at unequal distances (slice_positions), but {} stores one distance, so its "
                      "slices are not where those of the scan are; the .tag file and .nrrd files have them",
                      format.name));
    if (key == "slice_slopes") differences.emplace_back("slices have individual slopes (slice_slopes)");
    if (key == "rescale_units" && !is_usual_unit(value) && loses_unit(format, info))
      differences.push_back(fmt::format("values are in {} (rescale_units)", quoted(std::string_view(value))));
  }
  if (!differences.empty())
    all.push_back(fmt::format(
        "{}, which {} cannot hold; the .tag file and .nrrd files have them{}",
        fmt::join(differences, ", and "), format.name,
        info.metadata.has_slopes_of_slices() ? "; the values in this file are the stored samples" : ""));
  return all;
}

}  // namespace tagrid
