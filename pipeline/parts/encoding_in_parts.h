// An encoding in parts: all ranks make them, a later run can continue, and in the end they become one file.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/envelope/envelope.h"
#include "io/files/output_file.h"
#include "io/parts/part_folder.h"
#include "io/parts/run_record.h"
#include "io/tag/file.h"
#include "io/tag/pages.h"
#include "io/volume/volume_source.h"
#include "pipeline/encode/encode_run.h"
#include "pipeline/overview/sums.h"
#include "pipeline/parts/part_work.h"
#include "pipeline/settle/settle.h"

namespace tagrid {

/// Whether an earlier run has made the file of a job.
enum class Made : std::uint8_t {
  no,
  yes,       ///< as its record says
  in_doubt,  ///< a file has the name of the output, and no record says what it is
};

/// The functions are called in this order by rank 0; the other ranks serve(). Without commit(), the destructor leaves
/// nothing, unless the run can be continued. All functions throw WorldError and BrokenInput.
class EncodingInParts : private MemberSink {
 public:
  /// Holds the directory of the parts, and reads the record of an earlier run. `ranks` and `run` must outlive all calls
  /// but commit(). Throws UsageError if the output must not be written, or if the source has several volumes.
  EncodingInParts(Ranks& ranks, const EncodeRun& run, const VolumeSource& source);

  /// What the earlier run found in the same samples need not be searched again.
  EarlierFindings earlier_findings() const;
  /// Takes the job, unless an earlier run may have made the file. Throws UsageError if that run had another job.
  Made take(const EncodeJob& job);
  /// Makes the parts that are missing, and writes all into the file. Adds what that took to `result`: memory, bytes_in,
  /// times_read.
  void encode(const EncodeJob& job, const VolumeSource& source, EncodeResult& result);
  /// As look_at_contents() in pipeline/restore, on all ranks.
  void look_at(SourceFiles& files, bool exact);
  void write_envelope(std::span<const std::byte> bytes) { envelope_->write(bytes); }
  /// Writes the end of the file. Sets index, file_bytes and temporary of `result`.
  void finish(EncodeResult& result);
  /// Gives the file its name. After this, the run can no longer be continued.
  void commit();

 private:
  /// The end of what was written of the file.
  struct End : ByteSink {
    void write(std::span<const std::byte> bytes) override {
      file->write_at(position, bytes);
      position += bytes.size();
    }
    std::unique_ptr<OutputFile> file;  ///< none if an earlier run has already given it its name
    std::uint64_t position = 0, checksum = 0;
  };

  void write_overviews(const TagHeader& header);
  void write_member(std::uint32_t kind, std::uint32_t factor, SpoolFile& content) override;
  bool read_earlier_record();
  std::string advice() const;
  void require_same_run() const;
  bool is_output_there() const;
  bool is_finished() const;
  void describe_finished(EncodeResult& result) const;
  std::uint64_t input_bytes() const;
  std::vector<PartPlace> survey(std::int64_t part);
  void take_sums(PartReader& reader, const Box& blocks);
  void tell_of_parts() const;
  void place(const std::optional<FileAttributes>& like);
  void record_result();

  Ranks& ranks_;
  const EncodeRun& run_;
  RunRecord record_, earlier_;
  Bytes record_bytes_;
  bool goes_on_ = false;  ///< from an earlier run
  /// The file is in that directory until it gets its name.
  std::unique_ptr<PartFolder> folder_;
  std::unique_ptr<PartsOfRun> parts_;
  End end_;
  std::optional<PageBlocks> pages_;
  std::optional<EnvelopeBlocks> envelope_;
  std::vector<int> overviews_;
  std::optional<SumsFile> sums_;  ///< if there are overviews
};

}  // namespace tagrid
