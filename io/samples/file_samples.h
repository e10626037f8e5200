// Samples stored in order in a file or a pipe, uncompressed, in gzip or in bzip2; the file may be one that a
// header names, or a temporary copy.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "io/errors/errors.h"
#include "io/files/compressed_bytes.h"
#include "io/files/file_bytes.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// The size of the file does not fit the samples: it may not be the intended file.
class WrongSize : public BrokenInput {
 public:
  WrongSize(const std::string& message, std::string_view bytes) : BrokenInput(message), beginning(bytes) {}

  std::string beginning;  ///< The first bytes of the file; "" if samples do not begin at byte 0.
};

/// Where the samples are in a file, and how they are stored.
struct SamplesPlace {
  std::uint64_t start = 0;  ///< The byte of the file at which the samples begin, or the compressed stream
                            ///< that contains them.
  bool big_endian = false;
  bool may_go_on = false;          ///< Bytes after the samples are not an error.
  std::uint64_t header_bytes = 0;  ///< Bytes that were already read from another file: a detached header.
};

/// If a file has more bytes than the samples of `facts` at this place, it may go on, and a warning says so.
void allow_more(const FileBytes& file, SamplesPlace& place, SourceFacts& facts);

/// The uncompressed samples at this place of a file, which is the last one of `facts`. A regular file's facts
/// then say where they lie. Throws WrongSize if a file does not have exactly as many bytes after `start` as
/// the samples need (at least as many if it may go on), and BrokenInput if a pipe ends before `start`.
std::unique_ptr<VolumeSource> plain_samples(SourceFacts facts, std::unique_ptr<FileBytes> file,
                                            const SamplesPlace& place);

/// The beginning of a plain form: what precedes the samples in their file, or the file of the header.
using PlainHeader = std::function<PlainFile()>;

/// The samples in a gzip, zlib or bzip2 stream that extends from this place to the end of the last file of
/// `facts`, after `skipped` decompressed bytes. The facts of a regular file then tell its plain form: if
/// `facts` has one file, `header` gives the pieces before the stream, by default the bytes there; otherwise
/// it gives the first file. A gzip stream in a file may have more bytes, with a warning. Throws BrokenInput
/// if the file is too small for the samples.
std::unique_ptr<VolumeSource> compressed_samples(SourceFacts facts, std::unique_ptr<FileBytes> file,
                                                 SamplesPlace place, std::uint64_t skipped,
                                                 const PlainHeader& header = {},
                                                 Compression compression = Compression::gzip);

/// Copies all samples to an unnamed temporary file in `folder`, and returns a source that reads any rows from
/// it. All other facts about the volume stay the same. REQUIRES: nothing was read of `source`, or it was
/// rewound.
std::unique_ptr<VolumeSource> spooled(std::unique_ptr<VolumeSource> source, const std::string& folder);

}  // namespace tagrid
