#include "io/formats/dicom/reader/moments.h"

#include <algorithm>
#include <array>

#include "io/formats/dicom/reader/attributes.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

enum class Kind : std::uint8_t {
  of_volume,     ///< the same for all slices of a volume
  of_vector,     ///< likewise; one value a frame, in one list
  of_dimension,  ///< likewise; one of the values of an attribute
  of_setup,      ///< the same for all slices of a volume, but not part of its name
  growing        ///< may differ from slice to slice
};

struct Row {
  DcmTagKey tag;
  std::string_view name;
  Kind kind = Kind::of_volume;
};

const std::array rows = {
    Row{DCM_TemporalPositionIndex, "TemporalPositionIndex"},
    Row{DCM_TemporalPositionIdentifier, "TemporalPositionIdentifier"},
    Row{DCM_EchoNumbers, "EchoNumbers"},
    Row{DCM_AcquisitionNumber, "AcquisitionNumber"},
    Row{DCM_EchoTime, "EchoTime"},
    Row{DCM_EffectiveEchoTime, "EffectiveEchoTime"},
    Row{DCM_DiffusionBValue, "DiffusionBValue"},
    Row{DCM_DiffusionGradientOrientation, "DiffusionGradientOrientation"},
    Row{DCM_NominalPercentageOfCardiacPhase, "NominalPercentageOfCardiacPhase"},
    Row{DCM_NominalCardiacTriggerDelayTime, "NominalCardiacTriggerDelayTime"},
    Row{DCM_InversionTime, "InversionTime"},
    Row{DCM_FlipAngle, "FlipAngle"},
    Row{DCM_KVP, "KVP"},
    Row{DCM_ConvolutionKernel, "ConvolutionKernel"},
    Row{DCM_ReferencedSegmentNumber, "ReferencedSegmentNumber"},
    Row{DCM_ComplexImageComponent, "ComplexImageComponent"},
    Row{DCM_ImageType, "ImageType"},
    Row{DCM_FrameType, "FrameType"},
    Row{DCM_StackID, "StackID"},
    Row{DCM_EnergyWindowVector, "EnergyWindowVector", Kind::of_vector},
    Row{DCM_DetectorVector, "DetectorVector", Kind::of_vector},
    Row{DCM_PhaseVector, "PhaseVector", Kind::of_vector},
    Row{DCM_RotationVector, "RotationVector", Kind::of_vector},
    Row{DCM_RRIntervalVector, "RRIntervalVector", Kind::of_vector},
    Row{DCM_TimeSlotVector, "TimeSlotVector", Kind::of_vector},
    Row{DCM_TimeSliceVector, "TimeSliceVector", Kind::of_vector},
    Row{DCM_AngularViewVector, "AngularViewVector", Kind::of_vector},
    Row{DCM_FrameAcquisitionNumber, "FrameAcquisitionNumber"},
    Row{DCM_TemporalPositionTimeOffset, "TemporalPositionTimeOffset"},
    Row{DCM_DimensionIndexValues, "DimensionIndexValues, the first", Kind::of_dimension},
    Row{DCM_DimensionIndexValues, "DimensionIndexValues, the second", Kind::of_dimension},
    Row{DCM_DimensionIndexValues, "DimensionIndexValues, the third", Kind::of_dimension},
    Row{DCM_DimensionIndexValues, "DimensionIndexValues, the fourth", Kind::of_dimension},
    Row{DCM_DimensionIndexValues, "DimensionIndexValues, the fifth", Kind::of_dimension},
    Row{DCM_NominalPercentageOfRespiratoryPhase, "NominalPercentageOfRespiratoryPhase", Kind::of_setup},
    // Enhanced images state them for frames. read_moments() finds the rows of names first.
    Row{DCM_KVP, "KVP", Kind::of_setup},
    Row{DCM_ConvolutionKernel, "ConvolutionKernel", Kind::of_setup},
    Row{DCM_ContrastBolusAgent, "ContrastBolusAgent", Kind::of_setup},
    Row{DCM_ContrastBolusAgentAdministered, "ContrastBolusAgentAdministered", Kind::of_setup},
    Row{DCM_ContrastBolusAgentPhase, "ContrastBolusAgentPhase", Kind::of_setup},
    Row{DCM_PatientPosition, "PatientPosition", Kind::of_setup},
    Row{DCM_GantryDetectorTilt, "GantryDetectorTilt", Kind::of_setup},
    Row{DCM_FrameOfReferenceUID, "FrameOfReferenceUID", Kind::of_setup},
    Row{DCM_TriggerTime, "TriggerTime", Kind::growing},
    Row{DCM_FrameReferenceTime, "FrameReferenceTime", Kind::growing},
    Row{DCM_AcquisitionDateTime, "AcquisitionDateTime", Kind::growing},
    Row{DCM_AcquisitionTime, "AcquisitionTime", Kind::growing},
    Row{DCM_FrameReferenceDateTime, "FrameReferenceDateTime", Kind::growing},
    Row{DCM_FrameAcquisitionDateTime, "FrameAcquisitionDateTime", Kind::growing},
    Row{DCM_ContentTime, "ContentTime", Kind::growing},
    Row{DCM_InstanceNumber, "InstanceNumber", Kind::growing},
};

auto find_in(auto& moments, std::size_t number) {
  return std::ranges::find(moments, static_cast<std::uint8_t>(number), &Moments::value_type::first);
}

void set_moment(Moments& moments, std::size_t number, std::string value) {
  if (const auto found = find_in(moments, number); found != moments.end())
    found->second = std::move(value);
  else
    moments.emplace_back(static_cast<std::uint8_t>(number), std::move(value));
}

}  // namespace

std::size_t count_of_moments() { return rows.size(); }
std::string_view name_of_moment(std::size_t number) { return rows[number].name; }
bool grows_from_slice_to_slice(std::size_t number) { return rows[number].kind == Kind::growing; }
bool is_in_names(std::size_t number) { return rows[number].kind != Kind::of_setup; }

void read_moments(DcmItem& item, Moments& moments, bool only_setup) {
  for (DcmObject* object = item.nextInContainer(nullptr); object != nullptr;
       object = item.nextInContainer(object)) {
    const DcmTagKey tag = object->getTag();
    const auto row = std::ranges::find_if(
        rows, [&](const Row& one) { return one.tag == tag && (!only_setup || one.kind == Kind::of_setup); });
    if (row == rows.end() || row->kind == Kind::of_vector || !object->isLeaf()) continue;
    const auto first = static_cast<std::size_t>(row - rows.begin());
    const std::string text = text_of(dynamic_cast<DcmElement&>(*object));
    if (row->kind != Kind::of_dimension) {
      if (!text.empty()) set_moment(moments, first, text);
      continue;
    }
    const auto values = values_of(text);
    for (std::size_t i = 0; i < values.size() && rows[first + i].kind == Kind::of_dimension; ++i)
      set_moment(moments, first + i, std::string(values[i]));
  }
}

void read_vectors(DcmItem& dataset, std::vector<Moments*> frames) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].kind != Kind::of_vector) continue;
    const auto text = text_of(dataset, rows[i].tag);
    if (!text) continue;
    const auto values = values_of(*text);
    if (values.size() != frames.size()) continue;
    for (std::size_t frame = 0; frame < frames.size(); ++frame)
      set_moment(*frames[frame], i, std::string(trimmed(values[frame])));
  }
}

std::string_view value_in(const Moments& moments, std::size_t number) {
  const auto found = find_in(moments, number);
  return found == moments.end() ? std::string_view() : std::string_view(found->second);
}

}  // namespace tagrid
