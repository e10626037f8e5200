#include "io/samples/file_samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <filesystem>
#include <string>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/files/spool_file.h"
#include "io/system/files.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

SourceFacts with_traits(SourceFacts facts, const FileBytes& file, bool any_rows, std::uint64_t memory) {
  const bool is_file = file.size().has_value();
  facts.traits = {.again = is_file, .any_rows = is_file && any_rows, .whole_slices = false, .memory = memory};
  return facts;
}

PlainForm plain_form_of_stream(const SourceFacts& facts, const SamplesPlace& place, std::uint64_t skipped,
                               const PlainHeader& header, Compression compression) {
  const Index3& dims = facts.info.dims;
  const std::size_t number = facts.files.size() - 1;
  PlainForm form;
  FileBytes file(facts.files.back());
  file.seek(place.start);
  form.compression = compression == Compression::bzip2 ? "bzip2" : begins_gzip(file) ? "gzip" : "zlib";
  PlainFile samples{facts.files.back(), true, {PlainPiece::stretch(number, 0, place.start)}};
  if (header && number == 0) samples = header();
  if (header && number > 0) form.files.push_back(header());
  samples.path = plain_name(samples.path);
  std::uint64_t begin = skipped;
  for (const PlainPiece& piece : samples.pieces) begin += piece.size.value_or(piece.bytes.size());
  std::optional<std::uint64_t> size;
  if (!place.may_go_on) size = skipped + *sample_bytes(dims, facts.info.type);
  samples.pieces.push_back(PlainPiece::content(number, place.start, size));
  form.files.push_back(std::move(samples));
  form.places = {{.file = form.files.size() - 1,
                  .offset = begin,
                  .slices = dims.z,
                  .step = *sample_bytes({dims.x, dims.y, 1}, facts.info.type),
                  .big_endian = place.big_endian}};
  return form;
}

/// Warns that `more` bytes, or at least as many, follow the samples in `file`. If they are enough for a
/// slice, the header may have the wrong size or type.
void say_more(const FileBytes& file, std::uint64_t more, bool is_exact, SourceFacts& facts) {
  facts.holds_other_bytes = true;
  const std::uint64_t slice = *sample_bytes({facts.info.dims.x, facts.info.dims.y, 1}, facts.info.type);
  (more < slice ? facts.warnings : facts.not_understood)
      .push_back(fmt::format("{}: {}{} bytes follow the samples; they are not part of the volume",
                             file.name(), is_exact ? "" : "more than ", more));
}

/// A gzip stream may hold more than `expected` bytes, with a warning. It is read to its end only if its last
/// bytes, the size of its last member modulo 2^32, differ from that.
void allow_more_in_gzip(FileBytes& file, std::uint64_t expected, SamplesPlace& place, SourceFacts& facts) {
  constexpr std::uint64_t most = std::uint64_t{1} << 30;  // more are not counted
  constexpr std::uint64_t least_gzip = 18;
  if (!file.size() || *file.size() < place.start || *file.size() - place.start < least_gzip) return;
  file.seek(place.start);
  if (!begins_gzip(file)) return;
  std::byte last[4];
  file.seek(*file.size() - sizeof last);
  if (file.read(last, sizeof last) != sizeof last ||
      load_little_endian<std::uint32_t>(last) == static_cast<std::uint32_t>(expected))
    return;
  file.seek(place.start);
  CompressedBytes stream(file, Compression::gzip);
  std::vector<std::byte> bytes(std::size_t{1} << 16);
  std::uint64_t count = 0;
  for (std::size_t read = bytes.size(); read == bytes.size() && count <= expected + most; count += read)
    read = stream.read(bytes.data(), bytes.size());
  if (count <= expected) return;
  place.may_go_on = true;
  say_more(file, std::min(count - expected, most), count - expected < most, facts);
}

/// The common part of plain and compressed samples.
class FileSamples : public VolumeSource {
 public:
  std::uint64_t bytes_read() const override { return place_.header_bytes + file_->position(); }
  void stop_when(const std::atomic<bool>& stop) override { file_->stop_when(stop); }
  bool at_once() const override { return traits().any_rows; }
  void read_at(std::byte* out, std::int64_t first, std::int64_t count) const override {
    const std::uint64_t position = static_cast<std::uint64_t>(first) * size_of(info().type);
    take(out, first, count,
         [&](std::size_t size) { return file_->read_at(place_.start + position, out, size); });
  }

