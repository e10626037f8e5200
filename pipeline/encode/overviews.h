// Overviews: averaged levels of a volume, encoded after its last brick and nested in its file.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "io/files/output_file.h"
#include "io/files/spool_file.h"
#include "io/tag/header.h"
#include "io/tag/index.h"
#include "pipeline/memory/resources.h"
#include "pipeline/overview/sums.h"

namespace tagrid {

/// The header of an overview of a file. `total` are the statistics of the file's samples.
TagHeader overview_header(const TagHeader& file, std::int64_t factor, const Statistics& total);

/// Writes bytes to a temporary file, which must outlive it.
class SpoolSink : public ByteSink {
 public:
  explicit SpoolSink(SpoolFile& file) : file_(file) {}
  void write(std::span<const std::byte> bytes) override { file_.write(bytes); }

 private:
  SpoolFile& file_;
};

/// Passes bytes, part by part.
using PassBytes = std::function<void(std::span<const std::byte>)>;
/// Writes a member; see TagWriter::write_member().
using MemberOut = std::function<void(std::uint32_t kind, std::uint32_t factor, std::uint64_t length,
                                     const std::function<void(const PassBytes&)>& content)>;

/// Encodes the overviews of a file with these factors, which increase, and passes them to `out`. `sums` are
/// those of blocks of 4. Temporary files are in `resources.spool`, which must not be "". Throws WorldError.
void write_overviews(const TagHeader& file, const std::vector<int>& factors, const Statistics& total,
                     SumsFile sums, const Resources& resources, const std::string& output,
                     const MemberOut& out);

}  // namespace tagrid
