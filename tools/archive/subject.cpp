#include "tools/archive/subject.h"

#include <algorithm>
#include <cstddef>

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
  const std::array texts = {&subject.patient,           &subject.patient_id, &subject.study,
                            &subject.study_description, &subject.study_date, &subject.series,
                            &subject.modality};
  static_assert(texts.size() == keys_of_subjects.size());
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < texts.size(); ++i)
    if (!texts[i]->empty()) json[keys_of_subjects[i]] = text_of_name(*texts[i]);
  return json;
}

}  // namespace tagrid
