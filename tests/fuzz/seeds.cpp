#include "tests/fuzz/seeds.h"

#include <bzlib.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "io/bytes/little_endian.h"
#include "io/bytes/zstd_bytes.h"
#include "io/formats/dicom/elements.h"
#include "io/parts/part_file.h"
#include "io/parts/run_record.h"
#include "io/tag/blocks.h"
#include "stages/brick/codec.h"
#include "stages/grid/lattice.h"
#include "stages/phantom/phantom.h"
#include "tests/fuzz/memory_files.h"
#include "tests/fuzz/targets.h"
#include "tests/support/runs.h"

namespace tagrid::fuzz {
namespace {

using Input = std::vector<std::uint8_t>;

Input input_of(std::string_view text) { return {text.begin(), text.end()}; }

Input content_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A small file of a phantom: what the golden files are too large for.
Input small_file(Index3 dims, SampleType type, const EncodeOptions& options) {
  static const Folder folder;
  std::string raw;
  with_sample_type(type, [&](auto t) {
    using T = decltype(t);
    std::vector<T> slice(static_cast<std::size_t>(dims.x * dims.y));
    for (std::int64_t z = 0; z < dims.z; ++z) {
      phantom_slice<T>(dims, 1, z, slice);
      raw.append(reinterpret_cast<const char*>(slice.data()), slice.size() * sizeof(T));
    }
  });
  SourceDescription description(RawDescription{.dims = dims, .type = type});
  description.spacing = GivenSpacing{{0.5, 0.5, 2}};
  const std::string from = folder.write("in", raw), to = folder.write("out.tag", "");
  encode_volume(from, description, to, true, options, Resources(1));
  return content_of(to);
}

std::vector<Input> small_files() {
  std::vector<Input> files;
  for (const auto& [exact, bounded] : {std::pair{SampleType::int16, SampleType::uint8},
                                       {SampleType::uint32, SampleType::int32},
                                       {SampleType::float32, SampleType::float64}})
    for (const bool grid : {false, true})
      for (const int error : {0, 3}) {
        EncodeOptions options{
            .grid_only = grid, .max_error = error, .cube_size = 4, .brick_edge = error == 0 ? 1 : 2};
        if (is_wide_type(exact)) options.range = {-1024, 3072};
        if (error > 0 && !grid) options.surface_error = 1;
        if (!grid) options.overviews = {4};
        files.push_back(small_file({9, 6, 7}, error == 0 ? exact : bounded, options));
      }
  return files;
}

std::uint32_t u32(const Input& file, std::size_t at) {
  return load_little_endian<std::uint32_t>(reinterpret_cast<const std::byte*>(file.data() + at));
}

/// The parts of a .tag file, each as the input of its target.
void add_parts(const Input& file, std::map<std::string, Seeds>& seeds) {
  const std::size_t header_size = u32(file, 12);
  seeds["header"].emplace_back(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(header_size));
  std::size_t at = header_size;
  const auto block_bytes = [&](std::size_t block) -> std::size_t {
    const std::uint32_t marker = u32(file, block);
    if (marker == member_marker) return member_frame_size + u32(file, block + 12);
    return marker < 4 ? packed_frame_size + u32(file, block + 8) : 4 + marker + 8;
  };
  while (u32(file, at) != 0) at += block_bytes(at);
  const std::size_t size = u32(file, at + 4), packed = u32(file, at + 12);
  const int cube_size = file[42] | file[43] << 8;
  std::uint8_t kind = 0;
  while (4 << kind != cube_size) ++kind;
  const auto first = file.begin() + static_cast<std::ptrdiff_t>(at + 20);
  Input input = {static_cast<std::uint8_t>(kind | 8), static_cast<std::uint8_t>(size / 8)};
  input.insert(input.end(), first, first + static_cast<std::ptrdiff_t>(packed));
  seeds["index"].push_back(input);
  std::vector<std::byte> fields;
  const auto bytes = std::as_bytes(std::span(file)).subspan(at + 20, packed);
  if (!zstd_decompress(bytes, size, fields).ok()) throw std::runtime_error("a whole file is broken");
  input = {kind, 0};
  for (const std::byte b : fields) input.push_back(static_cast<std::uint8_t>(b));
  seeds["index"].push_back(input);
}

/// A brick of few values: an affine one, a table, and labels.
void add_bricks_of_few(std::map<std::string, Seeds>& seeds) {
  for (const unsigned kind : {0u, 1u, 2u})
    for (unsigned number = 0; number < 8; ++number) {
      CodingParameters p;
      p.type = static_cast<SampleType>(1 + number);
      p.dims = {12, 12, 12};
      p.cube_size = 8;
      p.brick_edge = 1;
      p.max_level = max_level(p.cube_size);
      p.field_scale = 1;
      const Index3 size = p.bricks().owned_box({0, 0, 0}).size();
      BrickSamples samples{p.bricks().owned_box({0, 0, 0}), {}};
      with_sample_type(p.type, [&](auto type) {
        using T = decltype(type);
        std::vector<T> values;
        for (std::int64_t i = 0; i < size.x * size.y * size.z; ++i) {
          const std::int64_t x = i % size.x, level = kind == 2 ? x / 5 : (x + i / 40) % 12 + i * i % 3;
          values.push_back(static_cast<T>(kind == 1 ? level * level / 2 + level * 2 : level * 7));
        }
        const auto bytes = std::as_bytes(std::span(values));
        samples.bytes.assign(bytes.begin(), bytes.end());
      });
      BrickCode code;
      encode_brick(samples, LatticeBits(p.bricks().closed_box({0, 0, 0})), p, {0, 0, 0}, code);
      const auto activity = static_cast<unsigned>(code.activity.size());
      Input input = {static_cast<std::uint8_t>((number & 3) | (number & 4) << 5 | 8),
                     255,
                     11,
                     11,
                     11,
                     0,
                     255,
                     0,
                     static_cast<std::uint8_t>(activity),
                     static_cast<std::uint8_t>(activity >> 8)};
      input.insert(input.end(), code.activity.begin(), code.activity.end());
      input.insert(input.end(), code.values.begin(), code.values.end());
      seeds["brick"].push_back(input);
    }
}

/// Bricks behind the bytes that brick_target.cpp expects: of the first one of a small file.
void add_bricks(std::map<std::string, Seeds>& seeds) {
  for (unsigned kind = 0; kind < 128; ++kind) {
    const unsigned number = kind % 8;
    const bool bounded = (kind & 8) != 0, grid = (kind & 16) != 0,
               two_bounds = bounded && !grid && (kind & 32), large = (kind & 64) != 0;
    const auto type = static_cast<SampleType>(1 + number);
    EncodeOptions options{.grid_only = grid,
                          .max_error = bounded ? 4.0 : 0.0,
                          .cube_size = large ? 8 : 4,
                          .brick_edge = large ? 1 : 2};
    if (is_wide_type(type)) options.range = {-1024, 3072};
    if (two_bounds) options.surface_error = 1;
    const Input file = small_file({12, 11, 10}, type, options);
    const std::size_t at = u32(file, 12), activity = u32(file, at + 4), all = u32(file, at) - 4;
    const auto error_of_points = load_little_endian<double>(reinterpret_cast<const std::byte*>(&file[104]));
    Input input = {
        static_cast<std::uint8_t>((number & 3) | (number & 4) << 5 | (grid ? 4 : 0) | (large ? 8 : 16)),
        255,
        11,
        10,
        9,
        static_cast<std::uint8_t>(grid ? error_of_points : *options.max_error),
        static_cast<std::uint8_t>(two_bounds ? 1 : 255),
        0,
        static_cast<std::uint8_t>(activity),
        static_cast<std::uint8_t>(activity >> 8)};
    const auto first = file.begin() + static_cast<std::ptrdiff_t>(at + 8);
    input.insert(input.end(), first, first + static_cast<std::ptrdiff_t>(all));
    seeds["brick"].push_back(input);
  }
}

std::string gzipped(std::string_view text) {
  z_stream z = {};
  if (deflateInit2(&z, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK) throw std::bad_alloc();
  std::string out(1000 + text.size(), '\0');
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  z.avail_in = static_cast<uInt>(text.size());
  z.next_out = reinterpret_cast<Bytef*>(out.data());
  z.avail_out = static_cast<uInt>(out.size());
  deflate(&z, Z_FINISH);
  out.resize(z.total_out);
  deflateEnd(&z);
  return out;
}

std::string bzip2ed(std::string_view text) {
  std::string in(text), out(1000 + text.size(), '\0');
  auto size = static_cast<unsigned>(out.size());
  if (BZ2_bzBuffToBuffCompress(out.data(), &size, in.data(), static_cast<unsigned>(in.size()), 1, 0, 0) !=
      BZ_OK)
    throw std::bad_alloc();
  out.resize(size);
  return out;
}

void add_volumes(Seeds& seeds) {
  const std::string shape = "NRRD0005\ntype: short\ndimension: 3\nsizes: 3 4 2\nendian: big\n";
  const std::string more =
      "# a comment\ncontent: a foot\nspace: left-posterior-superior\n"
      "space directions: (0.5,0,0) (0,0.5,0) (0,0,-2)\nspace origin: (1,2,-3.5)\nkinds: domain domain "
      "domain\n"
      "space units: \"mm\" \"mm\" \"mm\"\nmeasurement frame: (1,0,0) (0,1,0) (0,0,1)\nkey:=value\n";
  const std::string axes = "spacings: 1 nan 2.5\naxis mins: 0 1 2\ncenters: node cell node\n";
  std::string samples(48, '\x5');
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<char>(i * 37);
  const std::string zipped = gzipped(samples);
  seeds.push_back(input_of(shape + "encoding: raw\n\n" + samples));
  seeds.push_back(input_of(shape + more + "encoding: raw\n\n" + samples));
  seeds.push_back(input_of(shape + axes + "encoding: gzip\n\n" + zipped));
  seeds.push_back(input_of(shape + "encoding: gz\n\n" + zipped.substr(0, 20) + zipped));
  seeds.push_back(input_of(shape + "encoding: gz\nbyte skip: 2\n\n" + gzipped("ab" + samples)));
  seeds.push_back(
      input_of(shape + "encoding: gzip\n\n" + gzipped(samples.substr(0, 9)) + gzipped(samples.substr(9))));
  seeds.push_back(input_of(shape + axes + "encoding: bzip2\n\n" + bzip2ed(samples)));
  seeds.push_back(input_of(shape + "encoding: bz2\nbyte skip: 2\n\n" + bzip2ed("ab" + samples.substr(0, 9)) +
                           bzip2ed(samples.substr(9))));
  seeds.push_back(input_of(shape + "encoding: bz2\ndata file: LIST\nd\nd\n\n" + bzip2ed(samples.substr(24))));
  seeds.push_back(
      input_of("NRRD0005\ntype: short\ndimension: 4\nsizes: 1 3 4 2\nendian: big\nspacings: nan 1 2 "
               "3\nunits: \"\" \"a\" "
               "\"b\" \"c\"\nkinds: vector domain domain domain\nencoding: raw\n\n" +
               samples));
  seeds.push_back(
      input_of("NRRD0005\ntype: short\ndimension: 5\nsizes: 1 3 4 2 1\nendian: big\nspace dimension: "
               "3\nspace directions: none "
               "(1,0,0) (0,2,0) (0,0,3) none\nencoding: raw\n\n" +
               samples));
  seeds.push_back(
      input_of("NRRD0005\ntype: short\ndimension: 2\nsizes: 6 4\nendian: big\nspace dimension: 2\nspace "
               "directions: (1,0) "
               "(0,2)\nspace origin: (3,4)\nencoding: raw\n\n" +
               samples));
  seeds.push_back(input_of(shape + "encoding: raw\nline skip: 1\nbyte skip: 3\n\na line\nxyz" + samples));
  seeds.push_back(input_of(shape + "encoding: raw\nbyte skip: -1\ndata file: d\n\nanything" + samples));
  seeds.push_back(input_of(shape + axes + "encoding: raw\ndata file: d\n\n" + samples));
  seeds.push_back(input_of(shape + more + "encoding: gzip\nline skip: 1\nbyte skip: 2\ndatafile: d\n\nx\n" +
                           gzipped("ab" + samples)));
  seeds.push_back(input_of(shape + "encoding: raw\ndata file: LIST\nd\nd\n\n" + samples.substr(24)));
  seeds.push_back(input_of(shape + "encoding: raw\ndata file: s%03d 1 3 2 2\n\n" + samples));
}

void add_record(Seeds& seeds) {
  RunRecord record;
  record.program = "tagrid 1.2.3";
  record.settings = {{"max-error", "2"}, {"cube", "32"}, {"parts", ""}};
  record.inputs = {{"a.nhdr", 100, 5, 1, 2, 3, 4, 77}, {"a.raw", 1 << 20, 6, -1, 2, 3, 4, 78}};
  record.header.resize(40, std::byte{9});
  record.error_rule = "psnr 55";
  record.reason_of_bound = "maximum error set to 2, to reach 55 dB";
  for (const auto& bytes : {serialize_record(record), serialize_record({})})
    seeds.emplace_back(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                       reinterpret_cast<const std::uint8_t*>(bytes.data() + bytes.size()));
}

void add_part(Seeds& seeds) {
  static const Folder folder;
  const std::string path = folder.write("part", "");
  std::filesystem::remove(path);
  PartWriter writer(path, seed_part, seed_part_parameters());
  for (std::int64_t i = 0; i < seed_part.bricks; ++i) {
    BrickBytes brick;
    brick.id = seed_part.first_brick + i;
    brick.activity.assign(static_cast<std::size_t>(3 * i), 5);
    brick.values.assign(static_cast<std::size_t>(20 - i), 6);
    writer.write_brick(brick, {});
  }
  writer.finish();
  seeds.push_back(content_of(path));
}

void add_numbers(Seeds& seeds) {
  std::istringstream texts(
      "0 020 -17 +3 9223372036854775807 1.5 -0 1e300 .5 5. 4K 17M 17179869183G 512,512,300 "
      "2147483648,1,1 0.5,0.5,1e-3 -1024:3072 0:1e3 nan inf 0x1F 1,,2");
  for (std::string text; texts >> text;) seeds.push_back(input_of(text));
}

/// Both versions in both byte orders, with a qform, an sform or neither.
void add_nifti_files(Seeds& seeds) {
  for (unsigned kind = 0; kind < 12; ++kind) {
    const bool is_second = (kind & 1) != 0, is_big = (kind & 2) != 0;
    const unsigned form = kind / 4;
    std::string text(is_second ? 544 : 352, '\0');
    const auto put = [&](std::size_t at, auto value) {
      std::byte bytes[sizeof value];
      store_little_endian(bytes, value);
      if (is_big) std::ranges::reverse(bytes);
      std::memcpy(text.data() + at, bytes, sizeof value);
    };
    put(0, is_second ? 540 : 348);
    text.replace(is_second ? 4 : 344, is_second ? 8 : 4,
                 is_second ? std::string("n+2\0\r\n\032\n", 8) : std::string("n+1\0", 4));
    const std::int64_t dims[] = {4, 3, 4, 2, form == 2 ? 2 : 1, 1, 1, 1};
    for (std::size_t i = 0; i < 8; ++i)
      if (is_second) {
        put(16 + i * 8, dims[i]);
        put(104 + i * 8, 1.5);
      } else {
        put(40 + i * 2, static_cast<std::int16_t>(dims[i]));
        put(76 + i * 4, 1.5F);
      }
    put(is_second ? 12 : 70, std::int16_t{4});
    if (is_second)
      put(168, std::int64_t{544});
    else
      put(108, 352.0F);
    if (form == 1) {
      is_second ? put(344, std::int32_t{1}) : put(252, std::int16_t{1});
      is_second ? put(352, 0.5) : put(256, 0.5F);
    } else if (form == 2) {
      is_second ? put(348, std::int32_t{1}) : put(254, std::int16_t{1});
      for (std::size_t i = 0; i < 3; ++i) is_second ? put(400 + i * 40, 2.0) : put(280 + i * 20, 2.0F);
    }
    text += std::string(3 * 4 * 2 * 2 * (form == 2 ? 2 : 1), 'x');
    seeds.push_back(input_of(text));
    if (kind < 2) seeds.push_back(input_of(gzipped(text)));
  }
}

void add_meta_images(Seeds& seeds) {
  const std::string begin = "ObjectType = Image\nNDims = 3\nDimSize = 3 4 2\nElementType = MET_SHORT\n",
                    samples(48, 'x');
  seeds.push_back(input_of(begin + "ElementDataFile = LOCAL\n" + samples));
  seeds.push_back(input_of(
      begin +
      "ElementSpacing = 1 2 3\nOffset = 1 2 3\nTransformMatrix = 0 1 0 1 0 0 0 0 1\n"
      "ElementByteOrderMSB = True\nModality = MET_MOD_CT\nHeaderSize = -1\nElementDataFile = d\n..." +
      samples));
  seeds.push_back(input_of(begin + "HeaderSize = 3\nElementDataFile = d%02d 1 2 1\n" + samples));
  seeds.push_back(input_of(begin + "ElementDataFile = LIST\nd\nd\n"));
  seeds.push_back(input_of(begin + "CompressedData = True\nElementDataFile = LOCAL\n" + gzipped(samples)));
  seeds.push_back(
      input_of("NDims: 4\nDimSize: 3 2 2 2\nElementType: MET_SHORT\nElementDataFile: LOCAL\n" + samples));
}

void add_vendors_files(Seeds& seeds) {
  seeds.push_back(
      input_of("{volume1}\n[representation]\nsize = 3 4 2\n[file1]\nName = a.vol\nSize = 3 4 2\nDatatype = "
               "unsigned integer\n"
               "BitsPerElement = 16\nFileFormat = raw\nSkipHeader = 0\n{volumeprimitive1}\n[geometry]\n"
               "resolution = 0.1 0.1 0.2\nunit = mm\n"));
  seeds.push_back(
      input_of("{volume1}\n[file1]\nName = a.vol\nSize = 3 4 1\nDatatype = float\nBitsPerElement = 32\n"));
  for (const char* size : {"4", "2", "1"})
    seeds.push_back(input_of(std::string("[XTekCT]\nVoxelsX=3\nVoxelsY=4\nVoxelsZ=") + size +
                             "\nVoxelSizeX=0.1\nVoxelSizeY=0.1\nVoxelSizeZ=0.2\nName=scan\n"));
  seeds.push_back(input_of(
      "! PyHST_SLAVE VOLUME INFO FILE\nNUM_X = 3\nNUM_Y = 2\nNUM_Z = 2\nvoxelSize = 0.28\nBYTEORDER = "
      "LOWBYTEFIRST\n"));
  seeds.push_back(
      input_of("NUM_X = 3\nNUM_Y = 4\nNUM_Z = 2\nBYTEORDER = HIGHBYTEFIRST\nDATA_TYPE = int16\n"));
  std::string scanco = "CTDATA-HEADER_V1" + std::string(496, '\0');
  const auto put = [&](std::size_t at, std::int32_t value) {
    std::byte bytes[4];
    store_little_endian(bytes, value);
    std::memcpy(scanco.data() + at, bytes, 4);
  };
  put(16, 3);
  for (const auto& [at, value] :
       {std::pair{44, 3}, {48, 4}, {52, 2}, {56, 30}, {60, 40}, {64, 50}, {88, 4096}})
    put(static_cast<std::size_t>(at), value);
  seeds.push_back(input_of(scanco + std::string(48, 'x')));
}

void add_other_volumes(Seeds& seeds) {
  const std::string samples(48, 'x');
  for (const char* dictionary : {"{'descr': '<i2', 'fortran_order': False, 'shape': (2, 4, 3), }          \n",
                                 "{'descr': '>f4', 'fortran_order': True, 'shape': (3, 2, 1, 2), }\n"}) {
    const std::string text = dictionary;
    seeds.push_back(input_of(text));
    seeds.push_back(input_of("\x93NUMPY\1" + std::string(1, '\0') + static_cast<char>(text.size()) +
                             std::string(1, '\0') + text + samples));
  }
  for (const std::int32_t mode : {0, 1, 2}) {
    std::string map(1024 + 16, '\0');
    const auto put = [&](std::size_t at, auto value) {
      store_little_endian(reinterpret_cast<std::byte*>(map.data()) + at, value);
    };
    for (const auto& [at, value] : {std::pair{0, 3},
                                    {4, 4},
                                    {8, mode == 2 ? 1 : 2},
                                    {12, mode},
                                    {28, 3},
                                    {32, 4},
                                    {36, 2},
                                    {64, 1},
                                    {68, 3},
                                    {72, 2},
                                    {88, 401 * mode},
                                    {92, 16}})
      put(static_cast<std::size_t>(at), std::int32_t{value});
    for (const std::size_t at : {40, 44, 48, 196}) put(at, 12.5f);
    map.replace(208, 6, "MAP DD");
    seeds.push_back(input_of(map + samples.substr(0, mode == 0 ? 24 : 48)));
  }
  const std::string edf =
      "{\nHeaderID = EH:000001:000000:000000 ;\nByteOrder = HighByteFirst ;\nDataType = SignedShort ;\nDim_1 "
      "= 3 "
      ";\nDim_2 = 4 ;\nSize = 24 ;\nPSize_1 = 1e-6 ;\n}\n";
  seeds.push_back(input_of(edf + samples.substr(24) + edf + samples.substr(24)));
  seeds.push_back(
      input_of("ncaa\nrank=3;\ntype=raster;\nformat=slice;\nbits=16;\nbands=1;\nsize=3 4 2;\nspacing=1 1 "
               "2;\norigin=0 1 2;\nelementsize=0.05;\ndata_scale=2;\n\f\n" +
               samples));
  const std::string amira =
      "# AmiraMesh BINARY-LITTLE-ENDIAN 2.1\ndefine Lattice 3 4 2\nParameters {\n    Units { Coordinates "
      "\"mm\" }\n"
      "    BoundingBox 0 2 0 3 0 1,\n    CoordType \"uniform\"\n}\nLattice { short Data } @1\n@1\n";
  seeds.push_back(input_of(amira + samples + "\n"));
  std::string runs = amira;
  runs.replace(runs.find("short Data } @1"), 15, "byte Data } @1(HxByteRLE,7)");
  seeds.push_back(input_of(runs + "\x10"
                                  "a\x83"
                                  "bcd\x05"
                                  "e"));
}

/// Chunks with checksums that nobody reads here.
void add_pngs(Seeds& seeds) {
  const auto chunk = [](std::string_view name, const std::string& content) {
    std::string text(4, '\0');
    text[3] = static_cast<char>(content.size());
    return text.append(name).append(content).append(4, 'c');
  };
  for (const int bits : {8, 16})
    for (const char color : {0, 2}) {
      const std::string head =
          std::string("\0\0\0\5\0\0\0\3", 8) + static_cast<char>(bits) + color + std::string(3, '\0');
      std::string text = "\x89PNG\r\n\x1a\n" + chunk("IHDR", head);
      text +=
          chunk("pHYs", std::string("\0\0\x2e\x23\0\0\x2e\x23\1", 9)) + chunk("tRNS", std::string(2, '\0'));
      text += chunk("IDAT", std::string(20, 'd')) + chunk("IEND", "") + (bits == 8 ? "notes" : "");
      seeds.push_back(input_of(text));
    }
}

void add_bitmaps(Seeds& seeds) {
  for (const std::uint32_t header : {12, 40, 56, 108, 124})
    for (const bool is_top_down : {false, true}) {
      const bool is_core = header == 12;
      const int greys = header == 56 ? 20 : 256;
      std::string text(14 + header, '\0');
      const auto put = [&](std::size_t at, auto value) {
        store_little_endian(reinterpret_cast<std::byte*>(text.data()) + at, value);
      };
      text.replace(0, 2, "BM");
      put(10,
          static_cast<std::uint32_t>(14 + header) + static_cast<std::uint32_t>(greys * (is_core ? 3 : 4)));
      put(14, header);
      if (is_core) {
        put(18, std::uint16_t{5});
        put(20, std::uint16_t{3});
        put(24, std::uint16_t{8});
      } else {
        put(18, std::int32_t{5});
        put(22, std::int32_t{is_top_down ? -3 : 3});
        put(28, std::uint16_t{8});
        put(46, static_cast<std::uint32_t>(greys % 256));
      }
      for (int i = 0; i < greys; ++i)
        text += std::string(3, static_cast<char>(i)) + std::string(is_core ? 0 : 1, '\0');
      seeds.push_back(input_of(text + std::string(24, '\x7')));
    }
}

/// An image with frames, in each way to write elements.
void add_dicom_files(Seeds& seeds) {
  const DicomCoding meta = {true, false};
  for (const auto& [coding, syntax] : {std::pair(DicomCoding{true, false}, "1.2.840.10008.1.2.1"),
                                       {DicomCoding{false, false}, "1.2.840.10008.1.2"},
                                       {DicomCoding{true, true}, "1.2.840.10008.1.2.2"}}) {
    const auto element = [coding = coding](std::uint16_t group, std::uint16_t number, const char* vr,
                                           std::string value) {
      return dicom_element({group, number}, vr, std::move(value), coding);
    };
    const std::string type = element(0x0008, 0x9007, "CS", "ORIGINAL\\PRIMARY");
    const std::string groups = dicom_item(element(0x0018, 0x9329, "SQ", dicom_item(type, coding)), coding);
    const std::string set = element(0x0008, 0x0008, "CS", "ORIGINAL\\PRIMARY") +
                            element(0x0008, 0x0016, "UI", "1.2") + element(0x0008, 0x0018, "UI", "1.3") +
                            element(0x0008, 0x2112, "SQ", dicom_item("", coding)) +
                            element(0x0020, 0x000E, "UI", "1.4") + element(0x0028, 0x0106, "US", "ab") +
                            element(0x0028, 0x2112, "DS", "2.5") + element(0x5200, 0x9230, "SQ", groups) +
                            element(0x7FE0, 0x0010, "OW", "samples ") + element(0xFFFC, 0xFFFC, "OB", "");
    const std::string of_meta = dicom_element({0x0002, 0x0003}, "UI", "1.3", meta) +
                                dicom_element({0x0002, 0x0010}, "UI", syntax, meta);
    seeds.push_back(input_of(std::string(128, '\0') + "DICM" + of_meta + set));
    seeds.push_back(input_of(set));
  }
}

}  // namespace

std::map<std::string, Seeds> make_seeds(const std::string& golden) {
  std::map<std::string, Seeds> seeds;
  for (const auto& entry : std::filesystem::directory_iterator(golden)) {
    if (entry.path().extension() != ".tag") continue;
    const Input file = content_of(entry.path());
    add_parts(file, seeds);
  }
  for (const Input& file : small_files()) {
    add_parts(file, seeds);
    seeds["file"].push_back(file);
    // All of the volume.
    Input input = {0, 0, 0, 63, 63, 63};
    input.insert(input.end(), file.begin(), file.end());
    seeds["blocks"].push_back(input);
  }
  add_bricks(seeds);
  add_bricks_of_few(seeds);
  add_volumes(seeds["nrrd"]);
  add_nifti_files(seeds["nifti"]);
  add_meta_images(seeds["metaimage"]);
  add_vendors_files(seeds["vendors"]);
  add_other_volumes(seeds["other_volumes"]);
  add_bitmaps(seeds["bmp"]);
  add_pngs(seeds["png"]);
  add_dicom_files(seeds["dicom"]);
  add_record(seeds["record"]);
  add_part(seeds["part"]);
  add_numbers(seeds["numbers"]);
  return seeds;
}

}  // namespace tagrid::fuzz
