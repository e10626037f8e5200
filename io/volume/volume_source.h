// Sources of samples: a file of any format, a pipe, or another source.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "io/files/file_attributes.h"
#include "io/files/open_files.h"
#include "io/text/text.h"
#include "io/volume/sample_places.h"
#include "io/volume/volume_info.h"
#include "stages/grid/box.h"

namespace tagrid {

/// How a source can be read.
struct SourceTraits {
  bool again = false;         ///< Any slice can be read next, any number of times. True for a file, false for
                              ///< a pipe.
  bool any_rows = false;      ///< Any rows can be read, not only the next ones. Implies `again`.
  bool whole_slices = false;  ///< Only complete slices can be read.
  std::uint64_t memory = 0;   ///< Bytes of memory that reading takes, besides the requested samples.
};

/// The facts about a source that are known before a sample is read.
struct SourceFacts {
  VolumeInfo info;
  /// The files of the source: its own file and, if the header is detached, the file of the samples. "-" is
  /// the standard input.
  std::vector<std::string> files;
  SourceTraits traits = {};
  /// For messages: what the user calls the volume, such as its folder; "" if it is its last file.
  std::string name = "";
  /// The name that chooses this volume among those of its source, now and when files of other volumes have
  /// come or gone; "" if the format has no such names.
  std::string lasting_name = "";
  /// Of several volumes: their names or moments, each a line of text; empty if they have none.
  std::vector<std::string> volume_names = {};
  /// The files contain other bytes, besides a header and these samples; they are skipped.
  bool holds_other_bytes = false;
  /// The layout of the samples was given by the user, because the file does not say it.
  bool headerless = false;
  /// Samples are stored as they are; users give bounds for values.
  Rescale rescale = {};
  /// What users should know of the volume, a sentence each; see all_warnings().
  std::vector<std::string> warnings = {};
  /// What the files say about the samples and the reader does not understand, a sentence each. A lossy
  /// encoding cannot replace such files, since a comparison with them would not notice what was misread.
  std::vector<std::string> not_understood = {};
  /// A clause on what the files should state about the voxel size but do not, such as "its voxel
  /// size is not stated"; "" if nothing is missing, or if the format cannot store it.
  std::string missing_of_voxel_size = "";
  /// A sentence if it is unknown how values follow from samples, because a field that says so cannot be read.
  /// A bound on values cannot be kept then. "" if it is known.
  std::string scale_doubt = "";
  /// Where all samples lie in the files, from front to back; empty if they do not lie there plainly.
  std::vector<SliceRun> places = {};
  /// The files, if several readers share them.
  std::shared_ptr<OpenFiles> opened = nullptr;
  /// For a source without places: tells its files as they would be if samples lay plainly in them. Empty if
  /// nobody can tell. Throws as opening the source does.
  std::function<PlainForm()> plain_form = {};

  /// For messages: the path that the user gave, or "standard input". REQUIRES: there are files.
  std::string shown_name() const {
    const std::string& shown = name.empty() ? files.back() : name;
    return shown_input(shown);
  }
};

/// A volume that was opened, and its files as they were then.
struct KnownVolume {
  SourceFacts facts;
  UnchangedFiles files;
};

/// All that users should be told of a source: warnings, what was not understood, doubts about its scale.
std::vector<std::string> all_warnings(const SourceFacts& facts);

/// Why a lossy encoding must not replace files of this description; "" if it may.
std::string why_not_understood(const SourceFacts& facts);

/// A volume that is read in raster order or, if its traits allow it, in any order. Samples have the type
/// info().type and the machine's byte order, x fastest. All functions throw BrokenInput and WorldError.
class VolumeSource {
 public:
  virtual ~VolumeSource() = default;
  VolumeSource(const VolumeSource&) = delete;
  VolumeSource& operator=(const VolumeSource&) = delete;

  const SourceFacts& facts() const { return facts_; }
  const VolumeInfo& info() const { return facts_.info; }
  const SourceTraits& traits() const { return facts_.traits; }
  const std::vector<std::string>& files() const { return facts_.files; }
  std::string name() const { return facts_.shown_name(); }
  void set_name(const std::string& name) { facts_.name = name; }
  void set_metadata(Metadata metadata) { facts_.info.metadata = std::move(metadata); }
  void add_warning(std::string sentence) { facts_.warnings.push_back(std::move(sentence)); }
  void set_missing_of_voxel_size(std::string clause) { facts_.missing_of_voxel_size = std::move(clause); }
  /// Doubts of an earlier reader, which the description tells.
  void set_doubts(std::string scale_doubt, std::vector<std::string> not_understood) {
    facts_.scale_doubt = std::move(scale_doubt);
    facts_.not_understood = std::move(not_understood);
  }

