// How values follow from samples.
#pragma once

#include "io/volume/volume_info.h"
#include "tools/formats/dicom/attributes.h"

namespace tagrid {

/// Changes `rescale` as far as the item says something about it.
void read_rescale(DcmItem& item, Rescale& rescale, DicomNotes& notes);

/// The dose that a sample of 1 means. A scale that is 0 or absent gives 0.
Rescale rescale_of_dose(DcmDataset& dataset, DicomNotes& notes);

/// Notes values that do not follow from samples by `rescale`, but by a table or a real world value mapping.
void note_tables(DcmItem& dataset, DicomNotes& notes);
void note_real_world_values(DcmItem& item, const Rescale& rescale, DicomNotes& notes);

}  // namespace tagrid
