#include "io/programs/volumes.h"

#include <algorithm>
#include <cassert>
#include <stdexcept>
#include <utility>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/output_file.h"
#include "io/programs/filled_file.h"
#include "io/samples/slices_in_files.h"

namespace tagrid {
namespace {

class ProgramSource;
/// The source, as long as it lives, for facts that outlive it.
using Link = std::shared_ptr<ProgramSource*>;

/// Slices of a volume that a program gives.
class ProgramSource final : public VolumeSource {
 public:
  /// What a volume is described from.
  struct Request {
    std::string program, path;
    ReaderOptions options;
    std::uint64_t first_memory = most_first_memory;

    std::unique_ptr<ReaderConversation> conversation() const {
      return std::make_unique<ReaderConversation>(program, FormatProgram::Limits{.memory = first_memory});
    }
  };

  ProgramSource(SourceFacts facts, Request request, std::unique_ptr<ReaderConversation> conversation,
                bool any_order, const Link& link)
      : VolumeSource(std::move(facts)),
        request_(std::move(request)),
        any_order_(any_order),
        size_(size_of_files(files())),
        conversation_(std::move(conversation)),
        link_(link) {
    *link = this;
  }
  ~ProgramSource() override { *link_ = nullptr; }

  /// The plain form of the volume that `conversation` has described, or described again.
  static PlainForm plain_form(const Link& link, const Request& request) {
    // The program that gives slices can tell, too, unless it has ended. Another one takes as much memory.
    if (*link != nullptr && (*link)->any_order_ && (*link)->conversation_) return (*link)->plain_form();
    const auto again = request.conversation();
    const ReaderVolume volume = again->describe(request.path, request.options);
    PlainForm form = again->plain_form(volume);
    again->finish();
    return form;
  }

  std::uint64_t bytes_read() const override { return size_; }
  void stop_when(const std::atomic<bool>& stop) override {
    stop_ = &stop;
    if (conversation_) conversation_->stop_when(stop);
  }

 private:
  /// Slices that the program was asked for, but for those of which it has said that they come.
  struct Asked {
    std::int64_t from = 0, to = 0;
    std::uint64_t coming = 0;  ///< bytes that it has said to come, and that were not read

    bool is_done() const { return from == to && coming == 0; }
  };

  void read(std::byte* out, std::int64_t first, std::int64_t count) override {
    if (!conversation_) restart();
    const std::int64_t from = first / slice_samples(), to = from + count / slice_samples();
    if (!asked_.is_done() && (asked_.from != from || asked_.to != to)) drop_asked();
    if (asked_.is_done()) ask(from, to);
    take(out, static_cast<std::uint64_t>(count) * size_of(info().type));
    // While these slices are encoded, the program prepares the next ones.
    if (to < info().dims.z) ask(to, std::min(to + (to - from), info().dims.z));
    swap_if_not_native(out, static_cast<std::size_t>(count), size_of(info().type), false);
  }

  void ask(std::int64_t from, std::int64_t to) {
    if (!any_order_ && from != asked_.to) skip_to(from);
    conversation_->ask_for_slices(from, to);
    asked_ = {from, to, 0};
  }

  void take(std::byte* out, std::uint64_t size) {
    while (size > 0) {
      if (asked_.coming == 0) {
        const std::int64_t end = conversation_->hear_of_slices(asked_.from, asked_.to);
        asked_.coming = static_cast<std::uint64_t>(end - asked_.from) * slice_bytes();
        asked_.from = end;
      }
      const std::uint64_t part = std::min(size, asked_.coming);
      conversation_->read(out, part);
      asked_.coming -= part;
      out += part;
      size -= part;
    }
  }

  PlainForm plain_form() {
    drop_asked();
    asked_ = {};
    ReaderVolume volume;
    volume.info = info();
    volume.files = files();
    return conversation_->plain_form(volume);
  }

  void drop_asked() {
    std::vector<std::byte> bytes(std::min<std::uint64_t>(slice_bytes(), 1 << 16));
    while (!asked_.is_done()) take(bytes.data(), std::min<std::uint64_t>(bytes.size(), left_of_asked()));
  }
  std::uint64_t left_of_asked() const {
    return asked_.coming + static_cast<std::uint64_t>(asked_.to - asked_.from) * slice_bytes();
  }

  /// Of a program that gives slices only from front to back.
  void skip_to(std::int64_t z) {
    if (z < asked_.to) restart();
    while (asked_.to < z) {
      conversation_->ask_for_slices(asked_.to, asked_.to + 1);
      asked_ = {asked_.to, asked_.to + 1, 0};
      drop_asked();
    }
  }

  void restart() {
    conversation_.reset();  // one program at a time
    conversation_ = request_.conversation();
    if (stop_ != nullptr) conversation_->stop_when(*stop_);
    const ReaderVolume again = conversation_->describe(request_.path, request_.options);
    if (again.info.dims != info().dims || again.info.type != info().type)
      throw BrokenInput(request_.path + ": changed while it was being read");
    asked_ = {};
  }

  void seek(std::int64_t) override {}  // read() finds any slice

  // Unexpected output is noticed when the program ends. If slices are needed again, it is started again.
  void end() override {
    if (!conversation_) return;
    drop_asked();
    conversation_->finish();
    conversation_.reset();
  }

