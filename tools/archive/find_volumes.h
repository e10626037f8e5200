// All volumes below a directory.
#pragma once

#include <functional>
#include <string>

#include "tools/archive/name_template.h"
#include "tools/options/encoding_options.h"

namespace tagrid {

/// A line for a list of volumes, or a file or directory that is not listed.
struct FoundVolume {
  enum class Kind {
    volume,
    broken,      ///< It looks like a volume and cannot be read.
    nameless,    ///< the template of names gives it none, or that of another volume
    passed_over  ///< files that are not volumes: one entry for those of a directory that are alike
  };

  std::string path;     ///< absolute
  OptionTexts options;  ///< that are needed to read it: {"series", "1.2.3"}
  std::string output;   ///< its place below the directory that was searched, or its name by a template;
                        ///< no other output has it
  std::string text;     ///< "512 x 512 x 300 int16, DICOM"; or what is wrong; or which files, and why
  Kind kind = Kind::volume;
  std::size_t files = 1;  ///< that are passed over
};

/// Who hears of a search.
struct SearchWatch {
  std::function<void(const std::string& directory)> enter;  ///< before it is searched
  std::function<void(const FoundVolume&)> found;
};

/// Calls found() for every volume in `root` and the directories below it, in natural order, and at the end for what was
/// passed over. Slices are found as a directory and a series in it, the images of a DICOMDIR as series of the DICOMDIR.
/// An output is named after path and series alone, so that it stays when other volumes come; or as the template
/// `names`, unless this is null. Hidden files and directories are skipped. Throws WorldError if `root` cannot be read.
/// `accepted` tells whether to list folders with missing slices (gaps_ok), and headers that name files elsewhere
/// (data_outside). `run` limits the memory of readers; if it is quiet, what is passed over is not reported.
void find_volumes(const std::string& root, const SourceOptions& accepted, const RunOptions& run,
                  const NameTemplate* names, const SearchWatch& watch);

}  // namespace tagrid
