// The conversation of tagrid and a writer program; docs/dev/readers.md specifies it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "io/programs/format_program.h"
#include "io/volume/volume_info.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

/// An array of a mesh: so many entries of one or several numbers.
struct MeshArray {
  std::string name;
  std::int64_t entries = 0;
  std::size_t entry_bytes = 1;

  bool operator==(const MeshArray&) const = default;
};

/// What is known of a mesh as a whole, by a name: texts, or numbers.
struct MeshField {
  std::string name;
  std::vector<std::string> texts;
  std::vector<std::int64_t> numbers;  ///< if there are no texts

  bool operator==(const MeshField&) const = default;
};

/// A mesh of tetrahedra, as a writer is told of it before its arrays come.
struct MeshLayout {
  /// Arrays of samples, by their names.
  using Data = std::vector<std::pair<std::string, SampleType>>;

  std::int64_t points = 0, tetrahedra = 0;
  Data point_data, cell_data;
  std::size_t nodes = 4;  ///< of a tetrahedron: 4, or 10
  std::vector<MeshField> fields = {};

  /// All arrays, in the order in which they are sent: the positions of points (three float64), the
  /// connectivity of tetrahedra (int64), and the data.
  std::vector<MeshArray> arrays() const;
};

inline constexpr const char* positions_array = "positions";
inline constexpr const char* connectivity_array = "connectivity";

/// The most bytes of an array that come with one announcement.
inline constexpr std::size_t most_bytes_of_piece = std::size_t{1} << 20;

/// The options of users for the file, by their names: {"grid", "density"}. Writers ignore those that they do
/// not know.
using WriterOptions = std::map<std::string, std::string>;

/// What a writer says before it gets samples, or arrays.
struct WriterReady {
  std::uint64_t memory = 0;  ///< bytes that the writer may take
  std::vector<std::string> warnings;
};

/// All functions throw what the writer says is wrong: BrokenInput, UsageError or WorldError. If the writer
/// itself does wrong, they throw WorldError.
class WriterConversation {
 public:
  /// Starts the program, and hears which version of the protocol it speaks.
  explicit WriterConversation(const std::string& program, const FormatProgram::Limits& limits = {});

  /// Asks for the volume to be written into the file at `path`, which exists. `name` is what messages call
  /// it.
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
  /// Waits until the file is complete, and ends the program. Returns what the writer says of the file: a JSON
  /// object.
  std::string finish();

 private:
  WriterReady begin(const nlohmann::json& request, const std::string& name);
  void say(const nlohmann::json& request);
  /// While samples are sent, the writer may only say that it works, or what is wrong.
  void listen();

  FormatProgram process_;
};

}  // namespace tagrid
