// Writing with the library: the bytes, and encoders that fail, are cancelled, or are abandoned.
#include <sys/mman.h>

#include <thread>

#include "tests/pipeline/library/library_calls.h"
#include "tests/support/awkward_volumes.h"
#include "tests/support/points.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

struct LibraryEncoder : TemporaryFolder {
  // Makes volume.tag by the program, with the settings that the library gets.
  template <class T>
  void encode_by_program(Index3 dims, const std::vector<T>& samples, const tagrid_encode_options& options,
                         EncodeOptions same, const std::string& fields = "") {
    write_nrrd(path("volume.nrrd"), dims, samples, fields);
    same.cube_size = options.cube;
    if (options.brick != 0) same.brick_edge = options.brick;
    if (sizeof(T) > 2) same.range = {0, 100};
    encode_volume(path("volume.nrrd"), {}, path("volume.tag"), true, same, Resources(2));
  }

  template <class T>
  void expect_bytes_of_the_program(Index3 dims, const tagrid_encode_options& options,
                                   const EncodeOptions& same, unsigned seed, const std::string& fields) {
    const auto samples = awkward_volume<T>(Awkward(seed % static_cast<unsigned>(Awkward::count)), dims, seed);
    encode_by_program(dims, samples, options, same, fields);
    const tagrid_call call = call_of(1 + static_cast<int>(seed % 4));
    const Encoded encoded = encode(options, samples.data(), &call, 1 + seed % 5);
    ASSERT_EQ(encoded.status, TAGRID_OK) << encoded.message;
    ASSERT_EQ(encoded.bytes, content("volume.tag"));
    EXPECT_EQ(encoded.info.file_bytes, encoded.bytes.size());

    // And back.
    MemoryFile file{encoded.bytes};
    const ReaderHandle reader = open_reader(file);
    const tagrid_info info = info_of(reader.get());
    EXPECT_EQ(info.type, options.type);
    EXPECT_EQ(info.grid_only, options.grid_only);
    EXPECT_EQ(info.active_points, encoded.info.active_points);
    std::vector<T> out(samples.size());
    const tagrid_box all = whole_box(dims);
    ASSERT_EQ(tagrid_reader_read(reader.get(), &all, nullptr, info.type, out.data(), nullptr, nullptr),
              TAGRID_OK);
    decode_volume(path("volume.tag"), path("again.nrrd"), format_named("nrrd"), true, Resources(1));
    const auto decoded = read_samples<T>(path("again.nrrd"));
    EXPECT_EQ(std::memcmp(out.data(), decoded.data(), out.size() * sizeof(T)), 0);
    if (info.max_error == 0) {
      EXPECT_EQ(std::memcmp(out.data(), samples.data(), out.size() * sizeof(T)), 0);
    }
    EXPECT_EQ(tagrid_reader_verify(reader.get(), nullptr), TAGRID_OK) << tagrid_reader_message(reader.get());
  }

