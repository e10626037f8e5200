// Each stage takes at most the memory that it declares, and not much less.
#include <cstring>
#include <functional>
#include <random>
#include <string>

#include "stages/brick/codec.h"
#include "stages/coarsen/coarsen.h"
#include "stages/criterion/marking.h"
#include "stages/criterion/subdivide.h"
#include "stages/grid/lattice.h"
#include "stages/mesh/mesh_error.h"
#include "stages/sample/numbers.h"
#include "tests/support/counted_heap.h"
#include "tests/support/points.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

/// A sample of noise that the coders find dear: any integer, any mantissa of a float.
std::uint64_t noise(SampleType type, std::mt19937_64& random) {
  const std::uint64_t bits = random();
  if (type == SampleType::float32) return (bits & 0x7fffff) | 0x3f800000 | (bits & 0x80000000);
  if (type == SampleType::float64) return bits >> 12 | std::uint64_t{0x3ff} << 52 | (bits & 1) << 63;
  return bits;
}

/// One in `rarely` is noise, the others are 1: the noise that surprises is dearer than the one that is usual.
/// `narrow`: whole numbers below 2^16, which types of 32 and 64 bits code in another way. `few`: as many values
/// as a table can have, far apart.
BrickSamples samples_of(const CodingParameters& p, const Box& box, std::uint64_t rarely, bool narrow = false,
                        bool few = false) {
  const std::size_t size = size_of(p.type);
  BrickSamples samples{box, std::vector<std::byte>(static_cast<std::size_t>(box.count()) * size)};
  std::mt19937_64 random(7);
  std::vector<std::uint64_t> values;
  if (few)
    for (std::int64_t i = 0; i < box.count() / 4; ++i)
      values.push_back(narrow || size < 4 ? random() % 8192 * 8 : noise(p.type, random));
  for (std::size_t at = 0; at < samples.bytes.size(); at += size) {
    const bool is_noise = random() % rarely == 0;
    std::uint64_t sample = is_noise ? noise(p.type, random) : std::uint64_t{1};
    if (few) sample = values[random() % values.size()];
    if (narrow) {
      const std::uint64_t whole = few ? sample : is_noise ? random() % 65536 : 1;
      sample = p.type == SampleType::float32   ? bits_of(static_cast<float>(whole))
               : p.type == SampleType::float64 ? bits_of(static_cast<double>(whole))
                                               : whole;
    }
    std::memcpy(samples.bytes.data() + at, &sample, size);
  }
  return samples;
}

struct Shape {
  int cube_size, brick_edge;
};
// Types of one size differ in nothing that is allocated, but for what makes them wide, or floats.
constexpr SampleType types[] = {SampleType::uint8, SampleType::uint16, SampleType::uint32,
                                SampleType::float32, SampleType::float64};

// For small bricks the models are most of it: some are larger.
std::vector<Shape> shapes_of(SampleType type) {
  if (type == SampleType::uint16) return {{16, 2}, {16, 3}};
  return {{16, 2}};
}

CodingParameters parameters_of(SampleType type, const Shape& shape) {
  CodingParameters p;
  p.type = type;
  p.cube_size = shape.cube_size;
  p.brick_edge = shape.brick_edge;
  p.max_level = max_level(p.cube_size);
  p.dims = {3 * shape.cube_size * shape.brick_edge, 2 * shape.cube_size * shape.brick_edge,
            2 * shape.cube_size * shape.brick_edge - 5};
  p.accuracy = 20;
  p.field_scale = is_float_type(type) ? 10 : is_wide_type(type) ? 1e-8 : 0.01;
  return p;
}

struct Case {
  std::string name;
  std::function<void(CodingParameters&)> set;
};
const Case cases[] = {
    {"lossless", [](CodingParameters&) {}},
    {"bounded", [](CodingParameters& p) { p.max_error = is_float_type(p.type) ? 1e-3 : 2; }},
    {"two bounds",
     [](CodingParameters& p) {
       p.max_error = is_float_type(p.type) ? 1e-3 : 2;
       p.surface_error = 0;
     }},
    {"mesh",
     [](CodingParameters& p) {
       p.max_error = is_float_type(p.type) ? 1e-3 : 1;
       p.mesh_error = 3;
     }},
    {"fast", [](CodingParameters& p) { p.effort = Effort::fast; }},
    {"best", [](CodingParameters& p) { p.effort = Effort::best; }},
    {"transform",
     [](CodingParameters& p) {
       // So small that noise takes nearly as many events as the encoder allows.
       p.max_error = p.type == SampleType::uint8 ? 50 : 10000;
       p.transform_step = p.type == SampleType::uint8 ? 12 : 3000;
       p.filter.fill(20);
     }},
    {"grid",
     [](CodingParameters& p) {
       p.mode = FileMode::grid;
       p.max_error = -1;
     }},
    {"grid, mesh",
     [](CodingParameters& p) {
       p.mode = FileMode::grid;
       p.max_error = -1;
       p.mesh_error = 3;
       p.point_error = is_float_type(p.type) ? 1e-3 : 1;
     }},
};

/// All points of a box, of which every `n`th, and the points that these need, are active.
LatticeBits activity_of(const Box& box, int cube_size, std::uint64_t n) {
  LatticeBits active(box);
  std::mt19937_64 random(3);
  for (const auto [x, y, z] : points_of(box))
    if (n != 0 && random() % n == 0) active.set({x, y, z});
  close_under_parents(active, cube_size);
  return active;
}

