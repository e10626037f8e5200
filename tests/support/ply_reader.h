// A reader of the .ply files that PlyFile writes.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/surface_laws.h"

namespace tagrid {

struct PlySurface {
  std::vector<std::array<double, 3>> vertices;
  Triangles triangles;
};

/// REQUIRES: a little-endian machine. Throws if it is not exactly such a file.
inline PlySurface read_ply(const std::string& bytes) {
  std::size_t at = 0;
  const auto line = [&] {
    const std::size_t end = bytes.find('\n', at);
    if (end == bytes.npos) throw std::runtime_error("PLY: no end of line");
    const std::string text = bytes.substr(at, end - at);
    at = end + 1;
    return text;
  };
  const auto expect = [&](const std::string& wanted) {
    if (line() != wanted) throw std::runtime_error("PLY: no line " + wanted);
  };
  const auto count = [&](const std::string& name) {
    const std::string text = line(), start = "element " + name + " ";
    if (!text.starts_with(start)) throw std::runtime_error("PLY: no " + name);
    return std::stoull(text.substr(start.size()));
  };
  expect("ply");
  expect("format binary_little_endian 1.0");
  if (!line().starts_with("comment ")) throw std::runtime_error("PLY: no comment");
  PlySurface surface;
  surface.vertices.resize(count("vertex"));
  for (const char* axis : {"x", "y", "z"}) expect(std::string("property double ") + axis);
  surface.triangles.resize(count("face"));
  expect("property list uchar int vertex_indices");
  expect("end_header");
  if (bytes.size() - at != 24 * surface.vertices.size() + 13 * surface.triangles.size())
    throw std::runtime_error("PLY: wrong size");
  for (auto& vertex : surface.vertices) {
    std::memcpy(vertex.data(), bytes.data() + at, 24);
    at += 24;
  }
  for (auto& triangle : surface.triangles) {
    if (bytes[at++] != 3) throw std::runtime_error("PLY: not a triangle");
    for (std::int64_t& id : triangle) {
      std::int32_t number;
      std::memcpy(&number, bytes.data() + at, 4);
      at += 4;
      if (number < 0 || static_cast<std::size_t>(number) >= surface.vertices.size())
        throw std::runtime_error("PLY: a vertex that does not exist");
      id = number;
    }
  }
  return surface;
}

}  // namespace tagrid
