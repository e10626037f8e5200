// Originals of an archive that have moved: their records name the new places.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace tagrid {

struct Moved {
  std::size_t records = 0, changed = 0;
  std::vector<std::string> unknown;  ///< lines that are no records: "results.jsonl: line 3"
};

/// In all records of an archive, replaces the directory `from` of originals by `to`. Both are absolute; `from` need not
/// exist any more. Names that were relative stay relative. `keys`: a key file that is changed with them; "": none.
/// Throws HeldByAnother if a run adds to the records, and WorldError.
Moved move_originals(const std::string& folder, const std::string& from, const std::string& to,
                     const std::string& keys);

}  // namespace tagrid