void expect_stated(const std::string& what, std::uint64_t stated, std::uint64_t peak, double times) {
  EXPECT_LE(peak, stated) << what;
  EXPECT_LE(static_cast<double>(stated), times * static_cast<double>(peak)) << what << ": " << peak;
}

std::string text(const CodingParameters& p, const std::string& of) {
  return std::string(name_of(p.type)) + ", " + of + ", bricks of " + std::to_string(p.brick_edge) + " x " +
         std::to_string(p.cube_size);
}

class WorkingBytes : public testing::Test {
 protected:
  void SetUp() override {
    if (sanitized) GTEST_SKIP() << "a sanitizer allocates in its own way";
    // Tables that all bricks share are made when the first one is encoded.
    const CodingParameters p = parameters_of(SampleType::uint8, {16, 2});
    BrickCode code;
    encode_brick(samples_of(p, samples_to_encode(p, {0, 0, 0}), 1, false),
                 LatticeBits(p.bricks().closed_box({0, 0, 0})), p, {0, 0, 0}, code);
  }
};

TEST_F(WorkingBytes, OfEncodingAndDecodingAreWhatNoiseTakes) {
  for (const SampleType type : types)
    for (const Shape& shape : shapes_of(type))
      for (const Case& c : cases) {
        CodingParameters p = parameters_of(type, shape);
        c.set(p);
        const Index3 brick{0, 0, 0};
        const LatticeBits active = activity_of(p.bricks().closed_box(brick), p.cube_size, 2);
        std::uint64_t encode_peak = 0, decode_peak = 0, samples_peak = 0;
        struct Kind {
          std::uint64_t rarely;
          bool narrow, few;
        };
        constexpr Kind kinds[] = {{1, false, false}, {3, false, false}, {1, true, false},
                                  {3, true, false},  {1, false, true},  {1, true, true}};
        for (const Kind& kind : kinds) {
          const BrickSamples samples = samples_of(p, samples_to_encode(p, brick), kind.rarely,
                                                  kind.narrow && is_wide_type(type), kind.few);
          BrickCode code;
          const HeapPeak encoding;
          encode_brick(samples, active, p, brick, code);
          encode_peak = std::max(encode_peak, encoding.bytes());
          EXPECT_LE(code.activity.size() + code.values.size(), most_bytes_of_code(p, brick))
              << text(p, c.name);
          DecodedBrick decoded;
          HeapPeak decoding;
          ASSERT_TRUE(decode_brick({code.activity, code.values}, p, {}, decoded).ok());
          decode_peak = std::max(decode_peak, decoding.bytes());
          decoded = {};
          decoding = HeapPeak();
          ASSERT_TRUE(decode_brick({code.activity, code.values}, p, {0, Wanted::samples}, decoded).ok());
          samples_peak = std::max(samples_peak, decoding.bytes());
        }
        expect_stated("encoding " + text(p, c.name), working_bytes_of_encoding(p, brick), encode_peak, 3);
        // What bands take depends on the split, and noise has only one.
        const double slack = p.transform_step > 0 ? 1.35 : 1.1;
        expect_stated("decoding " + text(p, c.name),
                      working_bytes_of_decoding(p, brick, Wanted::samples_and_grid), decode_peak, slack);
        expect_stated("decoding samples of " + text(p, c.name),
                      working_bytes_of_decoding(p, brick, Wanted::samples), samples_peak, slack);
      }
}

TEST_F(WorkingBytes, OfMarkingSubdividingAndMeasuringAreWhatTheyTake) {
  for (const SampleType type : types)
    for (const Shape& shape : shapes_of(type))
      for (const Case& c : cases) {
        CodingParameters p = parameters_of(type, shape);
        c.set(p);
        const Index3 brick{1, 0, 0};
        const Box closed = p.bricks().closed_box(brick);
        {
          const BrickSamples samples = samples_of(p, closed.grown(mark_halo(p)), 1);
          const HeapPeak peak;
          const LatticeBits marks = mark_tile(samples, closed, closed, p);
          expect_stated("marking " + text(p, c.name), working_bytes_of_marking(p, closed.size()),
                        peak.bytes(), 1.05);
        }
        {
          const HeapPeak peak;
          LatticeBits marks(region_of_marks(closed, p.domain()));
          marks.set(closed.low);
          subdivide(std::move(marks), closed, p.domain());
          expect_stated("subdividing " + text(p, c.name), working_bytes_of_subdivision(closed, p.domain()),
                        peak.bytes(), 1.05);
        }
        const Index3 last{2, 1, 1};
        const Box box = p.bricks().closed_box(last);
        const BrickSamples samples = samples_of(p, box, 1);
        {
          LatticeBits refined(box);
          const HeapPeak peak;
          refine_to_bound(type, samples.bytes, {p.domain().volume(), p.cube_size, 1, false}, {}, refined);
          expect_stated("refining " + text(p, c.name), working_bytes_of_refining(box.size()), peak.bytes(),
                        1.05);
        }
        const LatticeBits active = activity_of(box, p.cube_size, 200);
        const HeapPeak peak;
        measure_mesh(samples, {}, active, p, last);
        expect_stated("measuring the mesh of " + text(p, c.name),
                      working_bytes_of_mesh_error(type, box.size()), peak.bytes(), 1.05);
      }
}

}  // namespace
}  // namespace tagrid