  template <class T>
  void expect_every_mode(unsigned seed) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    struct Mode {
      bool grid_only;
      double max_error, surface_error, mesh_error;
      tagrid_effort effort;
      bool grid_derived = false;
    };
    for (const Mode& mode : {Mode{false, nan, nan, nan, TAGRID_EFFORT_DEFAULT},
                             {false, 0, nan, nan, TAGRID_EFFORT_FAST},
                             {false, 0, nan, nan, TAGRID_EFFORT_BEST},
                             {false, 3, nan, nan, TAGRID_EFFORT_DEFAULT},
                             {false, 3, 1, nan, TAGRID_EFFORT_DEFAULT},
                             {true, nan, nan, nan, TAGRID_EFFORT_DEFAULT},
                             {true, 5, nan, nan, TAGRID_EFFORT_DEFAULT},
                             {false, 0, nan, 6, TAGRID_EFFORT_DEFAULT},
                             {false, 2, nan, nan, TAGRID_EFFORT_DEFAULT, true}}) {
      ++seed;
      const Index3 dims = {5 + seed % 13, 4 + seed % 11, 3 + seed % 17};
      tagrid_encode_options options = encode_options(dims, sample_type_of<T>());
      if (seed % 3 == 0) options.cube = 8, options.brick = 0;
      options.grid_only = mode.grid_only;
      options.grid = mode.grid_derived ? TAGRID_GRID_DERIVED : TAGRID_GRID_STORED;
      options.max_error = mode.max_error;
      options.surface_error = mode.surface_error;
      options.mesh_error = mode.mesh_error;
      options.effort = mode.effort;
      EncodeOptions same;
      const auto given = [](double value) { return std::isnan(value) ? std::nullopt : std::optional(value); };
      same.grid_only = mode.grid_only;
      same.grid = mode.grid_derived ? GridOrigin::derived : GridOrigin::stored;
      same.max_error = given(mode.max_error);
      same.surface_error = given(mode.surface_error);
      same.mesh_error = given(mode.mesh_error);
      same.effort = static_cast<Effort>(mode.effort);
      tagrid_geometry geometry = {};
      std::string fields;
      if (seed % 2 == 0) {
        geometry.has_spacing = 1;
        for (int axis = 0; axis < 3; ++axis) geometry.spacing[axis] = 0.5 + axis;
        options.geometry = &geometry;
        options.metadata = "key:=value\n";
        fields = "spacings: 0.5 1.5 2.5\nkey:=value\n";
      }
      SCOPED_TRACE("seed " + std::to_string(seed));
      expect_bytes_of_the_program<T>(dims, options, same, seed, fields);
    }
  }

  template <class T>
  void expect_overviews_of_the_program(const Index3& dims) {
    const auto samples = awkward_volume<T>(Awkward::smooth, dims, 3);
    struct Choice {
      std::vector<std::int64_t> given;  // empty: not given
      std::optional<std::vector<int>> same;
    };
    const std::vector<Choice> choices = {
        {{}, {}}, {{0}, std::vector<int>()}, {{4, 0}, {{4}}}, {{4, 16, 256, 0}, {{4, 16, 256}}}};
    for (const auto& [given, factors] : choices)
      for (const double max_error : {0.0, 3.0}) {
        tagrid_encode_options options = encode_options(dims, sample_type_of<T>());
        tagrid_geometry geometry = {};
        geometry.has_spacing = 1;
        for (int axis = 0; axis < 3; ++axis) geometry.spacing[axis] = 1 + axis;
        options.geometry = &geometry;
        options.max_error = max_error;
        options.overviews = given.empty() ? nullptr : given.data();
        encode_by_program(dims, samples, options, {.max_error = max_error, .overviews = factors},
                          "spacings: 1 2 3\n");
        for (const int threads : {1, 3}) {
          const tagrid_call call = call_of(threads);
          const Encoded encoded = encode(options, samples.data(), &call);
          ASSERT_EQ(encoded.status, TAGRID_OK) << encoded.message;
          ASSERT_EQ(encoded.bytes, content("volume.tag"));
          EXPECT_EQ(encoded.info.file_bytes, encoded.bytes.size());
        }
        MemoryFile file{content("volume.tag")};
        std::int64_t found[TAGRID_MOST_OVERVIEWS];
        ASSERT_EQ(tagrid_reader_overviews(open_reader(file).get(), found), TAGRID_OK);
        const std::vector<std::int64_t> wanted = given.empty() ? std::vector<std::int64_t>{4, 0} : given;
        EXPECT_TRUE(std::ranges::equal(wanted, std::span(found).first(wanted.size())));
      }
  }
};

TEST_F(LibraryEncoder, EveryTypeAndModeGivesTheBytesOfTheProgramAndComesBack) {
  expect_every_mode<std::uint8_t>(0);
  expect_every_mode<std::int8_t>(10);
  expect_every_mode<std::uint16_t>(20);
  expect_every_mode<std::int16_t>(30);
  expect_every_mode<std::uint32_t>(40);
  expect_every_mode<std::int32_t>(50);
  expect_every_mode<float>(60);
  expect_every_mode<double>(70);
}