  Request request_;
  bool any_order_;
  std::uint64_t size_;
  std::unique_ptr<ReaderConversation> conversation_;  ///< none after end()
  Asked asked_;
  Link link_;
  const std::atomic<bool>* stop_ = nullptr;
};

}  // namespace

namespace {

/// A reader that knows the headers of several volumes at a path, and has told of one.
struct KnowingReader {
  std::string program, path;
  std::vector<std::string> environment;
  std::unique_ptr<ReaderConversation> conversation;
};

/// The last one. A program ends with the thread that started it.
thread_local KnowingReader knowing_reader;

void keep(const ProgramSource::Request& request, std::unique_ptr<ReaderConversation> conversation) {
  // What it keeps in memory would count toward a limit.
  if (request.first_memory == most_first_memory)
    knowing_reader = {request.program, request.path, environment_of_programs(), std::move(conversation)};
}

std::unique_ptr<ReaderConversation> described_by_knowing_reader(const ProgramSource::Request& request,
                                                                ReaderVolume& volume) {
  KnowingReader reader = std::exchange(knowing_reader, {});
  if (reader.program != request.program || reader.path != request.path ||
      request.first_memory != most_first_memory || reader.environment != environment_of_programs())
    return nullptr;
  try {
    volume = reader.conversation->describe(request.path, request.options);
  } catch (const Error&) {
    return nullptr;  // a new one says what is wrong
  }
  return std::move(reader.conversation);
}

std::unique_ptr<ReaderConversation> described(const ProgramSource::Request& request, ReaderVolume& volume) {
  if (auto knowing = described_by_knowing_reader(request, volume)) return knowing;
  auto conversation = request.conversation();
  try {
    volume = conversation->describe(request.path, request.options);
  } catch (const UsageError& error) {
    if (!error.detail().choices.empty()) keep(request, std::move(conversation));
    throw;
  }
  return conversation;
}

}  // namespace

std::unique_ptr<VolumeSource> open_with_reader(const std::string& program, const std::string& path,
                                               const ReaderOptions& options, std::uint64_t first_memory) {
  const ProgramSource::Request request{program, path, options, first_memory};
  ReaderVolume volume;
  auto conversation = described(request, volume);
  SourceFacts facts = std::move(static_cast<SourceFacts&>(volume));
  facts.holds_other_bytes = true;  // only the reader knows what else there is
  if (!facts.places.empty()) {
    if (volume.has_others)
      keep(request, std::move(conversation));
    else
      conversation->finish();
    std::vector<SliceRun> places = std::exchange(facts.places, {});
    return placed_samples(std::move(facts), std::move(places));
  }
  facts.traits = {.again = true, .any_rows = false, .whole_slices = true, .memory = volume.memory};
  const auto link = std::make_shared<ProgramSource*>(nullptr);
  if (volume.has_plain_form) facts.plain_form = [=] { return ProgramSource::plain_form(link, request); };
  return std::make_unique<ProgramSource>(std::move(facts), request, std::move(conversation), volume.any_order,
                                         link);
}

namespace {

class ProgramSink final : public VolumeSink {
 public:
  ProgramSink(const std::string& program, const std::string& path, const VolumeInfo& info,
              const SinkOptions& options, const WriterOptions& wishes, std::uint64_t first_memory)
      : VolumeSink(info),
        file_(path, options.overwrite, {.like = options.like}),
        filled_(file_, path, options.spool),
        conversation_(program, {.memory = first_memory}),
        ready_(conversation_.begin(filled_.path(), filled_.name(), info, wishes)) {}

  bool any_order() const override { return false; }
  Place place() const override { throw std::logic_error("a program writes the samples"); }
  std::uint64_t memory() const override { return ready_.memory; }
  std::vector<std::string> warnings() const override { return ready_.warnings; }
  std::string facts() const override { return facts_; }
  void publish() override {
    assert(bytes_left() == 0);
    file_.publish();
  }
  void keep() override { file_.keep(); }
  std::uint64_t bytes_written() const override { return bytes_; }

 private:
  void write(std::int64_t first, std::span<const std::byte> samples) override {
    const std::size_t size = size_of(info().type);
    const std::uint64_t slice = *sample_bytes({info().dims.x, info().dims.y, 1}, info().type);
    std::vector<std::byte> swapped;
    samples = little_endian_samples(samples, size, swapped);
    for (std::uint64_t place = static_cast<std::uint64_t>(first) * size; !samples.empty();) {
      const std::uint64_t within = place % slice;
      if (within == 0) {
        const auto z = static_cast<std::int64_t>(place / slice);
        conversation_.announce_slices(z, z + 1);
      }
      const auto part = samples.first(std::min<std::uint64_t>(samples.size(), slice - within));
      conversation_.write(part.data(), part.size());
      samples = samples.subspan(part.size());
      place += part.size();
    }
    if (bytes_left() == 0) complete();
  }

  void complete() {
    facts_ = conversation_.finish();
    bytes_ = filled_.complete();
  }

  OutputFile file_;
  FilledFile filled_;
  WriterConversation conversation_;
  WriterReady ready_;
  std::string facts_;
  std::uint64_t bytes_ = 0;
};

}  // namespace

std::unique_ptr<VolumeSink> create_with_writer(const std::string& program, const std::string& path,
                                               const VolumeInfo& info, const SinkOptions& options,
                                               const WriterOptions& wishes, std::uint64_t first_memory) {
  return std::make_unique<ProgramSink>(program, path, info, options, wishes, first_memory);
}

}  // namespace tagrid
