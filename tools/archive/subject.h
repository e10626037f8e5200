// Whom and what a volume shows, as headers of DICOM say.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <string>

#include "io/metadata/metadata.h"

namespace tagrid {

/// Texts of a DICOM header; "" if unknown.
struct Subject {
  std::string patient, patient_id, study, study_description, study_date, series, modality;
};

/// Dates are written as 2020-01-31 if they are valid.
Subject subject_of(const Metadata& metadata);

inline constexpr std::array keys_of_subjects = {"patient",    "patient_id", "study",   "study_description",
                                                "study_date", "series",     "modality"};

/// The members that are known, by their names, which are keys_of_subjects.
nlohmann::ordered_json json_of(const Subject& subject);

/// A date of DICOM, "20200131", as "2020-01-31"; other texts as they are.
std::string iso_date(const std::string& text);

}  // namespace tagrid
