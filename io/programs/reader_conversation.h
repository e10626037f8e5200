// The conversation of tagrid and a reader program; docs/dev/readers.md specifies it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/programs/format_program.h"
#include "io/volume/sample_places.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// The options of users for a volume, by their names: {"series", "2"}. Readers ignore those that they do not
/// know.
using ReaderOptions = std::map<std::string, std::string>;

/// What a reader says about a volume. `places` are of all samples; empty if the reader gives them.
struct ReaderVolume : SourceFacts {
  bool any_order = true;     ///< The reader gives any slices, again and again; otherwise only the next ones.
  std::uint64_t memory = 0;  ///< bytes that the reader may take
  bool has_plain_form = false;  ///< The reader can tell the plain form of its files.
  /// The reader can tell of the other volumes at the same path, and needs less time if the same process does.
  bool has_others = false;
};

/// Some slices of a volume, from number `first` on.
struct NumberedRun {
  std::int64_t first = 0;
  SliceRun run;
};

/// What a reader says about one of its files.
struct ReaderPlainFile {
  std::string compression;  ///< of its samples; "" if the file is as it is
  std::vector<PlainPiece> pieces;
  std::vector<NumberedRun> places;     ///< of its slices among these pieces
  std::optional<std::string> why_not;  ///< a sentence if there is no plain form
  std::vector<std::string> warnings;
};

/// All functions throw what the reader says is wrong: BrokenInput, UsageError or WorldError. If the reader
/// itself does wrong, they throw WorldError.
class ReaderConversation {
 public:
  /// Starts the program, and hears which version of the protocol it speaks. If it makes twins, one remains that opens
  /// no file, for this thread and as long as it lives; the conversation is with its twin.
  explicit ReaderConversation(const std::string& program, const FormatProgram::Limits& limits = {});

  /// Asks what is at `path`. Throws UsageError if it holds several volumes and the options choose none.
  ReaderVolume describe(const std::string& path, const ReaderOptions& options);
  /// Asks for slices [from, to). REQUIRES: describe() said that slices can be asked for.
  void ask_for_slices(std::int64_t from, std::int64_t to);
  /// Hears that slices [from, z) come, and returns z, which is at most `to`. They must be read next.
  std::int64_t hear_of_slices(std::int64_t from, std::int64_t to);
  /// Asks for the plain form of the files of a volume, one after the other. REQUIRES: describe() has given
  /// `volume`, and said that there is one; nothing else is awaited.
  PlainForm plain_form(const ReaderVolume& volume);
  /// Reads the next bytes of slices.
  void read(std::byte* out, std::size_t size) { process_->read(out, size); }
  /// Ends the program, which must have nothing left to say.
  void finish() { process_->finish(); }
  void stop_when(const std::atomic<bool>& stop) { process_->stop_when(stop); }

 private:
  std::unique_ptr<FormatProgram> process_;
};

}  // namespace tagrid