constexpr Index3 dims = {21, 18, 16};

// A program that computes samples gets the bound that `tagrid encode` finds in the same file.
TEST_F(LibraryEncoder, BoundsThatFollowFromTheSamplesAreThoseOfTheProgram) {
  const Index3 dims = {40, 30, 20};
  const auto samples = blobs<std::int16_t>(dims, 1, 20);
  const std::pair<tagrid_error_rule, ErrorRule> rules[] = {
      {TAGRID_RULE_NOISE, {ErrorRule::Kind::noise, 1.5}},
      {TAGRID_RULE_RELATIVE, {ErrorRule::Kind::relative, 0.05}},
      {TAGRID_RULE_PSNR, {ErrorRule::Kind::psnr, 25}}};
  for (const auto& [rule, same_rule] : rules) {
    tagrid_encode_options options = encode_options(dims, SampleType::int16);
    encode_by_program(dims, samples, options, {.error_rule = same_rule});
    options.error_rule = rule;
    options.error_rule_value = same_rule.value;
    EXPECT_EQ(encode(options, samples.data()).status, TAGRID_INVALID_ARGUMENT) << "without samples";
    options.read_user = const_cast<std::int16_t*>(samples.data());
    options.read_samples = [](void* user, std::int64_t first, std::int64_t count, void* to) {
      std::memcpy(to, static_cast<const std::int16_t*>(user) + first, static_cast<std::size_t>(count) * 2);
      return 0;
    };
    const Encoded encoded = encode(options, samples.data());
    ASSERT_EQ(encoded.status, TAGRID_OK) << encoded.message;
    EXPECT_EQ(encoded.bytes, content("volume.tag"));
    EXPECT_GT(encoded.info.max_error, 0);
    options.read_samples = [](void*, std::int64_t, std::int64_t, void*) { return 7; };
    EXPECT_EQ(encode(options, samples.data()).status, TAGRID_IO_ERROR);
  }
}

TEST_F(LibraryEncoder, OverviewsAreThoseOfTheProgram) {
  expect_overviews_of_the_program<std::int16_t>({7, 601, 5});
  if (sanitized) return;  // threads meet in the same code
  expect_overviews_of_the_program<std::uint8_t>({530, 9, 13});
  expect_overviews_of_the_program<std::int32_t>({6, 7, 515});
  expect_overviews_of_the_program<float>({9, 10, 520});
}

TEST_F(LibraryEncoder, OverviewsThatCannotBeAreRefusedAndNothingIsReadBehindThem) {
  tagrid_encode_options options = encode_options(dims, SampleType::int16);
  const std::vector<std::vector<std::int64_t>> mistakes = {
      {-4}, {2}, {8}, {4, 4}, {16, 4}, {4, 4096}, {std::int64_t{1} << 32}, {4, (std::int64_t{1} << 32) + 16}};
  for (const auto& mistake : mistakes) {
    options.overviews = mistake.data();
    const Encoded encoded = encode(options, nullptr);
    EXPECT_EQ(encoded.status, TAGRID_INVALID_ARGUMENT) << mistake.back();
    EXPECT_TRUE(has(encoded.message, "powers of 4")) << encoded.message;
    EXPECT_EQ(encoded.bytes, "");
  }
}

TEST_F(LibraryEncoder, ATemporaryFileThatCannotBeCreatedIsAnErrorBeforeTheFirstByte) {
  const auto samples = awkward_volume<std::int16_t>(Awkward::smooth, dims, 4);
  tagrid_encode_options options = encode_options(dims, SampleType::int16);
  const std::int64_t factors[] = {4, 0};
  const std::string missing = path("missing");
  options.spool = missing.c_str();
  const Encoded without = encode(options, samples.data());
  EXPECT_EQ(without.status, TAGRID_OK) << without.message;
  options.overviews = factors;
  const Encoded refused = encode(options, samples.data());
  EXPECT_EQ(refused.status, TAGRID_IO_ERROR);
  EXPECT_TRUE(has(refused.message, missing)) << refused.message;
  EXPECT_EQ(refused.bytes, "");
  std::filesystem::create_directory(missing);
  const Encoded encoded = encode(options, samples.data());
  EXPECT_EQ(encoded.status, TAGRID_OK) << encoded.message;
  EXPECT_TRUE(std::filesystem::is_empty(missing));
}

