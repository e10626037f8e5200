#include "io/programs/program_sink.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <utility>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/files/errors.h"
#include "io/files/output_file.h"
#include "io/files/spool_file.h"
#include "io/files/system_call.h"

namespace tagrid {
namespace {

/// A file without a name that another process can open by a path.
class NamelessFile {
 public:
  explicit NamelessFile(const std::string& path) : descriptor_(SpoolFile::beside(path).release()) {}
  ~NamelessFile() { close(descriptor_); }
  NamelessFile(const NamelessFile&) = delete;
  NamelessFile& operator=(const NamelessFile&) = delete;

  std::string path() const { return fmt::format("/proc/{}/fd/{}", getpid(), descriptor_); }
  void copy_to(OutputFile& file) const {
    std::vector<std::byte> bytes(std::size_t{1} << 20);
    for (off_t position = 0;;) {
      const ssize_t count =
          uninterrupted([&] { return pread(descriptor_, bytes.data(), bytes.size(), position); });
      if (count < 0) throw world_error("cannot read a temporary file for it", file.name(), errno);
      if (count == 0) return;
      file.write(std::span(bytes).first(static_cast<std::size_t>(count)));
      position += count;
    }
  }

 private:
  int descriptor_;
};

class ProgramSink final : public VolumeSink {
 public:
  ProgramSink(const std::string& program, const std::string& path, const VolumeInfo& info,
              const SinkOptions& options, const WriterOptions& wishes, std::uint64_t first_memory)
      : VolumeSink(info),
        file_(path, options.overwrite, {.like = options.like}),
        conversation_(program, {.memory = first_memory}) {
    if (!file_.can_seek()) {
      nameless_ = std::make_unique<NamelessFile>(path);
    } else if (const auto status = status_of(file_.temporary())) {
      device_ = status->st_dev;
      number_ = status->st_ino;
    }
    const std::string written =
        nameless_ ? nameless_->path() : std::filesystem::absolute(file_.temporary()).string();
    ready_ = conversation_.begin(written, file_.name(), info, wishes);
  }

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
    if (nameless_) {
      nameless_->copy_to(file_);
      bytes_ = file_.position();
      return;
    }
    const auto status = status_of(file_.temporary());
    if (!status || status->st_dev != device_ || status->st_ino != number_)
      throw WorldError(file_.name() +
                       ": its writer did not fill the file that it was given, but removed or replaced it");
    bytes_ = static_cast<std::uint64_t>(status->st_size);
  }

  OutputFile file_;
  dev_t device_ = 0;
  ino_t number_ = 0;  ///< of the file that the writer fills
  std::unique_ptr<NamelessFile> nameless_;
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
