// What is tested with arbitrary bytes. A target returns if everything is right; a crash, a sanitizer's
// finding or a broken claim ends the program. The same functions run under libFuzzer and, on the inputs in
// tests/regressions, as tests.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "io/parts/part_file.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid::fuzz {

using Bytes = std::span<const std::uint8_t>;

/// The header of a .tag file, and the source's fields in it.
void header(Bytes bytes);
/// One brick, after a few bytes with its parameters; see brick_target.cpp.
void brick(Bytes bytes);
/// The fields of the index, compressed and not.
void index(Bytes bytes);
/// A volume in NRRD: attached, detached, raw, gzip.
void nrrd(Bytes bytes);
/// A NIfTI file of one part, plain or in gzip.
void nifti(Bytes bytes);
/// A MetaImage file.
void metaimage(Bytes bytes);
/// A file of a scanner's program: VGStudio, Nikon, Scanco, PyHST.
void vendors(Bytes bytes);
/// A file of NumPy, MRC, EDF, VFF or AmiraMesh.
void other_volumes(Bytes bytes);
/// A BMP file.
void bmp(Bytes bytes);
/// A PNG file.
void png(Bytes bytes);
/// A DICOM file that is exported.
void dicom(Bytes bytes);
/// The record of a run that can be continued.
void record(Bytes bytes);
/// A part of such a run: `seed_part`.
void part(Bytes bytes);
/// The numbers of the command line.
void numbers(Bytes bytes);
/// A whole .tag file: from a file and from a pipe, decoded, verified, meshed.
void file(Bytes bytes);
/// A whole .tag file, read a block at a time; see blocks_target.cpp.
void blocks(Bytes bytes);

struct Target {
  std::string_view name;
  void (*run)(Bytes);
};

inline constexpr Target targets[] = {{"header", header},   {"brick", brick},
                                     {"index", index},     {"nrrd", nrrd},
                                     {"nifti", nifti},     {"metaimage", metaimage},
                                     {"vendors", vendors}, {"other_volumes", other_volumes},
                                     {"bmp", bmp},         {"png", png},
                                     {"dicom", dicom},     {"record", record},
                                     {"part", part},       {"numbers", numbers},
                                     {"file", file},       {"blocks", blocks}};

/// Identity of the part that part() reads.
inline constexpr PartId seed_part = {7, 1, 2, 4};
inline CodingParameters seed_part_parameters() {
  CodingParameters parameters{.dims = {9, 6, 20}, .cube_size = 4, .brick_edge = 1, .field_scale = 1};
  return parameters;
}

/// Ends the program with `what` if a claim does not hold.
void claim(bool holds, const char* what);

}  // namespace tagrid::fuzz
