// --rm: removes the input when its output has been verified, if nothing is lost with it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "io/files/file_attributes.h"
#include "io/volume/volume_info.h"
#include "io/volume/volume_source.h"
#include "pipeline/decode/values.h"
#include "pipeline/job/options.h"
#include "tools/archive/named_files.h"
#include "tools/options/output_options.h"

namespace tagrid {

/// Throws UsageError if `source` chooses one of several volumes by a number that changes when files come or
/// go: one in the list of a directory, or of a set of files. The message says the name of that volume.
void require_lasting_choice(const std::string& input, const SourceDescription& source);

/// The files of a volume that may be removed after it was encoded to `output`. Throws UsageError if
/// one of them cannot be removed, if another volume may need it (it does not have the name of its
/// header, or one of the other `headers` names it), or if `output` is not a file that stays;
/// `advice` ends the message. Throws as require_lasting_choice() does, too. What else decides is
/// checked with require_replaceable() and then with require_files_come_back(), whose reasons are
/// the weaker ones.
std::vector<std::string> removable_volume(const std::string& input, const SourceDescription& source,
                                          const std::string& output, OtherHeaders& headers,
                                          const char* advice);

/// Other facts that decide whether an encoding may replace a volume.
struct Replacement {
  double max_error = 0;     ///< of any voxel; negative: no bound
  bool headerless = false;  ///< the options described the layout of the samples
  bool trusted = false;     ///< the user vouches for that description: --trust-description
  std::string doubt;        ///< why_not_understood()
};
/// Throws UsageError if too much would be lost with the volume: if nothing bounds the error, or if samples
/// change that may have been misread, or whose layout only the options describe. A wrong description does no
/// harm without loss. But within a bound of 5, a number with its bytes in the wrong order may be off by 1280.
void require_replaceable(const std::string& input, const Replacement& by, const char* advice);
/// Files are removed only if every byte comes back, except that samples may have the error that was asked
/// for. Throws UsageError for others, such as files with compressed samples. `keeps_files`: the encoding
/// keeps the files; with --strip it does not.
void require_files_come_back(const std::string& input, const SourceDescription& source,
                             const SourceFacts& facts, bool keeps_files, const char* advice);
/// True if a volume that is encoded with these options can be restored within a bound.
bool has_bound(const EncodeOptions& options);
/// Throws UsageError if these options give no bound. `option` is the one that asks for the removal.
void refuse_without_bound(const EncodeOptions& options, const std::string& option);

/// How a .tag file is decoded, as far as something can be lost by it.
struct Decoding {
  const Format& format;
  const WantedRegion& wanted;
  const VdbOptions& vdb;
  Numbers numbers = Numbers::automatic;
};

/// Throws UsageError if a .tag file cannot be removed after it was decoded: if it is not a file, if `output`
/// is not a file that stays, or if the output would hold less. Also throws BrokenInput and WorldError.
void require_replaceable_tag(const std::string& input, const std::string& output, const Decoding& decoding);

/// Files that a verified copy replaces, and the copy, both watched since before it was verified.
struct Removal {
  std::vector<std::string> files;
  UnchangedFiles originals;
  UnchangedFiles copy;
};
/// Removes the files if they and their copy are still those that were verified. Meanwhile, no other
/// process can rename or remove one of them. `tag` is the .tag file, which is either the original
/// or the copy. Calls `record` between the check and the removal. Throws BrokenInput if one was
/// changed or replaced since, and WorldError.
void remove_replaced(const Removal& removal, const std::string& tag,
                     const std::function<void()>& record = {});

}  // namespace tagrid
