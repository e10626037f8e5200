// The list of volumes that `convert` encodes. Each line has a path and tab-separated columns option=value.
// The outputs are paths below one directory that never lead out of it.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tools/archive/key_file.h"
#include "tools/options/encoding_options.h"

namespace tagrid {

class LateSyncs;

struct ManifestLine {
  std::size_t number = 0;  ///< in the file, from 1
  std::string name;   ///< as the list has it: its path there, and which volume of that: "scan (series=2)"
  std::string input;  ///< absolute
  bool is_relative = false;  ///< it was listed as a relative path
  std::string output;        ///< its path below the directory of the outputs: STEM.tag, or as requested
  std::string mark;          ///< that the output has its name from a key file; "": none
  OptionTexts options;       ///< those for all lines, overridden by those of this line
};

/// Reads the manifest at `path`, or from standard input for "-". Empty lines and lines that begin with '#'
/// are skipped. Relative paths start at the directory of the manifest, or at the current folder if it comes
/// from standard input. Without a column for it, the output of 2019/knee.nhdr is knee.tag, or 2019/knee.tag
/// with `keep_folders`. `given` holds the options for all lines. Throws UsageError if a line has an invalid
/// option or output, and if two lines have the same output; also throws WorldError.
std::vector<ManifestLine> read_manifest(const std::string& path, const OptionTexts& given, bool keep_folders);

/// The output for output=NAME: a path below the folder of the outputs, without "." and empty steps, and with
/// .tag at its end. Throws UsageError if the name is absolute, contains "..", names a folder, or leads
/// through a directory with the name of a file of records.
std::string output_called(const std::string& name);

/// True for a name that output_called() can give: a path below the directory of the outputs.
bool is_possible_output(const std::string& name);

/// What `--find` adds to a line, to show that a template without names gave the output this name. `output`: with .tag.
std::string mark_of_output(const std::string& output, const KeyFile& keys);
/// Throws UsageError if the line does not have the mark of its output: the archive must not have names of inputs.
void require_keyed_output(const ManifestLine& line, const KeyFile& keys);

/// The output that keeps the directories of `listed`, a path of the list: 2019/knee.tag for 2019/knee.nhdr,
/// and 2019/1.2.3.tag for the folder 2019/1.2.3. Throws UsageError if the path is absolute or contains "..".
std::string output_mirroring(const std::string& listed, bool is_folder);

/// Throws UsageError if a directory of `output` below `root` is a symbolic link or not a directory: outputs
/// would leave `root`, or have a second name there. Folders may be missing.
void require_own_folders(const std::string& root, const std::string& output);

/// Creates the missing folders of `output` below `root`. They are durable when it returns, or when `later` has synced.
/// Throws as require_own_folders() does, and WorldError.
void make_own_folders(const std::string& root, const std::string& output, LateSyncs* later = nullptr);

}  // namespace tagrid