 protected:
  /// `any_rows`: true if any rows of a file can be read; it has no effect on a pipe.
  /// `memory`: bytes that reading takes besides.
  FileSamples(SourceFacts facts, std::unique_ptr<FileBytes> file, const SamplesPlace& place, bool any_rows,
              std::uint64_t memory = 0)
      : VolumeSource(with_traits(std::move(facts), *file, any_rows, memory)),
        place_(place),
        file_(std::move(file)) {}

  /// Reads the next bytes of samples; fewer than `size` only at the end.
  virtual std::size_t read_bytes(std::byte* out, std::size_t size) = 0;

  /// For messages: the expected number of bytes, and the reason for it.
  std::string expected() const {
    const std::string skipped = place_.start > 0 ? fmt::format(" from byte {} on", place_.start) : "";
    return fmt::format("{} bytes of samples are expected{} ({})", expected_bytes(), skipped,
                       described(info().dims, info().type));
  }
  std::uint64_t expected_bytes() const { return *sample_bytes(info().dims, info().type); }
  /// The number of bytes of the file after `start`. REQUIRES: the file has a size.
  std::uint64_t present_bytes() const {
    return *file_->size() > place_.start ? *file_->size() - place_.start : 0;
  }

  const SamplesPlace place_;
  const std::unique_ptr<FileBytes> file_;

 private:
  void read(std::byte* out, std::int64_t first, std::int64_t count) final {
    const std::uint64_t position = static_cast<std::uint64_t>(first) * size_of(info().type);
    if (traits().any_rows && file_->position() != place_.start + position)
      file_->seek(place_.start + position);
    take(out, first, count, [&](std::size_t size) { return read_bytes(out, size); });
  }

  /// Samples in the machine's byte order. `read` takes the number of bytes to read, and returns how many there were.
  template <class Read>
  void take(std::byte* out, std::int64_t first, std::int64_t count, Read read) const {
    const std::size_t sample = size_of(info().type), size = static_cast<std::size_t>(count) * sample;
    const std::size_t present = read(size);
    if (present != size)
      throw BrokenInput("{}: {}, but it ends after {}", file_->name(), expected(),
                        static_cast<std::uint64_t>(first) * sample + present);
    swap_if_not_native(out, static_cast<std::size_t>(count), sample, place_.big_endian);
  }

  void end() final {
    if (place_.may_go_on) return;
    std::byte next;
    if (read_bytes(&next, 1) != 0)
      throw BrokenInput("{}: {}, but more are present", file_->name(), expected());
  }
};

class PlainSamples : public FileSamples {
 public:
  PlainSamples(SourceFacts facts, std::unique_ptr<FileBytes> file, const SamplesPlace& place)
      : FileSamples(std::move(facts), std::move(file), place, true) {
    if (!file_->size()) {
      // The length of a pipe is known only after reading it.
      file_->skip(place_.start - file_->position());
      if (file_->position() != place_.start)
        throw BrokenInput("{}: ends before byte {}, where the samples should begin", file_->name(),
                          place_.start);
      return;
    }
    if (place_.start <= *file_->size()) file_->seek(place_.start);
    if (present_bytes() == expected_bytes() || (place_.may_go_on && present_bytes() > expected_bytes()))
      return;
    // The description is wrong, or this is not the intended file.
    if (*file_->size() == 0) throw BrokenInput("{}: is empty; {}", file_->name(), expected());
    throw WrongSize(fmt::format("{}: {}, but {} are present", file_->name(), expected(), present_bytes()),
                    place_.start == 0 ? file_->peek(FileBytes::peek_limit) : std::string_view());
  }

 private:
  std::size_t read_bytes(std::byte* out, std::size_t size) override { return file_->read(out, size); }
  void seek(std::int64_t z) override {
    file_->seek(place_.start + static_cast<std::uint64_t>(z) * slice_bytes());
  }
};

