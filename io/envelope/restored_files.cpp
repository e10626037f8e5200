#include "io/envelope/restored_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <utility>

#include "io/bytes/checksum.h"
#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/files/output_file.h"
#include "io/system/files.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr std::size_t most_open_files = 64;

constexpr std::uint64_t copied_at_once = 1 << 16;

/// Copies a stretch of a file. Zeros, as there are in place of samples, need not be written.
void copy(const FileSource& from, const PlainPiece& piece, PlacedFile& to, std::uint64_t position) {
  std::vector<std::byte> bytes;
  for (std::uint64_t done = 0; done < *piece.size; done += bytes.size()) {
    bytes.resize(std::min(copied_at_once, *piece.size - done));
    from.read_at(piece.offset + done, bytes);
    if (std::ranges::any_of(bytes, [](std::byte byte) { return byte != std::byte{0}; }))
      to.write_at(position + done, bytes);
  }
}

void sync(const std::string& folder) {
  if (const int error = sync_folder(folder); error != 0) throw world_error("cannot sync", folder, error);
}

}  // namespace

RestoredFiles::RestoredFiles(const VolumeInfo& info, std::string input, std::string folder,
                             const SinkOptions& options)
    : VolumeSink(info),
      input_(std::move(input)),
      folder_(std::move(folder)),
      options_(options),
      staging_(std::in_place, folder_, "restored") {}

RestoredFiles::~RestoredFiles() {
  if (!kept_) take_back();
}

std::string RestoredFiles::staged(std::size_t file) const {
  return fmt::format("{}/{}", staging_->path(), file);
}
std::string RestoredFiles::older(std::size_t file) const {
  return fmt::format("{}/{}.old", staging_->path(), file);
}

bool RestoredFiles::make_next(EnvelopeReader& envelope) {
  EnvelopeFile file;
  if (!envelope.next_file(file)) {
    find_slices();
    return false;
  }
  const std::size_t number = files_.size();
  files_.push_back(file);
  check_target(number);
  PlacedFile out(staged(number), path(number), true);
  envelope.read_other_bytes(
      file, [&](std::uint64_t position, std::span<const std::byte> bytes) { out.write_at(position, bytes); });
  out.resize(file.size);  // samples come later
  return true;
}

void RestoredFiles::find_slices() {
  for (std::size_t number = 0; number < files_.size(); ++number)
    for (const SlicesInFile& slices : files_[number].slices) slices_.push_back({number, slices});
  std::ranges::sort(slices_, {}, [](const SlicesOfFile& s) { return s.slices.first_slice; });
}

void RestoredFiles::rewrite_last(const std::vector<PlainPiece>& pieces) {
  const std::size_t number = files_.size() - 1;
  EnvelopeFile& file = files_.back();
  const std::string older = staged(number), newer = older + ".new";
  const PlainPiece* with_samples = nullptr;
  std::uint64_t size = 0, samples_at = 0;
  {
    const FileSource source(older);
    PlacedFile out(newer, path(number), true);
    const std::uint64_t begin = file.slices.empty() ? 0 : file.slices.front().run.offset;
    for (const PlainPiece& piece : pieces) {
      if (piece.kind == PlainPiece::Kind::given) {
        out.write_at(size, std::as_bytes(std::span(piece.bytes)));
        size += piece.bytes.size();
        continue;
      }
      if (piece.offset <= begin && begin - piece.offset < *piece.size) {
        with_samples = &piece;
        samples_at = size;
      }
      copy(source, piece, out, size);
      size += *piece.size;
    }
    out.resize(size);
  }
  const SampleShape shape{info().dims, info().type};
  for_each_stretch(file, shape, [&](std::uint64_t begin, std::uint64_t end, const SlicesInFile* slices) {
    if (slices == nullptr) return;
    if (with_samples == nullptr || begin < with_samples->offset ||
        end > with_samples->offset + *with_samples->size)
      throw BrokenInput(path(number) + ": has samples among its attributes");
  });
  for (SlicesInFile& slices : file.slices)
    slices.run.offset = slices.run.offset - with_samples->offset + samples_at;
  if (!tagrid::files().rename(newer, older)) throw world_error("cannot write", path(number), errno);
  file.size = size;
  file.is_changed = true;
  file.checksum.reset();
}

PlacedFile& RestoredFiles::open(std::size_t file) {
  if (const auto found = open_.find(file); found != open_.end()) return *found->second;
  if (open_.size() == most_open_files) open_.clear();
  return *(open_[file] = std::make_unique<PlacedFile>(staged(file), path(file)));
}

