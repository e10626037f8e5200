// The originals that `convert --remove-verified` removed, for `tagrid restore --records`.
#pragma once

#include <string>
#include <vector>

#include "tools/archive/key_file.h"

namespace tagrid {

/// An original that was removed.
struct RemovedOriginal {
  std::string input;     ///< its path in the list
  std::string output;    ///< path of the .tag file that replaces it
  std::string folder;    ///< where its files belong: the deepest folder that had all of them
  bool is_back = false;  ///< all of its files exist again, with their sizes
  std::string error;  ///< why it cannot be restored: its record has impossible names; "" if they are possible
};

struct RemovedOriginals {
  std::vector<RemovedOriginal> originals;  ///< by the names of their outputs
  /// Sentences on records that cannot be read, and on the outputs whose originals they may have named.
  std::vector<std::string> unknown;
};

/// The removed originals in the records of `output_dir`. Throws WorldError if these cannot be read, and
/// BrokenInput if there are none. `keys`: the key file of an archive without names, or null.
RemovedOriginals removed_originals(const std::string& output_dir, KeyFile* keys);

/// The deepest directory that holds the directories of all originals; "" if there is none.
std::string folder_of_all(const std::vector<RemovedOriginal>& originals);

}  // namespace tagrid