class CompressedSamples final : public FileSamples {
 public:
  CompressedSamples(SourceFacts facts, std::unique_ptr<FileBytes> file, const SamplesPlace& place,
                    std::uint64_t skipped, Compression compression)
      : FileSamples(std::move(facts), std::move(file), place, false,
                    // The plain form is read from a stream of its own.
                    compression == Compression::bzip2 ? 2 * CompressedBytes::memory_of_bzip2 : 0),
        stream_(*file_, compression),
        skipped_(skipped) {
    CompressedSamples::seek(0);
    if (file_->size() && (expected_bytes() + skipped_) / stream_.max_ratio() > present_bytes())
      throw BrokenInput("{}: {}, which {} bytes of {} cannot hold", file_->name(), expected(),
                        present_bytes(), stream_.method());
  }

 private:
  std::size_t read_bytes(std::byte* out, std::size_t size) override { return stream_.read(out, size); }
  void seek(std::int64_t z) override {
    if (traits().again) file_->seek(place_.start);
    stream_.restart();
    std::byte bytes[4096];
    for (std::uint64_t left = skipped_ + static_cast<std::uint64_t>(z) * slice_bytes(); left > 0;) {
      const std::size_t count = std::min<std::uint64_t>(left, sizeof bytes);
      if (stream_.read(bytes, count) != count)
        throw BrokenInput("{}: {}, but it ends earlier", file_->name(), expected());
      left -= count;
    }
  }

  CompressedBytes stream_;
  std::uint64_t skipped_;
};

class SpooledSamples final : public PlainSamples {
 public:
  SpooledSamples(const SourceFacts& facts, std::unique_ptr<FileBytes> file, std::uint64_t bytes_read)
      : PlainSamples(facts, std::move(file), {0, std::endian::native == std::endian::big, 0}),
        bytes_read_(bytes_read) {}

  std::uint64_t bytes_read() const override { return bytes_read_; }

 private:
  std::uint64_t bytes_read_;  ///< of the original source
};

}  // namespace

void allow_more(const FileBytes& file, SamplesPlace& place, SourceFacts& facts) {
  const std::uint64_t end = place.start + *sample_bytes(facts.info.dims, facts.info.type);
  if (!file.size() || *file.size() <= end) return;
  place.may_go_on = true;
  say_more(file, *file.size() - end, true, facts);
}

std::unique_ptr<VolumeSource> plain_samples(SourceFacts facts, std::unique_ptr<FileBytes> file,
                                            const SamplesPlace& place) {
  if (file->size() && facts.files.back() != "-") {
    const Index3& dims = facts.info.dims;
    facts.places = {{.file = facts.files.size() - 1,
                     .offset = place.start,
                     .slices = dims.z,
                     .step = *sample_bytes({dims.x, dims.y, 1}, facts.info.type),
                     .big_endian = place.big_endian}};
  }
  return std::make_unique<PlainSamples>(std::move(facts), std::move(file), place);
}

std::unique_ptr<VolumeSource> compressed_samples(SourceFacts facts, std::unique_ptr<FileBytes> file,
                                                 SamplesPlace place, std::uint64_t skipped,
                                                 const PlainHeader& header, Compression compression) {
  if (compression == Compression::gzip && !place.may_go_on)
    allow_more_in_gzip(*file, skipped + *sample_bytes(facts.info.dims, facts.info.type), place, facts);
  if (file->size() && facts.files.back() != "-")
    facts.plain_form = [known = facts, place, skipped, header, compression] {
      return plain_form_of_stream(known, place, skipped, header, compression);
    };
  return std::make_unique<CompressedSamples>(std::move(facts), std::move(file), place, skipped, compression);
}

std::unique_ptr<VolumeSource> spooled(std::unique_ptr<VolumeSource> source, const std::string& folder) {
  assert(source->next_sample() == 0);
  SpoolFile file = SpoolFile::in(folder, source->name());
  read_to_end(*source, [&](std::span<const std::byte> samples) { file.write(samples); });
  return std::make_unique<SpooledSamples>(
      source->facts(), std::make_unique<FileBytes>(file.release(), source->name()), source->bytes_read());
}

}  // namespace tagrid