void RestoredFiles::write(std::int64_t first, std::span<const std::byte> samples) {
  const std::int64_t in_slice = info().dims.x * info().dims.y;
  const std::size_t size = size_of(info().type);
  const SliceRows rows = SampleShape{info().dims, info().type}.rows();
  while (!samples.empty()) {
    const std::int64_t z = first / in_slice, at = first % in_slice;
    const auto next =
        std::ranges::upper_bound(slices_, z, {}, [](const SlicesOfFile& s) { return s.slices.first_slice; });
    assert(next != slices_.begin());
    const auto& [file, slices] = *(next - 1);
    // To the end of the slice, or of the row.
    const std::int64_t y = at / info().dims.x, x = at % info().dims.x;
    const std::int64_t left = slices.run.row_step == 0 ? in_slice - at : info().dims.x - x;
    const std::size_t n = std::min(samples.size(), static_cast<std::size_t>(left) * size);
    buffer_.assign(samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(n));
    to_stored(slices, info().type, buffer_.data(), n / size);
    const std::uint64_t position = slices.run.offset +
                                   static_cast<std::uint64_t>(z - slices.first_slice) * slices.run.step +
                                   place_of_row(slices.run, rows, y) + static_cast<std::uint64_t>(x) * size;
    if (slices.spare == SpareBits::kept) {
      spare_.resize(n);
      FileSource(staged(file)).read_at(position, spare_);
      for (std::size_t i = 0; i < n; ++i) buffer_[i] |= spare_[i];
    }
    open(file).write_at(position, buffer_);
    samples = samples.subspan(n);
    first += static_cast<std::int64_t>(n / size);
  }
}

void RestoredFiles::check() {
  open_.clear();
  for (std::size_t i = 0; i < files_.size(); ++i) {
    if (files_[i].checksum && !checksums_agree(*files_[i].checksum, checksum_of_file(staged(i))))
      throw BrokenInput("{}: is not the file that was encoded: its checksum differs", path(i));
    PlacedFile file(staged(i), path(i));
    if (options_.like) file.set_attributes(*options_.like);
    file.finish();
  }
}

/// Throws UsageError if a file may not get its name. Anything but a file is not replaced.
void RestoredFiles::check_target(std::size_t file) const {
  if (!is_safe_name(files_[file].name))
    throw UsageError("{}: no file of this system may have this name; restore it on the system of its name",
                     printable(path(file)));
  const auto status = status_of_name(path(file));
  if (status && !status->is_file() && !status->is_link())
    throw UsageError(path(file) + ": exists and is not a regular file");
  if (status)
    if (const auto other = placed_.find({status->device, status->number}); other != placed_.end())
      throw UsageError(
          "{}: this file system takes this name and {} for the same; restore them on the "
          "system of their names",
          printable(path(file)), printable(files_[other->second].name));
  if (status && !options_.overwrite)
    throw UsageError(path(file) + ": already exists", Problem::output_exists);
  refuse_same_file(input_, path(file));
}

/// Makes the directories of a file in folder_. None of them may be a link: it could lead anywhere.
void RestoredFiles::make_folders(const std::string& name) {
  for (std::size_t end = name.find('/'); end != name.npos; end = name.find('/', end + 1)) {
    const std::string folder = folder_ + "/" + name.substr(0, end);
    const auto status = status_of_name(folder);
    if (status && !status->is_folder())
      throw UsageError(folder + ": is not a directory, but source files belong in a directory of this name");
    if (!status) staging_->make(folder);
  }
}

void RestoredFiles::publish() {
  signals_wait_.emplace();  // all files, or none
  for (; published_ < files_.size(); ++published_) {
    const std::string target = path(published_);
    make_folders(files_[published_].name);
    check_target(published_);
    FileStatus status;
    if (!tagrid::files().status(staged(published_), false, status))
      throw world_error("cannot look at", target, errno);
    placed_[{status.device, status.number}] = published_;
    if (options_.overwrite) {
      // The older file keeps its name until the new one takes it. Some file systems have no links.
      if (!tagrid::files().link(target, older(published_)) && errno != ENOENT &&
          (errno == EBUSY || !tagrid::files().rename(target, older(published_))))
        throw world_error("cannot set aside", target, errno);
      if (!tagrid::files().rename(staged(published_), target)) {
        const int error = errno;
        give_back(published_);
        throw world_error("cannot rename the finished file to", target, error);
      }
    } else if (!tagrid::files().rename_to_new(staged(published_), target)) {
      throw world_error("cannot rename the finished file to", target, errno);
    }
  }
  for (const std::string& folder : staging_->made())
    for (const std::string& synced : {folder, folder_of(folder)}) sync(synced);
  sync(folder_);
}

void RestoredFiles::keep() {
  kept_ = true;
  staging_->keep();
  std::vector<std::string> left;
  if (options_.overwrite)
    for (std::size_t i = 0; i < files_.size(); ++i) left.push_back(older(i));
  const std::string path = staging_->path();
  const bool is_gone = staging_->remove(left);
  signals_wait_.reset();
  if (!is_gone) throw WorldError(path + ": cannot be removed; all files are restored");
}

void RestoredFiles::give_back(std::size_t i) {
  // Otherwise, the older file would be removed with the directory.
  if (!tagrid::files().rename(older(i), path(i)) && errno != ENOENT) staging_->keep();
}

void RestoredFiles::take_back() noexcept {
  open_.clear();
  while (published_ > 0) {
    tagrid::files().unlink(path(--published_));
    give_back(published_);
  }
  staging_.reset();
  signals_wait_.reset();
}

std::uint64_t RestoredFiles::bytes_written() const {
  std::uint64_t sum = 0;
  for (const EnvelopeFile& file : files_) sum += file.size;
  return sum;
}

}  // namespace tagrid
