#include "tools/catalogue/facts.h"

#include <algorithm>
#include <memory>

#include "io/files/file_bytes.h"
#include "io/tag/bricks.h"
#include "stages/grid/box.h"
#include "tools/report/info.h"
#include "tools/report/report.h"

namespace tagrid {

using nlohmann::ordered_json;

std::string iso_date(const std::string& text) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  if (text.size() != 8 || !std::ranges::all_of(text, is_digit)) return text;
  return text.substr(0, 4) + "-" + text.substr(4, 2) + "-" + text.substr(6);
}

FileFacts facts_of(const std::string& path) {
  const TagBricks file(std::make_shared<FileSource>(path));
  const TagHeader& header = file.header();
  const CodingParameters& p = header.parameters;
  const Metadata& metadata = header.metadata;
  const auto pair = [&](const char* key) { return metadata.text_of(std::string("dicom_") + key); };
  FileFacts facts;
  facts.patient = pair("PatientName");
  facts.patient_id = pair("PatientID");
  facts.study = pair("StudyInstanceUID");
  facts.study_description = pair("StudyDescription");
  facts.study_date = iso_date(pair("StudyDate"));
  facts.modality = pair("Modality");
  facts.series = pair("SeriesInstanceUID");
  facts.type = name_of(p.type);
  if (p.max_error >= 0) facts.bound = p.max_error;
  facts.voxels = static_cast<std::uint64_t>(Box::of_size(header.all_dims()).count());
  facts.raw_bytes = facts.voxels * size_of(p.type);
  facts.more = contents_json(header, file.index().total);
  return facts;
}

}  // namespace tagrid
