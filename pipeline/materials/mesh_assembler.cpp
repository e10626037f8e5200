#include "pipeline/materials/mesh_assembler.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

// The corners of the face opposite to a corner, counterclockwise as seen from outside.
constexpr std::array<std::array<std::size_t, 3>, 4> corners_of_face = {
    {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
// The place of the middle of an edge among the nodes of an element.
constexpr std::array<std::array<std::size_t, 4>, 4> middle_of = {
    {{0, 4, 6, 7}, {4, 0, 5, 8}, {6, 5, 0, 9}, {7, 8, 9, 0}}};

template <class Record>
void write_record(SpoolFile& file, const Record& record) {
  file.write(std::as_bytes(std::span(&record, 1)));
}

// Calls use(std::span<const Record>) for all records of a file, in order.
template <class Record, class Use>
void for_each_record(SpoolFile& file, Use use) {
  std::vector<Record> records;
  for_each_piece(file, sizeof(Record), [&](std::int64_t, std::span<const std::byte> piece) {
    records.resize(piece.size() / sizeof(Record));
    std::memcpy(records.data(), piece.data(), piece.size());
    use(std::span<const Record>(records));
  });
}

// Rows of numbers that are written in groups: the rows of a group follow one another in the file, in the order in which
// they come.
class GroupedRows {
 public:
  GroupedRows(SpoolFile& file, std::size_t row) : file_(file), row_(row) {}

  void add(std::size_t group, std::span<const std::int64_t> numbers) {
    if (group >= pieces_.size()) pieces_.resize(group + 1);
    std::vector<std::byte>& bytes = pieces_[group].bytes;
    const std::size_t old = bytes.size();
    bytes.resize(old + row_ * sizeof(std::int64_t));
    for (std::size_t i = 0; i < row_; ++i)
      store_little_endian(bytes.data() + old + i * sizeof(std::int64_t), numbers[i]);
  }
  // To be called after each piece of the input, so that little waits. first(group): the first row of the group in the
  // file.
  template <class First>
  void flush(First first) {
    for (std::size_t group = 0; group < pieces_.size(); ++group) {
      Piece& piece = pieces_[group];
      if (piece.bytes.empty()) continue;
      const std::uint64_t bytes_of_row = row_ * sizeof(std::int64_t);
      file_.write_at((static_cast<std::uint64_t>(first(group)) + piece.written) * bytes_of_row, piece.bytes);
      piece.written += piece.bytes.size() / bytes_of_row;
      piece.bytes.clear();
    }
  }

 private:
  struct Piece {
    std::vector<std::byte> bytes;
    std::uint64_t written = 0;
  };
  SpoolFile& file_;
  std::size_t row_;
  std::vector<Piece> pieces_;
};

std::size_t mixed(std::uint64_t h) {
  h ^= h >> 32;
  h *= 0x9e3779b97f4a7c15U;
  h ^= h >> 29;
  return h;
}

}  // namespace

// What remains of the mesh, and its new numbers.
class MeshAssembler::Kept {
 public:
  Kept(MeshAssembler& all, const PartsWish& wish);

  bool has(std::uint32_t part) const { return is_kept_.empty() || is_kept_[part]; }
  bool has(const Side& side) const { return side.place >= 0 && has(side.part); }
  std::int64_t node(std::int64_t number) const { return nodes_ ? nodes_->of(number) : number; }
  const KeptNumbers* nodes() const { return nodes_ ? &*nodes_ : nullptr; }
  std::int64_t place(Material material, std::int64_t old) const {
    return nodes_ ? places_.at(material).of(old) : old;
  }
  std::int64_t count(Material m, std::int64_t all) const { return nodes_ ? places_.at(m).total() : all; }
  std::int64_t parts(Material material) const { return count_of(material, part_counts_); }
  std::int64_t removed_parts(Material material) const { return count_of(material, removed_parts_); }

 private:
  using Counts = std::map<Material, std::int64_t>;
  static std::int64_t count_of(Material material, const Counts& counts) {
    const auto found = counts.find(material);
    return found == counts.end() ? 0 : found->second;
  }

  std::vector<bool> is_kept_;  ///< by part; empty: all are
  std::optional<KeptNumbers> nodes_;
  std::map<Material, KeptNumbers> places_;
  Counts part_counts_, removed_parts_;
};

MeshAssembler::Kept::Kept(MeshAssembler& all, const PartsWish& wish) {
  const auto count = static_cast<std::uint32_t>(all.parts_.size());
  for (std::uint32_t part = 0; part < count; ++part)
    if (const std::uint32_t root = all.connected_.root(part); root != part)
      all.parts_[root].volume += all.parts_[part].volume;
  std::map<Material, std::uint32_t> largest;
  for (std::uint32_t part = 0; part < count; ++part) {
    if (all.connected_.root(part) != part) continue;
    const auto [found, is_new] = largest.emplace(all.parts_[part].material, part);
    if (all.parts_[part].volume > all.parts_[found->second].volume) found->second = part;
  }
  std::vector<bool> is_kept(count);
  for (std::uint32_t part = 0; part < count; ++part) {
    if (all.connected_.root(part) != part) continue;
    const BrickMesh::Part& p = all.parts_[part];
    is_kept[part] = wish.only_largest ? largest.at(p.material) == part : !(p.volume < wish.least_volume);
    ++(is_kept[part] ? part_counts_ : removed_parts_)[p.material];
  }
  if (removed_parts_.empty()) return;
  for (std::uint32_t part = 0; part < count; ++part) is_kept[part] = is_kept[all.connected_.root(part)];
  is_kept_ = std::move(is_kept);
  nodes_.emplace(all.node_count_);
  for (const auto& [material, elements] : all.element_counts_) places_.emplace(material, elements);
  std::map<Material, std::int64_t> places;
  for_each_record<Element>(all.elements_, [&](std::span<const Element> elements) {
    for (const Element& e : elements) {
      const std::int64_t place = places[e.material]++;
      if (!has(e.part)) continue;
      places_.at(e.material).keep(place);
      for (std::size_t i = 0; i < (all.settings_.order == 1 ? 4 : most_nodes); ++i) nodes_->keep(e.nodes[i]);
    }
  });
  nodes_->count();
  for (auto& [material, kept] : places_) kept.count();
}

std::size_t MeshAssembler::HashOfKey::operator()(const BrickMesh::NodeKey& key) const {
  return mixed(key.first ^ mixed(key.second));
}
std::size_t MeshAssembler::HashOfKey::operator()(const std::array<std::uint64_t, 3>& key) const {
  return mixed(key[0] ^ mixed(key[1] ^ mixed(key[2])));
}

MeshAssembler::MeshAssembler(const MaterialMeshSettings& settings, const SpoolPlace& place,
                             const PartsMemory& memory)
    : settings_(settings),
      memory_(memory),
      points_(place.file()),
      elements_(place.file()),
      faces_(place.file()) {}

void MeshAssembler::add(const BrickMesh& brick) {
  first_part_ = static_cast<std::uint32_t>(parts_.size());
  for (const BrickMesh::Part& part : brick.parts) {
    connected_.add();
    parts_.push_back(part);
  }
  require_memory(bytes_of_parts(), memory_.others, fmt::format("a mesh of {} parts", parts_.size()));
  number_nodes(brick);
  add_elements(brick);
  add_faces(brick);
}

void MeshAssembler::number_nodes(const BrickMesh& brick) {
  numbers_.clear();
  for (const BrickMesh::Node& node : brick.nodes) {
    const std::uint32_t part = node.part == BrickMesh::none ? BrickMesh::none : first_part_ + node.part;
    if (node.is_shared) {
      const auto [found, is_new] = shared_.try_emplace(node.key, SharedNode{node_count_, node.z, part});
      numbers_.push_back(found->second.number);
      if (!is_new) {
        if (part != BrickMesh::none) {
          if (found->second.part == BrickMesh::none) found->second.part = part;
          connected_.join(found->second.part, part);
        }
        continue;
      }
    } else {
      numbers_.push_back(node_count_);
    }
    ++node_count_;
    std::array<std::byte, 3 * sizeof(double)> bytes;
    for (std::size_t i = 0; i < 3; ++i) store_little_endian(bytes.data() + i * sizeof(double), node.world[i]);
    points_.write(bytes);
  }
}

void MeshAssembler::add_elements(const BrickMesh& brick) {
  const std::size_t nodes = settings_.order == 1 ? 4 : most_nodes;
  places_.clear();
  for (const BrickMesh::Element& element : brick.elements) {
    Element record;
    for (std::size_t i = 0; i < nodes; ++i) record.nodes[i] = numbers_[element.nodes[i]];
    record.volume = element.volume;
    record.smallest_angle = element.smallest_angle;
    record.largest_angle = element.largest_angle;
    record.part = first_part_ + element.part;
    record.material = element.material;
    places_.push_back(element_counts_[element.material]++);
    write_record(elements_, record);
  }
}

MeshAssembler::Side MeshAssembler::side_of(const BrickMesh& brick, const BrickMesh::ElementFace& face) const {
  Side side;
  side.material = face.material;
  if (face.element == BrickMesh::none) return side;
  side.place = places_[face.element];
  side.part = first_part_ + brick.elements[face.element].part;
  side.corner = face.corner;
  return side;
}

std::array<std::int64_t, MeshAssembler::most_nodes_of_face> MeshAssembler::nodes_of(
    const BrickMesh& brick, const BrickMesh::ElementFace& face) const {
  std::array<std::int64_t, most_nodes_of_face> nodes{};
  const auto& of_element = brick.elements[face.element].nodes;
  const auto& corners = corners_of_face[face.corner];
  for (std::size_t i = 0; i < 3; ++i) nodes[i] = numbers_[of_element[corners[i]]];
  if (settings_.order == 1) return nodes;
  constexpr std::array<std::array<std::size_t, 2>, 3> edges = {{{0, 1}, {1, 2}, {0, 2}}};
  for (std::size_t i = 0; i < 3; ++i)
    nodes[3 + i] = numbers_[of_element[middle_of[corners[edges[i][0]]][corners[edges[i][1]]]]];
  return nodes;
}

void MeshAssembler::add_faces(const BrickMesh& brick) {
  for (const BrickMesh::Face& face : brick.faces) {
    Face record;
    record.nodes = nodes_of(brick, face.front);
    record.area = face.area;
    record.front = side_of(brick, face.front);
    if (face.has_back) record.back = side_of(brick, face.back);
    record.has_back = face.has_back;
    record.side = face.side;
    write_record(faces_, record);
  }
  for (const BrickMesh::OpenFace& open : brick.open_faces) add_open_face(brick, open);
}

void MeshAssembler::add_open_face(const BrickMesh& brick, const BrickMesh::OpenFace& open) {
  OpenFace mine;
  mine.side = side_of(brick, open.face);
  if (mine.side.place >= 0) mine.nodes = nodes_of(brick, open.face);
  mine.area = open.area;
  mine.z = open.z;
  mine.may_end_region = open.may_end_region;
  const auto [found, is_new] = open_.try_emplace(open.vertices, mine);
  if (is_new) return;
  const OpenFace other = found->second;
  open_.erase(found);
  const bool has_mine = mine.side.place >= 0, has_other = other.side.place >= 0;
  if (mine.side.material == other.side.material) {
    if (has_mine) connected_.join(mine.side.part, other.side.part);
    return;
  }
  if (!has_mine && !has_other) return;
  const bool mine_is_front = first_is_front(has_mine, mine.side.material, has_other, other.side.material);
  const OpenFace &front = mine_is_front ? mine : other, &back = mine_is_front ? other : mine;
  write_record(faces_, Face{front.nodes, front.area, front.side, back.side, BrickMesh::no_side, true});
}

void MeshAssembler::end_region(const OpenFace& open) {
  if (open.side.place < 0) return;
  if (!open.may_end_region) throw std::logic_error("a face of a mesh with materials has one tetrahedron");
  write_record(faces_, Face{open.nodes, open.area, open.side, {}, BrickMesh::side_of_region, false});
}

void MeshAssembler::end_layer(std::int64_t z) {
  std::erase_if(shared_, [&](const auto& node) { return node.second.z < z; });
  // In the order of their keys, as the order of a hash table may change.
  std::vector<std::array<std::uint64_t, 3>> ends;
  for (const auto& [key, open] : open_)
    if (open.z < z) ends.push_back(key);
  std::sort(ends.begin(), ends.end());
  for (const auto& key : ends) {
    end_region(open_.at(key));
    open_.erase(key);
  }
}

// A part has a number in connected_, too; vectors that grow are there twice.
std::uint64_t MeshAssembler::bytes_of_parts() const {
  return 3 * parts_.size() * (sizeof(BrickMesh::Part) + sizeof(std::uint32_t));
}

void MeshAssembler::require_memory(std::uint64_t bytes, std::uint64_t of_others,
                                   const std::string& what) const {
  if (bytes > memory_.limit - std::min(memory_.limit, of_others))
    throw MemoryLimit(what, {.needed = of_others + bytes, .allowed = memory_.limit});
}

MeshQuality MeshAssembler::finish(const MaterialNames& names, const PartsWish& wish, MaterialMesh& mesh) {
  end_layer(settings_.lattice.last.z + 1);
  std::uint64_t bytes = bytes_of_parts() + KeptNumbers::bytes(node_count_);
  for (const auto& [material, count] : element_counts_) bytes += KeptNumbers::bytes(count);
  require_memory(bytes, memory_.others_at_end, fmt::format("a mesh of {} parts", parts_.size()));
  MeshQuality quality;
  const Kept kept(*this, wish);
  std::int64_t first = 0;
  for (const auto& [material, all] : element_counts_) {
    const std::int64_t count = kept.count(material, all);
    mesh.materials.push_back(
        {names.name_of(material), std::int64_t{material} + names.first_label, first, count});
    quality.materials.push_back({.name = names.name_of(material),
                                 .tetrahedra = count,
                                 .parts = kept.parts(material),
                                 .removed_parts = kept.removed_parts(material),
                                 .removed_tetrahedra = all - count});
    first += count;
  }
  write_points(kept, mesh);
  write_elements(kept, mesh, quality);
  write_faces(kept, names, mesh, quality);
  return quality;
}

void MeshAssembler::write_points(const Kept& kept, MaterialMesh& mesh) {
  if (kept.nodes() == nullptr) {
    mesh.points = std::move(points_);
    return;
  }
  for_each_piece(points_, 3 * sizeof(double), [&](std::int64_t first, std::span<const std::byte> piece) {
    for (std::size_t i = 0; i < piece.size() / (3 * sizeof(double)); ++i)
      if (kept.nodes()->is_kept(first + static_cast<std::int64_t>(i)))
        mesh.points.write(piece.subspan(i * 3 * sizeof(double), 3 * sizeof(double)));
  });
}

void MeshAssembler::write_elements(const Kept& kept, MaterialMesh& mesh, MeshQuality& quality) {
  std::map<Material, std::size_t> groups;
  for (const auto& [material, count] : element_counts_) groups.emplace(material, groups.size());
  GroupedRows rows(mesh.nodes, mesh.nodes_of_element());
  std::array<std::int64_t, most_nodes> nodes{};
  const auto bin_of = [](float angle) {
    return std::min<std::size_t>(static_cast<std::size_t>(angle / MeshQuality::degrees_of_bin),
                                 std::tuple_size_v<MeshQuality::Histogram> - 1);
  };
  for_each_record<Element>(elements_, [&](std::span<const Element> elements) {
    for (const Element& e : elements) {
      if (!kept.has(e.part)) continue;
      const std::size_t group = groups.at(e.material);
      for (std::size_t i = 0; i < mesh.nodes_of_element(); ++i) nodes[i] = kept.node(e.nodes[i]);
      rows.add(group, std::span(nodes).first(mesh.nodes_of_element()));
      quality.materials[group].volume += e.volume;
      ++quality.smallest[bin_of(e.smallest_angle)];
      ++quality.largest[bin_of(e.largest_angle)];
      quality.smallest_angle = std::min(quality.smallest_angle, static_cast<double>(e.smallest_angle));
      quality.largest_angle = std::max(quality.largest_angle, static_cast<double>(e.largest_angle));
    }
    rows.flush([&](std::size_t group) { return mesh.materials[group].first; });
  });
}

void MeshAssembler::write_faces(const Kept& kept, const MaterialNames& names, MaterialMesh& mesh,
                                MeshQuality& quality) {
  // In the tables here and in those of writers, with its name. Measured with noise of labels.
  constexpr std::uint64_t bytes_of_surface = 1500;
  constexpr int between = 0, to_other_material = 1, to_removed_part = 2, first_side = 3;
  std::map<Material, std::size_t> materials;
  for (const auto& [material, count] : element_counts_) materials.emplace(material, materials.size());
  // The side that is in front, after parts were removed, and the surface.
  struct Seen {
    bool front_is_back = false;
    SurfaceKey key;
  };
  const auto seen = [&](const Face& face) -> std::optional<Seen> {
    const bool has_front = kept.has(face.front), has_back = face.has_back && kept.has(face.back);
    if (!has_front && !has_back) return std::nullopt;
    if (has_front && has_back) return Seen{false, {face.front.material, between, face.back.material}};
    const Side &mine = has_front ? face.front : face.back, &other = has_front ? face.back : face.front;
    Seen result{!has_front, {mine.material, to_removed_part, 0}};
    if (face.side != BrickMesh::no_side)
      result.key.kind = first_side + face.side;
    else if (!settings_.keeps(other.material))
      result.key = {mine.material, to_other_material, other.material};
    return result;
  };
  std::map<SurfaceKey, std::int64_t> counts;
  for_each_record<Face>(faces_, [&](std::span<const Face> faces) {
    for (const Face& face : faces)
      if (const auto as_seen = seen(face)) ++counts[as_seen->key];
    require_memory(bytes_of_parts() + counts.size() * bytes_of_surface, memory_.others_at_end,
                   fmt::format("a mesh of {} surfaces", counts.size()));
  });
  std::map<SurfaceKey, std::size_t> groups;
  std::set<std::string> used;
  for (const MaterialElements& material : mesh.materials) used.insert(lower_case(material.name));
  std::int64_t first = 0;
  for (const auto& [key, count] : counts) {
    groups.emplace(key, groups.size());
    MaterialSurface& surface = mesh.surfaces.emplace_back();
    const std::string front = names.name_of(key.front);
    surface.front = materials.at(key.front);
    if (key.kind == between) surface.back = materials.at(key.back);
    if (key.kind >= first_side && key.kind - first_side < BrickMesh::side_of_region)
      surface.side = key.kind - first_side;
    surface.name = front + "_" +
                   (key.kind <= to_other_material ? names.name_of(key.back)
                    : key.kind == to_removed_part ? "removed"
                    : surface.side ? std::string(names_of_sides[static_cast<std::size_t>(*surface.side)])
                                   : "cut");
    // a_b and c meet as a and b_c do.
    const std::string name = surface.name;
    for (int n = 2; !used.insert(lower_case(surface.name)).second; ++n)
      surface.name = name + "_" + std::to_string(n);
    surface.first = first;
    surface.count = count;
    first += count;
  }
  GroupedRows node_rows(mesh.face_nodes, mesh.nodes_of_face()), face_rows(mesh.faces, 2);
  const auto element_face = [&](const Side& side) {
    return 4 * (mesh.materials[materials.at(side.material)].first + kept.place(side.material, side.place)) +
           side.corner;
  };
  for_each_record<Face>(faces_, [&](std::span<const Face> faces) {
    for (const Face& face : faces) {
      const auto as_seen = seen(face);
      if (!as_seen) continue;
      const std::size_t group = groups.at(as_seen->key);
      const Side& front = as_seen->front_is_back ? face.back : face.front;
      std::array<std::int64_t, most_nodes_of_face> nodes = face.nodes;
      if (as_seen->front_is_back) {
        std::swap(nodes[1], nodes[2]);  // and the middles of 01 and 02
        std::swap(nodes[3], nodes[5]);
      }
      for (std::size_t i = 0; i < mesh.nodes_of_face(); ++i) nodes[i] = kept.node(nodes[i]);
      node_rows.add(group, std::span(nodes).first(mesh.nodes_of_face()));
      const bool has_both = mesh.surfaces[group].back.has_value();
      const std::array<std::int64_t, 2> of_elements = {element_face(front),
                                                       has_both ? element_face(face.back) : -1};
      face_rows.add(group, of_elements);
      quality.materials[mesh.surfaces[group].front].area += face.area;
      if (has_both) quality.materials[*mesh.surfaces[group].back].area += face.area;
    }
    const auto first_of = [&](std::size_t group) { return mesh.surfaces[group].first; };
    node_rows.flush(first_of);
    face_rows.flush(first_of);
  });
}

void count_touching_edges(MaterialMesh& mesh, MeshQuality& quality, std::size_t most_bytes) {
  struct Edge {
    std::int64_t low = 0, high = 0;
    std::size_t material = 0;
    auto operator<=>(const Edge&) const = default;
  };
  std::int64_t faces = 0;
  for (const MaterialSurface& surface : mesh.surfaces) faces += surface.count;
  // Edges are counted in as many passes as memory needs.
  const std::uint64_t passes = static_cast<std::uint64_t>(faces) * 6 * sizeof(Edge) / most_bytes + 1;
  std::vector<std::byte> bytes;
  std::vector<Edge> edges;
  for (std::uint64_t pass = 0; pass < passes; ++pass) {
    edges.clear();
    for (const MaterialSurface& surface : mesh.surfaces) {
      const std::size_t row = mesh.nodes_of_face() * sizeof(std::int64_t);
      constexpr std::int64_t piece = 1 << 14;
      for (std::int64_t i = 0; i < surface.count; i += piece) {
        const auto count = static_cast<std::size_t>(std::min(piece, surface.count - i));
        bytes.resize(count * row);
        mesh.face_nodes.read_at(static_cast<std::uint64_t>(surface.first + i) * row, bytes);
        for (std::size_t f = 0; f < count; ++f)
          for (std::size_t a = 0; a < 3; ++a) {
            const auto node = [&](std::size_t k) {
              return load_little_endian<std::int64_t>(bytes.data() + f * row + k * sizeof(std::int64_t));
            };
            const std::int64_t p = node(a), q = node((a + 1) % 3);
            const Edge edge{std::min(p, q), std::max(p, q), surface.front};
            if (mixed(static_cast<std::uint64_t>(edge.low)) % passes != pass) continue;
            edges.push_back(edge);
            if (surface.back) edges.push_back({edge.low, edge.high, *surface.back});
          }
      }
    }
    std::sort(edges.begin(), edges.end());
    for (std::size_t i = 0; i < edges.size();) {
      std::size_t end = i;
      while (end < edges.size() && edges[end] == edges[i]) ++end;
      quality.materials[edges[i].material].touching_edges += end - i > 2;
      i = end;
    }
  }
}

}  // namespace tagrid
