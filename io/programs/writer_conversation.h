// The conversation of tagrid and a writer program; docs/readers.md specifies it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "io/programs/format_program.h"
#include "io/programs/mesh_layout.h"
#include "io/volume/volume_info.h"

namespace tagrid {

/// The options of users for the file, by their names: {"grid", "density"}. Writers ignore those that they do
/// not know.
using WriterOptions = std::map<std::string, std::string>;

/// What a writer says before it gets samples, or arrays.
struct WriterReady {
  std::uint64_t memory = 0;  ///< bytes that the writer may take
  std::vector<std::string> warnings;
};

/// All functions throw what the writer says is wrong: BrokenInput, UsageError or WorldError. If the writer itself does
/// wrong, they throw WorldError.
class WriterConversation {
 public:
  /// Starts the program, and hears which version of the protocol it speaks.
  explicit WriterConversation(const std::string& program, const FormatProgram::Limits& limits = {});

  /// Asks for the volume to be written into the file at `path`, which exists. `name` is what messages call it.
  WriterReady begin(const std::string& path, const std::string& name, const VolumeInfo& info,
                    const WriterOptions& options);
  /// The same for a mesh.
  WriterReady begin(const std::string& path, const std::string& name, const MeshLayout& mesh,
                    const WriterOptions& options);
  /// Announces slices [from, to), the next ones. Their bytes must follow.
  void announce_slices(std::int64_t from, std::int64_t to);
  /// Announces entries [from, to) of an array of the mesh, the next ones. Their bytes must follow, at most
  /// most_bytes_of_piece.
  void announce_entries(const std::string& array, std::int64_t from, std::int64_t to);
  /// Sends the next bytes of what was announced, little endian.
  void write(const std::byte* bytes, std::size_t size);
  /// Waits until the file is complete, and ends the program. Returns what the writer says of the file: a JSON object.
  std::string finish();

 private:
  WriterReady begin(const nlohmann::json& request, const std::string& name);
  void say(const nlohmann::json& request);
  /// While samples are sent, the writer may only say that it works, or what is wrong.
  void listen();

  FormatProgram process_;
};

}  // namespace tagrid
