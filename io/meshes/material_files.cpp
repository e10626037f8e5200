#include "io/meshes/material_files.h"

#include <algorithm>
#include <set>
#include <utility>

#include "io/meshes/facet_sets.h"
#include "io/meshes/mesh_writers.h"

namespace tagrid {
namespace {

class VtuMaterials final : public MaterialMeshFile {
 public:
  using MaterialMeshFile::MaterialMeshFile;

  void write(MaterialMesh& mesh) override { write_vtu(output_, contents_of(mesh)); }
};

class VtkhdfMaterials final : public MaterialMeshFile {
 public:
  VtkhdfMaterials(const std::string& path, bool overwrite)
      : MaterialMeshFile(path, overwrite), hdf5_(output_, path, "VTKHDF") {}

  void write(MaterialMesh& mesh) override { hdf5_.write(contents_of(mesh), "vtkhdf"); }
  std::uint64_t file_bytes() const override { return hdf5_.bytes(); }
  std::vector<std::string> warnings() const override { return hdf5_.warnings(); }

 private:
  Hdf5MeshWriter hdf5_;
};

/// True if the labels can be the tags of physical groups.
bool are_tags(const std::vector<MaterialElements>& materials) {
  std::set<std::int64_t> labels;
  return std::ranges::all_of(materials, [&](const MaterialElements& material) {
    return material.label > 0 && std::in_range<int>(material.label) && labels.insert(material.label).second;
  });
}

class GmshMaterials final : public MaterialMeshFile {
 public:
  using MaterialMeshFile::MaterialMeshFile;

  void write(MaterialMesh& mesh) override {
    check_limits(gmsh_limits, mesh, output_.name());
    for (const MaterialSurface& surface : mesh.surfaces)
      check_name(gmsh_limits, surface.name, output_.name());
    MeshContents contents = contents_of(mesh);
    contents.cell_data.clear();
    write_gmsh(output_, contents, groups_of(mesh));
  }
  std::vector<std::string> warnings() const override { return warnings_; }

 private:
  GmshGroups groups_of(MaterialMesh& mesh) {
    GmshGroups groups = {.volumes = {}, .surfaces = {}, .face_nodes = &mesh.face_nodes};
    const bool has_labels = are_tags(mesh.materials);
    if (!has_labels)
      warnings_.push_back(
          output_.name() +
          ": groups of tetrahedra have the tags 1, 2, 3 and so on, not the labels of materials: Gmsh's "
          "tags are from 1 to 2147483647, and differ");
    for (const MaterialElements& material : mesh.materials)
      groups.volumes.push_back(
          {material.name,
           has_labels ? static_cast<int>(material.label) : static_cast<int>(groups.volumes.size() + 1),
           material.first, material.count});
    for (const MaterialSurface& surface : mesh.surfaces) {
      const int tag = static_cast<int>(groups.surfaces.size() + 1);
      groups.surfaces.push_back({surface.name, tag, surface.first, surface.count});
      groups.volumes[surface.front].surfaces.push_back(tag);
      if (surface.back) groups.volumes[*surface.back].surfaces.push_back(-tag);
    }
    return groups;
  }

  std::vector<std::string> warnings_;
};

}  // namespace

std::unique_ptr<MaterialMeshFile> create_vtu_materials(const std::string& path, bool overwrite) {
  return std::make_unique<VtuMaterials>(path, overwrite);
}

std::unique_ptr<MaterialMeshFile> create_vtkhdf_materials(const std::string& path, bool overwrite) {
  return std::make_unique<VtkhdfMaterials>(path, overwrite);
}

std::unique_ptr<MaterialMeshFile> create_gmsh_materials(const std::string& path, bool overwrite) {
  return std::make_unique<GmshMaterials>(path, overwrite);
}

}  // namespace tagrid
