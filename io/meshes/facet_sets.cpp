#include "io/meshes/facet_sets.h"

#include <fmt/format.h>

#include <set>

#include "io/errors/errors.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

class FacetSets {
 public:
  explicit FacetSets(const MaterialMesh& mesh) : mesh_(mesh) {
    for (const MaterialSurface& surface : mesh.surfaces) taken_.insert(lower_case(surface.name));
  }

  void add_surfaces() {
    for (std::size_t i = 0; i < mesh_.surfaces.size(); ++i)
      if (mesh_.surfaces[i].count > 0) sets_.push_back({mesh_.surfaces[i].name, {{i, false}}});
    for (std::size_t i = 0; i < mesh_.surfaces.size(); ++i) {
      const MaterialSurface& surface = mesh_.surfaces[i];
      if (surface.back)
        add(mesh_.materials[*surface.back].name + "_" + mesh_.materials[surface.front].name, {{i, true}},
            true);
    }
  }
  void add_materials() {
    std::vector<std::vector<FacetSet::Part>> parts(mesh_.materials.size());
    for (std::size_t i = 0; i < mesh_.surfaces.size(); ++i) {
      parts[mesh_.surfaces[i].front].push_back({i, false});
      if (mesh_.surfaces[i].back) parts[*mesh_.surfaces[i].back].push_back({i, true});
    }
    for (std::size_t i = 0; i < parts.size(); ++i)
      add(mesh_.materials[i].name + "_surface", std::move(parts[i]), false);
  }
  void add_sides() {
    std::array<std::vector<FacetSet::Part>, names_of_sides.size()> parts;
    for (std::size_t i = 0; i < mesh_.surfaces.size(); ++i)
      if (mesh_.surfaces[i].side)
        parts.at(static_cast<std::size_t>(*mesh_.surfaces[i].side)).push_back({i, false});
    for (std::size_t i = 0; i < parts.size(); ++i)
      add(std::string(names_of_sides[i]), std::move(parts[i]), false);
  }

  std::vector<FacetSet> sets() && { return std::move(sets_); }

 private:
  void add(const std::string& name, std::vector<FacetSet::Part> parts, bool is_turned) {
    std::erase_if(parts, [&](const FacetSet::Part& part) { return mesh_.surfaces[part.surface].count == 0; });
    if (parts.empty()) return;
    std::string free = name;
    for (int number = 2; !taken_.insert(lower_case(free)).second; ++number)
      free = fmt::format("{}_{}", name, number);
    sets_.push_back({std::move(free), std::move(parts), is_turned});
  }

  const MaterialMesh& mesh_;
  std::vector<FacetSet> sets_;
  std::set<std::string> taken_;  ///< names, in lower case
};

}  // namespace

std::vector<FacetSet> facet_sets(const MaterialMesh& mesh) {
  FacetSets sets(mesh);
  sets.add_surfaces();
  sets.add_materials();
  sets.add_sides();
  return std::move(sets).sets();
}

void check_name(const FormatLimits& limits, const std::string& name, const std::string& file) {
  if (name.size() > limits.longest_name)
    throw UsageError(
        "{}: {} files have names of up to {} characters, and \"{}\" has {}; give materials shorter names",
        file, limits.format, limits.longest_name, name, name.size());
}

void check_limits(const FormatLimits& limits, const MaterialMesh& mesh, const std::string& file) {
  for (const auto& [count, what] :
       {std::pair{mesh.point_count(), "points"}, {mesh.element_count(), "tetrahedra"}})
    if (count > limits.most)
      throw UsageError(
          "{}: {} files have at most {} {}, and the mesh has {}; choose another format, or a coarser mesh",
          file, limits.format, limits.most, what, count);
  for (const MaterialElements& material : mesh.materials) check_name(limits, material.name, file);
}

std::string remark_of(const MaterialMesh& mesh) {
  std::string remark = "Tetrahedra with materials";
  if (!mesh.notes.space.empty()) remark += "; " + space_comment(mesh.notes);
  if (!mesh.unit.empty()) remark += "; unit=" + mesh.unit;
  for (char& c : remark) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f || c == '<' || c == '>' || c == '&') c = '_';
  }
  // Two of them end comments of XML.
  for (std::size_t at = 0; (at = remark.find("--", at)) != remark.npos;) remark[at + 1] = '_';
  return remark;
}

}  // namespace tagrid