  /// Samples in a slice: dims.x * dims.y.
  std::int64_t slice_samples() const { return info().dims.x * info().dims.y; }
  std::uint64_t slice_bytes() const {
    return static_cast<std::uint64_t>(slice_samples()) * size_of(info().type);
  }
  /// The number of the next sample, in raster order.
  std::int64_t next_sample() const { return next_sample_; }

  /// Reads the next `count` samples to `out`. REQUIRES: at least `count` samples are left; they form whole
  /// slices if traits().whole_slices.
  void read_samples(std::byte* out, std::int64_t count);
  void read_slices(std::byte* out, std::int64_t count) { read_samples(out, count * slice_samples()); }
  /// Reads complete rows of one slice: any rows if traits().any_rows, otherwise the next ones.
  void read_rows(std::byte* out, const Box& rows);
  /// Reads `count` samples from number `first` on. REQUIRES: traits().any_rows, or these are the next ones.
  void read_from(std::byte* out, std::int64_t first, std::int64_t count);
  /// True if several threads can read at once, with read_at(). Implies traits().any_rows.
  virtual bool at_once() const { return false; }
  /// As read_from(), but does not change which samples are next. REQUIRES: at_once().
  virtual void read_at(std::byte* /*out*/, std::int64_t /*first*/, std::int64_t /*count*/) const {
    throw std::logic_error("these samples cannot be read by several threads");
  }
  /// Makes slice `z` the next one. REQUIRES: traits().again, 0 <= z <= dims.z.
  void seek_slice(std::int64_t z);
  void rewind() { seek_slice(0); }
  /// To be called after the last sample. Throws BrokenInput if anything follows it.
  void finish();

  /// Bytes of all files read since the last rewind, or the total size of the files.
  virtual std::uint64_t bytes_read() const = 0;
  /// From now on, a waiting read throws WorldError once `stop` is true. `stop` must outlive the reads.
  virtual void stop_when(const std::atomic<bool>& /*stop*/) {}

 protected:
  explicit VolumeSource(SourceFacts facts) : facts_(std::move(facts)) {}

 private:
  virtual void read(std::byte* out, std::int64_t first, std::int64_t count) = 0;
  virtual void seek(std::int64_t z) = 0;
  virtual void end() = 0;

  SourceFacts facts_;
  std::int64_t next_sample_ = 0;
};

/// Reads all remaining samples, one MiB or one slice at a time, and calls finish().
template <class Use>
void read_to_end(VolumeSource& source, Use use) {
  constexpr std::size_t at_once = std::size_t{1} << 20;
  const std::size_t size = size_of(source.info().type);
  std::int64_t left = Box::of_size(source.info().dims).count() - source.next_sample();
  const std::int64_t most =
      source.traits().whole_slices ? source.slice_samples() : static_cast<std::int64_t>(at_once / size);
  std::vector<std::byte> samples(static_cast<std::size_t>(std::min(most, left)) * size);
  for (; left > 0; left -= std::min(most, left)) {
    const std::int64_t count = std::min(most, left);
    source.read_samples(samples.data(), count);
    use(std::span(samples).first(static_cast<std::size_t>(count) * size));
  }
  source.finish();
}

/// The checksum of all samples of a volume, in raster order and the byte order of memory. It does not depend
/// on the format of the volume. Throws BrokenInput, WorldError. REQUIRES: nothing was read yet.
std::uint64_t checksum_of_samples(VolumeSource& source);

/// A source of any rows. It reads the entire slice that contains them. If this is not the next slice, the
/// source may have to read everything before it. So at most `kept` slices are kept, of which rows may be
/// wanted later: those of the stretch that is being read, which is a sequence of slices that become later and
/// later. Memory: that of `source`, one slice, and the ones that are kept. REQUIRES: source->traits().again.
std::unique_ptr<VolumeSource> rows_of_slices(std::shared_ptr<VolumeSource> source, std::int64_t kept = 0);

}  // namespace tagrid
