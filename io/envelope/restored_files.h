// The files of a source, restored from an envelope and decoded samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/envelope/envelope.h"
#include "io/files/file_attributes.h"
#include "io/files/output_file.h"
#include "io/files/output_folder.h"
#include "io/files/temporaries.h"
#include "io/volume/volume_sink.h"

namespace tagrid {

/// Makes the files in a hidden directory beside their final places. publish() gives them their names: all of
/// them, or none. Takes decoded samples in any order. Every failure to write is a WorldError.
class RestoredFiles : public VolumeSink {
 public:
  /// `input` is the .tag file, which is never written to. Creates `folder` and its parents if they do not
  /// exist. Throws UsageError if `folder` is not a directory.
  RestoredFiles(const VolumeInfo& info, std::string input, std::string folder, const SinkOptions& options);
  ~RestoredFiles() override;

  /// Makes the next file, without samples; false after the last one. Throws BrokenInput; UsageError if a file
  /// already exists.
  bool make_next(EnvelopeReader& envelope);
  /// The file that was made last, where it is now.
  std::string staged_last() const { return staged(files_.size() - 1); }
  /// Replaces the bytes of that file by these: given ones and stretches of itself. All of its samples must be in
  /// one of these. It then has no checksum. Throws BrokenInput if samples are elsewhere.
  void rewrite_last(const std::vector<PlainPiece>& pieces);
  /// Checks the finished files that have checksums, and makes all durable. Throws BrokenInput.
  void check();

  const std::vector<EnvelopeFile>& files() const { return files_; }

  bool any_order() const override { return true; }
  Place place() const override { return {}; }
  void publish() override;
  void keep() override;
  std::uint64_t bytes_written() const override;

 private:
  struct SlicesOfFile {
    std::size_t file = 0;
    SlicesInFile slices;
  };

  void write(std::int64_t first, std::span<const std::byte> samples) override;
  PlacedFile& open(std::size_t file);
  std::string staged(std::size_t file) const;
  std::string older(std::size_t file) const;
  std::string path(std::size_t file) const { return folder_ + "/" + files_[file].name; }
  void check_target(std::size_t file) const;
  void find_slices();
  void make_folders(const std::string& name);
  /// The older file, if there was one, gets its name again. If that fails, the hidden directory stays, with it.
  void give_back(std::size_t i);
  void take_back() noexcept;

  std::string input_, folder_;
  SinkOptions options_;
  std::optional<StagingFolder> staging_;
  std::vector<EnvelopeFile> files_;
  std::vector<SlicesOfFile> slices_;  ///< in the order of the volume
  std::map<std::size_t, std::unique_ptr<PlacedFile>> open_;
  std::size_t published_ = 0;  ///< files that have their names
  /// Those files, by device and number.
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::size_t> placed_;
  bool kept_ = false;
  std::optional<SignalsWait> signals_wait_;  ///< while files get their names
  std::vector<std::byte> buffer_, spare_;
};

}  // namespace tagrid
