#include "tools/formats/dicom/rescaling.h"

#include <fmt/format.h>

#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr const char* as_stored = "samples are kept as they are stored";

void doubt(const DcmTagKey& tag, const std::string& text, DicomNotes& notes) {
  DicomNotes::add(notes.scale_doubts, name_of(tag), text);
}

/// Notes a number that cannot be read, or that is 0 where it must not be.
bool is_doubtful(const ForeignNumber& number, const DcmTagKey& tag, bool may_be_zero, DicomNotes& notes) {
  if (number.is_unreadable())
    doubt(tag, remark_on(number, name_of(tag), as_stored), notes);
  else if (number.is_number() && number.value == 0 && !may_be_zero)
    doubt(tag, fmt::format("{} is 0, which would make all values equal; {}", name_of(tag), as_stored), notes);
  else
    return false;
  return true;
}

void note_missing(const DcmTagKey& tag, const DcmTagKey& other, double taken_as, DicomNotes& notes) {
  DicomNotes::add(notes.not_understood, name_of(tag),
                  fmt::format("{} is absent although there is a {}; it is taken as {}", name_of(tag),
                              name_of(other), taken_as));
}

}  // namespace

void read_rescale(DcmItem& item, Rescale& rescale, DicomNotes& notes) {
  if (auto type = text_of(item, DCM_RescaleType); type && *type != "US") rescale.units = *type;
  const ForeignNumber slope = number_in(item, DCM_RescaleSlope);
  const ForeignNumber intercept = number_in(item, DCM_RescaleIntercept);
  if (slope.is_absent() && intercept.is_absent()) return;
  const bool has_doubt = static_cast<int>(is_doubtful(slope, DCM_RescaleSlope, false, notes)) +
                             static_cast<int>(is_doubtful(intercept, DCM_RescaleIntercept, true, notes)) >
                         0;
  if (has_doubt) {
    rescale = {};
    return;
  }
  remark(slope, DCM_RescaleSlope, "", notes);
  remark(intercept, DCM_RescaleIntercept, "", notes);
  if (slope.is_absent()) note_missing(DCM_RescaleSlope, DCM_RescaleIntercept, rescale.slope, notes);
  if (intercept.is_absent()) note_missing(DCM_RescaleIntercept, DCM_RescaleSlope, rescale.intercept, notes);
  rescale.slope = slope.value_or(rescale.slope);
  rescale.intercept = intercept.value_or(rescale.intercept);
}

Rescale rescale_of_dose(DcmDataset& dataset, DicomNotes& notes) {
  std::string units = text_of(dataset, DCM_DoseUnits).value_or("");
  if (units == "GY") units = "Gy";
  const ForeignNumber scale = number_in(dataset, DCM_DoseGridScaling);
  remark(scale, DCM_DoseGridScaling, "doses have no scale", notes);
  return {scale.value_or(0), 0, lower_case(units) == "relative" ? "" : units};
}

void note_tables(DcmItem& dataset, DicomNotes& notes) {
  if (item_in(dataset, DCM_ModalityLUTSequence) != nullptr)
    doubt(DCM_ModalityLUTSequence,
          fmt::format("values follow from samples by a table (ModalityLUTSequence), which is not applied; {}",
                      as_stored),
          notes);
}

void note_real_world_values(DcmItem& item, const Rescale& rescale, DicomNotes& notes) {
  DcmItem* map = item_in(item, DCM_RealWorldValueMappingSequence);
  if (map == nullptr) return;
  if (map->tagExists(DCM_RealWorldValueLUTData)) {
    DicomNotes::add(notes.not_understood, "RealWorldValueLUTData",
                    "it has a table of real world values (RealWorldValueLUTData), which is not applied");
    return;
  }
  const ForeignNumber slope = number_in(*map, DCM_RealWorldValueSlope);
  const ForeignNumber intercept = number_in(*map, DCM_RealWorldValueIntercept);
  if (slope.value_or(1) == rescale.slope && intercept.value_or(0) == rescale.intercept) return;
  DicomNotes::add(
      notes.not_understood, "RealWorldValueMappingSequence",
      fmt::format("its real world values are {} * sample + {} (RealWorldValueMappingSequence), which is not "
                  "applied: values are {} * sample + {}",
                  slope.text, intercept.text, rescale.slope, rescale.intercept));
}

}  // namespace tagrid
