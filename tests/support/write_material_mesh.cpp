// Writes a mesh of boxes_of_materials.h as any format of meshes with materials, for tests that read it with other
// programs, and for measurements:
//   write_material_mesh FILE [order=2] [cells=4,3,2] [spacing=1,1,1] [origin=0,0,0] [materials=2] [mirrored] [air] [empty]
//                       [overwrite]
// Prints the bytes of the file and the seconds of writing it, and warnings.
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <string>

#include "io/errors/errors.h"
#include "io/meshes/formats.h"
#include "tests/support/boxes_of_materials.h"

namespace {

template <class T>
std::array<T, 3> three(const std::string& text) {
  std::array<double, 3> numbers;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf", &numbers[0], &numbers[1], &numbers[2]) != 3)
    throw tagrid::UsageError("not three numbers: " + text);
  return {static_cast<T>(numbers[0]), static_cast<T>(numbers[1]), static_cast<T>(numbers[2])};
}

void write(const std::string& path, int count, char** settings) {
  tagrid::BoxesOfMaterials boxes;
  bool overwrite = false;
  for (int i = 0; i < count; ++i) {
    const std::string setting = settings[i], name = setting.substr(0, setting.find('='));
    const std::string value = setting.substr(std::min(setting.size(), name.size() + 1));
    if (name == "order") boxes.order = std::stoi(value);
    if (name == "cells") boxes.cells = three<std::int64_t>(value);
    if (name == "spacing") boxes.spacing = three<double>(value);
    if (name == "origin") boxes.origin = three<double>(value);
    if (name == "materials") boxes.materials = std::stoi(value);
    if (name == "mirrored") boxes.mirrored = true;
    if (name == "air") boxes.air = true;
    if (name == "empty") boxes.empty = true;
    if (name == "overwrite") overwrite = true;
  }
  const auto file = tagrid::material_mesh_format_of(path).create_materials(path, overwrite);
  tagrid::MaterialMeshOfBoxes made(boxes, path);
  const auto begin = std::chrono::steady_clock::now();
  file->write(made.mesh());
  file->commit();
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
  fmt::print("{} {}\n", file->file_bytes(), time.count());
  for (const std::string& warning : file->warnings()) fmt::print("{}\n", warning);
}

}  // namespace

int main(int count, char** arguments) {
  try {
    if (count < 2) throw tagrid::UsageError("which file?");
    write(arguments[1], count - 2, arguments + 2);
    return 0;
  } catch (const tagrid::UsageError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 64;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 74;
  }
}
