#include "tools/archive/subject.h"

#include <algorithm>
#include <utility>

#include "io/text/text.h"

namespace tagrid {

std::string iso_date(const std::string& text) {
  if (text.size() != 8 || !std::ranges::all_of(text, is_digit)) return text;
  return text.substr(0, 4) + "-" + text.substr(4, 2) + "-" + text.substr(6);
}

Subject subject_of(const Metadata& metadata) {
  const auto pair = [&](const char* key) { return metadata.text_of(std::string("dicom_") + key); };
  return {.patient = pair("PatientName"),
          .patient_id = pair("PatientID"),
          .study = pair("StudyInstanceUID"),
          .study_description = pair("StudyDescription"),
          .study_date = iso_date(pair("StudyDate")),
          .series = pair("SeriesInstanceUID"),
          .modality = pair("Modality")};
}

nlohmann::ordered_json json_of(const Subject& subject) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const auto& [key, text] : {std::pair("patient", &subject.patient),
                                  {"patient_id", &subject.patient_id},
                                  {"study", &subject.study},
                                  {"study_description", &subject.study_description},
                                  {"study_date", &subject.study_date},
                                  {"series", &subject.series},
                                  {"modality", &subject.modality}})
    if (!text->empty()) json[key] = text_of_name(*text);
  return json;
}

}  // namespace tagrid