TEST_F(LibraryEncoder, AWriteOfAnOverviewThatFailsEndsIt) {
  const auto samples = awkward_volume<std::int16_t>(Awkward::smooth, dims, 2);
  tagrid_encode_options options = encode_options(dims, SampleType::int16);
  const std::int64_t factors[] = {4, 16, 0};
  const Encoded without = encode(options, samples.data());
  options.overviews = factors;
  const Encoded whole = encode(options, samples.data());
  ASSERT_EQ(whole.status, TAGRID_OK);
  ASSERT_GT(whole.writes, without.writes + 2);
  for (int n = without.writes - 2; n < whole.writes; ++n) {
    const Encoded encoded = encode(options, samples.data(), nullptr, 3, n);
    ASSERT_EQ(encoded.status, TAGRID_IO_ERROR) << n;
    ASSERT_TRUE(has(encoded.message, "error 9")) << encoded.message;
    ASSERT_EQ(encoded.bytes, whole.bytes.substr(0, encoded.bytes.size()));
  }
}

TEST_F(LibraryEncoder, SlicesMayLieAnywhere) {
  const auto samples = awkward_volume<std::int16_t>(Awkward::noise, dims, 1);
  const tagrid_encode_options options = encode_options(dims, SampleType::int16);
  const Encoded dense = encode(options, samples.data());
  // z fastest, from the last to the first, and y with gaps.
  const std::int64_t strides[3] = {2 * dims.z * (dims.y + 3), 2 * dims.z, -2};
  std::vector<std::int16_t> turned(static_cast<std::size_t>(dims.x * (dims.y + 3) * dims.z));
  for (const auto [x, y, z] : points_of(dims))
    turned[static_cast<std::size_t>((x * (dims.y + 3) + y) * dims.z + dims.z - 1 - z)] =
        samples[static_cast<std::size_t>(Box::of_size(dims).offset({x, y, z}))];
  Encoded encoded;
  tagrid_encoder* opened = nullptr;
  ASSERT_EQ(tagrid_encoder_open(&options, Encoded::write, &encoded, nullptr, &opened), TAGRID_OK);
  const EncoderHandle encoder(opened);
  ASSERT_EQ(tagrid_encoder_write(opened, turned.data() + dims.z - 1, dims.z, strides), TAGRID_OK);
  ASSERT_EQ(tagrid_encoder_finish(opened, nullptr), TAGRID_OK);
  EXPECT_EQ(encoded.bytes, dense.bytes);
}

TEST_F(LibraryEncoder, AWriteThatFailsEndsIt) {
  const auto samples = awkward_volume<std::int16_t>(Awkward::smooth, dims, 2);
  const tagrid_encode_options options = encode_options(dims, SampleType::int16);
  const Encoded whole = encode(options, samples.data());
  ASSERT_EQ(whole.status, TAGRID_OK);
  ASSERT_GT(whole.writes, 10);
  const tagrid_call call = call_of(2);
  for (int n = 0; n < whole.writes; ++n) {
    const Encoded encoded = encode(options, samples.data(), &call, 1, n);
    ASSERT_EQ(encoded.status, TAGRID_IO_ERROR) << n;
    ASSERT_NE(encoded.message.find("error 9"), std::string::npos) << encoded.message;
    ASSERT_EQ(encoded.bytes, whole.bytes.substr(0, encoded.bytes.size()));
  }
}

