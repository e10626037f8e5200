// The other side of the conversation: what a reader program written in C++ needs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/errors/errors.h"
#include "io/metadata/metadata.h"
#include "io/programs/reader_conversation.h"
#include "io/programs/serve.h"
#include "io/sandbox/sandbox.h"
#include "io/volume/sample_places.h"

namespace tagrid {

/// A volume that a reader program has opened.
class ServedVolume {
 public:
  virtual ~ServedVolume() = default;

  Index3 dims;
  SampleType type = SampleType::uint8;
  Geometry geometry;
  KeyValues pairs;
  /// Instead of geometry and pairs, if the file says more.
  std::optional<Metadata> metadata;
  std::vector<std::string> files, warnings;
  /// By which `series` means this volume, whatever lies beside it; "" if there is none.
  std::string lasting_name;
  /// What the files say about the samples and this reader does not understand, a sentence each; see
  /// SourceFacts.
  std::vector<std::string> not_understood;
  std::string scale_doubt;
  Rescale rescale;
  std::vector<SliceRun> places;  ///< of all samples, if they lie plainly in the files
  bool any_order = true;
  std::uint64_t memory = 0;     ///< bytes that read_slice() takes; the program's own are added
  bool has_plain_form = false;  ///< plain_file() can be called; only if there are no places
  /// There are other volumes at the same path, about which the next request of this process may be.
  bool has_others = false;

  /// Reads slice z, little endian. Called for each slice that is asked for, only if there are no places.
  virtual void read_slice(std::int64_t z, std::byte* out) = 0;
  /// The plain form of files[file].
  virtual ReaderPlainFile plain_file(std::size_t /*file*/) { return {}; }
};

/// Thrown by a reader that finds several volumes where one is wanted.
struct SeveralVolumes {
  std::string option;  ///< the option that chooses one
  std::vector<Choice> list;
};

/// The number, from 0 on, of the one that `wanted` names, or numbers from 1 on; without `wanted`, of the only
/// one. Throws SeveralVolumes if there are several; UsageError if none is meant, or two have that name.
/// `path` is for messages.
std::size_t chosen(const std::string& path, const std::string& option, const std::string& wanted,
                   const std::vector<Choice>& list);

/// Opens the volume at `path`. Throws BrokenInput, UsageError, WorldError, SeveralVolumes.
using OpenServed = std::unique_ptr<ServedVolume> (*)(const std::string& path, const ReaderOptions& options);

/// Answers requests on the standard input until it ends. Returns the exit code of the program. From its first request
/// on, the program is confined to the source that this names, and to the files `beside` it.
/// `prepare` does before that, once for all twins, what takes long and is the same for all sources. A program with it
/// makes twins. REQUIRES: no library that is linked or prepared starts threads.
int serve_volumes(const std::string& name, OpenServed open, const FilesBeside& beside = {},
                  void (*prepare)() = nullptr);

}  // namespace tagrid
