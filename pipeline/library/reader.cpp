// The reader of the library.
#include <algorithm>
#include <memory>

#include "io/errors/errors.h"
#include "io/metadata/text.h"
#include "pipeline/library/calls.h"
#include "pipeline/verify/verify.h"
#include "stages/grid/lattice.h"

using namespace tagrid;
using namespace tagrid::library;

namespace {

// The source that the caller provides.
class CallbackSource : public ByteSource {
 public:
  explicit CallbackSource(const tagrid_input& input)
      : input_(input), name_(input.name != nullptr ? input.name : "input") {
    require(input_.size != nullptr && input_.read_at != nullptr, "an input needs size and read_at");
    if (input_.size(input_.user, &size_) != 0) throw WorldError(name_ + ": its size cannot be determined");
  }
  std::uint64_t size() const override { return size_; }
  void read_at(std::uint64_t position, std::span<std::byte> to) const override {
    if (to.empty()) return;
    if (const int error = input_.read_at(input_.user, position, to.data(), to.size()); error != 0)
      throw WorldError(name_ + ": cannot read " + std::to_string(to.size()) + " bytes from byte " +
                       std::to_string(position) + " on: error " + std::to_string(error));
  }
  const std::string& name() const override { return name_; }

 private:
  tagrid_input input_;
  std::string name_;
  std::uint64_t size_ = 0;
};

template <class MakeSource>
tagrid_status open_reader(tagrid_reader** reader, MakeSource make_source) noexcept {
  if (reader == nullptr) return TAGRID_INVALID_ARGUMENT;
  *reader = new (std::nothrow) tagrid_reader;
  if (*reader == nullptr) return TAGRID_OUT_OF_MEMORY;
  return call((*reader)->of_opening, [&] {
    (*reader)->source = make_source();
    (*reader)->file = std::make_unique<TagBricks>((*reader)->source);
  });
}

}  // namespace

tagrid_status tagrid_reader_open_file(const char* path, tagrid_reader** reader) {
  return open_reader(reader, [&] {
    require(path != nullptr, "there is no path");
    return std::make_shared<const FileSource>(path);
  });
}

tagrid_status tagrid_reader_open(const tagrid_input* input, tagrid_reader** reader) {
  return open_reader(reader, [&] {
    require(input != nullptr, "there is no input");
    return std::make_shared<const CallbackSource>(taken_over(input, tagrid_input_init, sizeof *input));
  });
}

void tagrid_reader_close(tagrid_reader* reader) { delete reader; }

const char* tagrid_reader_message(const tagrid_reader* reader) {
  if (reader == nullptr) return "there is no reader";
  const char* own = reader->messages.get();
  return *own != '\0' ? own : reader->of_opening.get();
}

tagrid_status tagrid_reader_info(const tagrid_reader* reader, tagrid_info* info) {
  return with_file(reader, [&](const TagBricks& file) {
    hand_over(info_of(file.header(), file.index(), file.sizes()), info, sizeof *info);
  });
}

const char* tagrid_reader_metadata(const tagrid_reader* reader) {
  return reader == nullptr || !reader->file ? "" : text_of(reader->file->header().metadata).c_str();
}

tagrid_status tagrid_reader_brick(const tagrid_reader* reader, int64_t number, tagrid_brick* brick) {
  return with_file(reader, [&](const TagBricks& file) {
    require(number >= 0 && number < file.count(), "there is no brick with this number");
    const BrickGrid bricks = file.parameters().bricks();
    const Box owned = bricks.domain.samples_at(bricks.owned_box(bricks.position(number)));
    const IndexEntry entry = file.entry(number);
    tagrid_brick result = {};
    result.box = half_open(owned);
    result.offset = file.start(number);
    result.bytes = file.block_bytes(number);
    result.low = entry.low;
    result.high = entry.high;
    result.mean = entry.mean;
    hand_over(result, brick, sizeof *brick);
  });
}

tagrid_status tagrid_reader_read(const tagrid_reader* reader, const tagrid_box* box, const int64_t* step,
                                 tagrid_type type, void* samples, const int64_t* strides,
                                 const tagrid_call* given) {
  return with_file(reader, [&](const TagBricks& file) {
    require(box != nullptr && samples != nullptr, "the box or the buffer for its samples is missing");
    const CodingParameters& parameters = file.parameters();
    if (type != static_cast<tagrid_type>(parameters.type))
      throw UsageError("the buffer must be of the type of the file, {}", name_of(parameters.type));
    Region region{parameters.domain().points_of(box_of(*box, parameters.dims))};
    for (int axis = 0; step != nullptr && axis < 3; ++axis) {
      require(step[axis] >= 1, "a step must be 1 or more");
      // A larger step selects the same sample, the first one, but could overflow in between.
      region.step[axis] = std::min(step[axis], region.box.size()[axis]);
    }
    const tagrid_call settings = settings_of(given);
    const int threads = threads_for_reading(parameters, resources_of(settings));
    read_region(
        file, region,
        {static_cast<std::byte*>(samples), strides_of(strides, region.shape(), size_of(parameters.type))},
        threads, progress_of(settings));
  });
}

tagrid_status tagrid_reader_overviews(const tagrid_reader* reader, int64_t* factors) {
  return with_file(reader, [&](const TagBricks& file) { list_overviews(file.index(), factors); });
}

tagrid_status tagrid_reader_overview(const tagrid_reader* reader, int64_t factor, tagrid_reader** overview) {
  return open_reader(overview, [&] {
    require(reader != nullptr && reader->file != nullptr, "the reader is not open");
    return overview_in(*reader->file, factor);
  });
}

tagrid_status tagrid_reader_volumes(const tagrid_reader* reader, int64_t* count) {
  return with_file(reader, [&](const TagBricks& file) {
    require(count != nullptr, "there is no room for the number");
    *count = file.header().volumes;
  });
}

tagrid_status tagrid_reader_volume(const tagrid_reader* reader, int64_t number, tagrid_reader** volume) {
  return open_reader(volume, [&] {
    require(reader != nullptr && reader->file != nullptr, "the reader is not open");
    return volume_in(reader->source, number);
  });
}

tagrid_status tagrid_reader_verify(const tagrid_reader* reader, const tagrid_call* given) {
  return with_file(reader, [&](const TagBricks& file) {
    const tagrid_call settings = settings_of(given);
    verify_bytes(std::make_unique<SourceStream>(reader->source), resources_of(settings),
                 progress_of(settings));
    verify_members(file, nullptr, resources_of(settings));
  });
}

tagrid_status tagrid_reader_levels(const tagrid_reader* reader, uint64_t* active, const tagrid_call* given) {
  return with_file(reader, [&](const TagBricks& file) {
    require(active != nullptr, "there is no room for the numbers");
    const tagrid_call settings = settings_of(given);
    const CodingParameters& parameters = file.parameters();
    const auto levels = static_cast<std::size_t>(max_level(parameters.cube_size)) + 1;
    Statistics counted = file.index().total;
    if (!parameters.counts_points()) {
      TagReader stream(std::make_unique<SourceStream>(reader->source));
      counted = count_active_points(stream, resources_of(settings), progress_of(settings));
    }
    std::copy_n(counted.active.begin(), levels, active);
  });
}