TEST_F(LibraryEncoder, ItStopsWhereProgressSaysSo) {
  const auto samples = awkward_volume<std::int16_t>(Awkward::smooth, dims, 3);
  const tagrid_encode_options options = encode_options(dims, SampleType::int16);
  CountedProgress whole;
  tagrid_call call = call_of(2, CountedProgress::report, &whole);
  ASSERT_EQ(encode(options, samples.data(), &call).status, TAGRID_OK);
  EXPECT_EQ(whole.done, samples.size() * 2);
  EXPECT_EQ(whole.total, samples.size() * 2);
  for (int stop_at = 0; stop_at < whole.calls; ++stop_at) {
    CountedProgress at{.stop_at = stop_at};
    call.progress_user = &at;
    const Encoded stopped = encode(options, samples.data(), &call, 1);
    ASSERT_EQ(stopped.status, TAGRID_CANCELLED) << stop_at;
    ASSERT_EQ(stopped.message, "cancelled by the caller");
  }
}

TEST_F(LibraryEncoder, OneThatIsNotFinishedIsEndedWhenItIsClosed) {
  const auto samples = awkward_volume<std::int16_t>(Awkward::smooth, dims, 4);
  tagrid_encode_options options = encode_options(dims, SampleType::int16);
  const std::int64_t factors[] = {4, 16, 0};
  for (std::int64_t slices = 0; slices <= dims.z; ++slices) {
    options.overviews = slices % 2 == 0 ? factors : nullptr;
    Encoded encoded;
    tagrid_encoder* opened = nullptr;
    ASSERT_EQ(tagrid_encoder_open(&options, Encoded::write, &encoded, nullptr, &opened), TAGRID_OK);
    const EncoderHandle encoder(opened);
    ASSERT_EQ(tagrid_encoder_write(opened, samples.data(), slices, nullptr), TAGRID_OK);
    if (slices < dims.z) {
      EXPECT_EQ(tagrid_encoder_finish(opened, nullptr), TAGRID_INVALID_ARGUMENT);
      EXPECT_TRUE(has(std::string(tagrid_encoder_message(opened)), "slices"));
    }
  }
}

// An encoder whose output has failed. Few slices are ahead of the bricks, so not all of them can be fed.
EncoderHandle failed_encoder(Index3 deep, const std::vector<std::int16_t>& samples, Encoded& encoded) {
  const tagrid_encode_options options = encode_options(deep, SampleType::int16);
  encoded.write_fails_at = 1;
  tagrid_encoder* opened = nullptr;
  EXPECT_EQ(tagrid_encoder_open(&options, Encoded::write, &encoded, nullptr, &opened), TAGRID_OK);
  tagrid_status status = TAGRID_OK;
  for (std::int64_t z = 0; z < deep.z && status == TAGRID_OK; ++z)
    status = tagrid_encoder_write(opened, samples.data() + z * deep.x * deep.y, 1, nullptr);
  EXPECT_EQ(status, TAGRID_IO_ERROR);
  return EncoderHandle(opened);
}

// A failed encoder says why in every later call, also in finish() before all slices were written.
TEST_F(LibraryEncoder, LaterCallsSayWhyItFailed) {
  const Index3 deep = {21, 18, 200};
  const auto samples = awkward_volume<std::int16_t>(Awkward::smooth, deep, 5);
  Encoded encoded;
  const EncoderHandle encoder = failed_encoder(deep, samples, encoded);
  tagrid_encoder* const opened = encoder.get();
  const std::string message = tagrid_encoder_message(opened);
  EXPECT_EQ(tagrid_encoder_finish(opened, nullptr), TAGRID_IO_ERROR);
  EXPECT_EQ(tagrid_encoder_message(opened), message);
  EXPECT_EQ(tagrid_encoder_finish(opened, nullptr), TAGRID_IO_ERROR);
  // Also for another thread.
  std::thread([&] { EXPECT_EQ(tagrid_encoder_message(opened), message); }).join();
}

