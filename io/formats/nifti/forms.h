// The two forms in which NIfTI stores the position of a volume.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "io/volume/volume_info.h"

namespace tagrid {

/// Directions and origin of a qform: a rotation as b, c, d of a quaternion, "METHOD 2" of the standard.
/// `pixdim` has the sign of z and the sizes of voxels.
Geometry geometry_of_qform(const std::array<double, 3>& quatern, const std::array<double, 3>& qoffset,
                           const std::array<double, 4>& pixdim);

/// The forms of a NIfTI source, from its key-value pairs.
struct FormsOfSource {
  bool is_nifti = false;
  double sform_code = 0, qform_code = 0;
  std::array<double, 3> quatern = {}, qoffset = {};
  std::array<double, 4> pixdim = {};
  Geometry sform, qform;  ///< where the code is positive

  bool has_sform() const { return sform_code > 0; }
  bool has_qform() const { return qform_code > 0; }
  /// There are two forms, and their positions differ.
  bool differ() const;
  /// The volume lies where the sform says, so it is not a part of the source.
  bool is_whole(const Geometry& geometry) const;
};
FormsOfSource forms_of_source(const std::vector<std::pair<std::string, std::string>>& pairs);

}  // namespace tagrid
