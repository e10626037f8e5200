// The options of a mesh with materials, and what their texts mean.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "pipeline/materials/material_mesh.h"

namespace tagrid {

/// The texts of the options; "" if one was not given.
struct MaterialTexts {
  std::string materials, labels, label_volume, keep, parts, size;
  std::optional<double> smooth;
  std::optional<int> order, angles;
  bool quality = false;

  /// True if a mesh with materials is wanted.
  bool are_given() const { return !materials.empty() || !labels.empty() || !label_volume.empty(); }
};

/// --materials, --labels, --label-volume, --keep, --parts, --smooth, --size, --angles, --order, --quality
void add_material_options(CLI::App& command, MaterialTexts& texts);

/// Throws UsageError if they contradict one another or cannot be understood. Reads a file of names of labels.
/// REQUIRES: texts.are_given().
MaterialMeshOptions material_options(const MaterialTexts& texts);

/// The option that was given but belongs to a mesh with materials alone; "" if there is none.
std::string first_given(const MaterialTexts& texts);

}  // namespace tagrid