TEST_F(LibraryEncoder, SlicesAreCopiedOnlyOnceThereIsRoomForThem) {
  const Index3 deep = {16, 16, 400};
  const auto samples = awkward_volume<std::int16_t>(Awkward::smooth, deep, 12);
  Encoded encoded;
  const EncoderHandle encoder = failed_encoder(deep, samples, encoded);
  // Reading it would end the process.
  void* forbidden = mmap(nullptr, 4096, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(forbidden, MAP_FAILED);
  EXPECT_EQ(tagrid_encoder_write(encoder.get(), forbidden, 1, nullptr), TAGRID_IO_ERROR);
  munmap(forbidden, 4096);
}

TEST_F(LibraryEncoder, TheSmallestLimitOfMemoryIsEnoughAndLessIsRefused) {
  // The last ones have overviews.
  for (const Index3 size :
       {dims, Index3{100, 3, 5}, Index3{3, 90, 40}, Index3{600, 70, 9}, Index3{2, 3, 700}}) {
    const auto samples = awkward_volume<std::int16_t>(Awkward::noise, size, 6);
    const tagrid_encode_options options = encode_options(size, SampleType::int16);
    const std::uint64_t smallest = tagrid_encode_memory(&options);
    ASSERT_GT(smallest, 0u);
    tagrid_call call = call_of(4);
    call.memory_limit = smallest;
    const Encoded limited = encode(options, samples.data(), &call);
    EXPECT_EQ(limited.status, TAGRID_OK) << limited.message;
    EXPECT_EQ(limited.bytes, encode(options, samples.data()).bytes);
    call.memory_limit = smallest - 1;
    const Encoded refused = encode(options, samples.data(), &call);
    EXPECT_EQ(refused.status, TAGRID_MEMORY_LIMIT);
    const std::uint64_t mebibyte = 1 << 20;
    EXPECT_TRUE(has(refused.message,
                    "needs at least " + std::to_string((smallest + mebibyte - 1) / mebibyte) + " MiB"));
    EXPECT_EQ(refused.bytes, "");
  }
}

TEST_F(LibraryEncoder, OptionsThatMakeNoSenseAreRefused) {
  const tagrid_encode_options good = encode_options(dims, SampleType::int16);
  const std::function<void(tagrid_encode_options&)> mistakes[] = {
      [](auto& o) { o.struct_size = 0; },
      [](auto& o) { o.struct_size -= 1; },
      [](auto& o) { o.dims[1] = 0; },
      [](auto& o) { o.dims[2] = -5; },
      [](auto& o) { o.dims[0] = INT64_MAX; },
      [](auto& o) { o.type = static_cast<tagrid_type>(0); },
      [](auto& o) { o.type = static_cast<tagrid_type>(99); },
      [](auto& o) { o.max_error = -1; },
      [](auto& o) { o.surface_error = 3; },
      [](auto& o) { o.cube = 5; },
      [](auto& o) { o.brick = -1; },
      [](auto& o) { o.accuracy = -3; },
      [](auto& o) { o.range[0] = 5; },
      [](auto& o) { o.range[0] = 5, o.range[1] = 4; },
      [](auto& o) { o.field_scale = -1; },
      [](auto& o) { o.max_level = 1000; },
      [](auto& o) { o.max_level = -2; },
      [](auto& o) { o.effort = static_cast<tagrid_effort>(7); },
      [](auto& o) { o.metadata = "dimension: 3\n"; },
      [](auto& o) { o.metadata = "no field"; },
      [](auto& o) { o.type = TAGRID_FLOAT32; }};
  int number = 0;
  for (const auto& mistake : mistakes) {
    tagrid_encode_options options = good;
    mistake(options);
    const Encoded encoded = encode(options, nullptr);
    EXPECT_EQ(encoded.status, TAGRID_INVALID_ARGUMENT) << number << ": " << encoded.message;
    EXPECT_NE(encoded.message, "") << number;
    EXPECT_EQ(encoded.bytes, "") << number;
    ++number;
  }
  tagrid_encode_options float_type = good;
  float_type.struct_size = 0;
  EXPECT_EQ(tagrid_encode_memory(&float_type), 0u);
  EXPECT_EQ(tagrid_encode_memory(nullptr), 0u);

  Encoded encoded;
  tagrid_encoder* opened = nullptr;
  EXPECT_EQ(tagrid_encoder_open(&good, Encoded::write, &encoded, nullptr, nullptr), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(tagrid_encoder_open(nullptr, Encoded::write, &encoded, nullptr, &opened),
            TAGRID_INVALID_ARGUMENT);
  tagrid_encoder_close(opened);
  EXPECT_EQ(tagrid_encoder_open(&good, nullptr, &encoded, nullptr, &opened), TAGRID_INVALID_ARGUMENT);
  EXPECT_STRNE(tagrid_encoder_message(opened), "");
  EXPECT_EQ(tagrid_encoder_write(opened, "", 1, nullptr), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(tagrid_encoder_finish(opened, nullptr), TAGRID_INVALID_ARGUMENT);
  tagrid_encoder_close(opened);
  EXPECT_EQ(tagrid_encoder_write(nullptr, "", 1, nullptr), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(tagrid_encoder_finish(nullptr, nullptr), TAGRID_INVALID_ARGUMENT);
  EXPECT_STRNE(tagrid_encoder_message(nullptr), "");
  tagrid_encoder_close(nullptr);
}

TEST_F(LibraryEncoder, AnyGeometryOfAReaderIsTakenAndComesBack) {
  const auto samples = awkward_volume<std::int16_t>(Awkward::smooth, dims, 11);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const bool has_origin : {false, true})
    for (const bool has_spacing : {false, true})
      for (const double unknown : {2.5, nan}) {
        tagrid_geometry geometry = {};
        geometry.has_spacing = has_spacing;
        geometry.has_origin = has_origin;
        for (int axis = 0; axis < 3; ++axis) {
          geometry.spacing[axis] = !has_spacing ? nan : axis == 1 ? unknown : 0.5;
          geometry.origin[axis] = has_origin ? axis - 0.1 : 0;
        }
        tagrid_encode_options options = encode_options(dims, SampleType::int16);
        options.geometry = &geometry;
        const Encoded encoded = encode(options, samples.data());
        ASSERT_EQ(encoded.status, TAGRID_OK) << encoded.message;
        const tagrid_geometry& found = encoded.info.geometry;
        EXPECT_EQ(found.has_origin, has_origin);
        EXPECT_EQ(found.has_spacing, has_spacing);
        for (int axis = 0; axis < 3; ++axis) {
          EXPECT_EQ(found.origin[axis], geometry.origin[axis]);
          EXPECT_TRUE(found.spacing[axis] == geometry.spacing[axis] ||
                      (std::isnan(found.spacing[axis]) && std::isnan(geometry.spacing[axis])));
        }
      }
}

TEST_F(LibraryEncoder, MetadataThatNoReaderWouldTakeIsRefusedAndAllElseComesBack) {
  const auto samples = awkward_volume<std::int16_t>(Awkward::smooth, dims, 10);
  tagrid_encode_options options = encode_options(dims, SampleType::int16);
  constexpr std::size_t most = std::size_t{1} << 24;
  struct Case {
    bool compresses;
    std::size_t length;
    bool fits;
  };
  for (const Case& c : {Case{true, most, true},
                        {true, most + 1, false},
                        {false, most / 2 + 1, true},
                        {false, most - 10000, true},
                        {false, most, false}}) {
    std::mt19937 random(1);
    std::string metadata = "key:=";
    while (metadata.size() < c.length - 1)
      metadata += c.compresses ? 'x' : static_cast<char>('\r' + 1 + random() % (255 - '\r'));
    metadata += '\n';
    options.metadata = metadata.c_str();
    const Encoded encoded = encode(options, samples.data());
    ASSERT_EQ(encoded.status, c.fits ? TAGRID_OK : TAGRID_INVALID_ARGUMENT) << c.length << encoded.message;
    if (c.fits) {
      MemoryFile file{encoded.bytes};
      tagrid_status opened = TAGRID_BUG;
      const ReaderHandle reader = open_reader(file, &opened);
      ASSERT_EQ(opened, TAGRID_OK) << tagrid_reader_message(reader.get());
      EXPECT_TRUE(tagrid_reader_metadata(reader.get()) == metadata) << c.length;
    } else {
      EXPECT_TRUE(has(encoded.message, std::to_string(c.length) + " bytes"));
      EXPECT_EQ(encoded.bytes, "");
      EXPECT_EQ(tagrid_encode_memory(&options), 0u);
    }
  }
}

TEST_F(LibraryEncoder, WrongNumbersOfSlicesAreRefusedAndRightOnesMayFollow) {
  const auto samples = awkward_volume<std::int16_t>(Awkward::smooth, dims, 7);
  const tagrid_encode_options options = encode_options(dims, SampleType::int16);
  const Encoded whole = encode(options, samples.data());
  Encoded encoded;
  tagrid_encoder* opened = nullptr;
  ASSERT_EQ(tagrid_encoder_open(&options, Encoded::write, &encoded, nullptr, &opened), TAGRID_OK);
  const EncoderHandle encoder(opened);
  EXPECT_EQ(tagrid_encoder_write(opened, samples.data(), -1, nullptr), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(tagrid_encoder_write(opened, samples.data(), dims.z + 1, nullptr), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(tagrid_encoder_write(opened, nullptr, 1, nullptr), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(tagrid_encoder_write(opened, nullptr, 0, nullptr), TAGRID_OK);
  ASSERT_EQ(tagrid_encoder_write(opened, samples.data(), dims.z, nullptr), TAGRID_OK);
  EXPECT_EQ(tagrid_encoder_write(opened, samples.data(), 1, nullptr), TAGRID_INVALID_ARGUMENT);
  tagrid_info small = {};
  EXPECT_EQ(tagrid_encoder_finish(opened, &small), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(tagrid_encoder_finish(opened, nullptr), TAGRID_OK);
  EXPECT_EQ(encoded.bytes, whole.bytes);
}

TEST_F(LibraryEncoder, TwoEncodersAndThreeReadersAtOnceGiveWhatEachGivesAlone) {
  const auto first = awkward_volume<std::int16_t>(Awkward::noise, dims, 8);
  const auto second = awkward_volume<float>(Awkward::smooth, dims, 9);
  const tagrid_encode_options first_options = encode_options(dims, SampleType::int16);
  tagrid_encode_options second_options = encode_options(dims, SampleType::float32);
  second_options.max_error = 0.5;
  const Encoded first_alone = encode(first_options, first.data()),
                second_alone = encode(second_options, second.data());
  ASSERT_EQ(second_alone.status, TAGRID_OK) << second_alone.message;

  const tagrid_box all = whole_box(dims);
  Encoded first_again, second_again;
  MemoryFile file{first_alone.bytes};
  const ReaderHandle shared = open_reader(file);
  std::vector<std::int16_t> read[2] = {std::vector<std::int16_t>(first.size()),
                                       std::vector<std::int16_t>(first.size())};
  tagrid_status status[3] = {TAGRID_BUG, TAGRID_BUG, TAGRID_BUG};
  const tagrid_call call = call_of(3);
  {
    std::vector<std::thread> threads;
    threads.emplace_back([&] { first_again = encode(first_options, first.data(), &call); });
    threads.emplace_back([&] { second_again = encode(second_options, second.data(), &call, 1); });
    for (int i = 0; i < 2; ++i)
      threads.emplace_back([&, i] {
        MemoryFile own{first_alone.bytes};
        const ReaderHandle reader = open_reader(own);
        status[i] = tagrid_reader_read(i == 0 ? shared.get() : reader.get(), &all, nullptr, TAGRID_INT16,
                                       read[i].data(), nullptr, &call);
      });
    threads.emplace_back([&] { status[2] = tagrid_reader_verify(shared.get(), &call); });
    for (std::thread& thread : threads) thread.join();
  }
  for (const tagrid_status s : status) EXPECT_EQ(s, TAGRID_OK);
  EXPECT_EQ(first_again.bytes, first_alone.bytes);
  EXPECT_EQ(second_again.bytes, second_alone.bytes);
  EXPECT_EQ(read[0], first);
  EXPECT_EQ(read[1], first);
}

}  // namespace
}  // namespace tagrid
