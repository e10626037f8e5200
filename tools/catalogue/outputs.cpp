#include "tools/catalogue/outputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <optional>
#include <span>

#include "io/errors/errors.h"
#include "io/system/files.h"
#include "pipeline/threads/threads.h"
#include "tools/archive/records.h"
#include "tools/catalogue/facts.h"
#include "tools/report/report.h"

namespace tagrid {
namespace {

struct FoundFile {
  std::string name;
  std::uint64_t bytes = 0;
  std::int64_t modified = 0;
};

/// What is in an archive.
struct FoundFiles {
  std::vector<FoundFile> files;
  /// Names of what cannot be looked at, or beginnings of such names: nobody knows whether it is gone.
  std::vector<std::string> unseen;
  std::vector<std::string>& remarks;
};

/// Adds the outputs in `folder` and in the directories below it; `below`: its name in the archive. Hidden files are
/// temporary ones. Links are no outputs: what they lead to may be in another archive.
void add_outputs(const std::string& folder, const std::string& below, FoundFiles& found) {
  std::vector<FolderEntry> entries;
  if (!files().list(folder, entries)) {
    const WorldError error = world_error("cannot read", folder, errno);
    if (below.empty()) throw error;
    found.remarks.emplace_back(error.what());
    found.unseen.push_back(below);
    return;
  }
  for (const FolderEntry& entry : entries) {
    if (entry.name.starts_with('.')) continue;
    const std::string path = folder + "/" + entry.name, name = below + entry.name;
    if (entry.type == FileType::folder) {
      add_outputs(path, name + "/", found);
      continue;
    }
    if (!entry.name.ends_with(".tag")) continue;
    FileStatus status;
    if (entry.type == FileType::link) {
      found.remarks.push_back(path + ": is a link, and not listed");
    } else if (files().status(path, false, status)) {
      if (status.is_file()) found.files.push_back({name, status.size, status.modified.in_nanoseconds()});
    } else if (errno != ENOENT) {
      found.remarks.emplace_back(world_error("cannot look at", path, errno).what());
      found.unseen.push_back(name);
    }
  }
}

/// What differs from the index: files that are new or changed, and names of those that are gone.
struct Changes {
  std::vector<FoundFile> changed;
  std::vector<std::string> gone;
};

/// The files are sorted by name.
Changes changes_since(const Database& index, const FoundFiles& all) {
  const std::vector<FoundFile>& found = all.files;
  const auto is_unseen = [&](const std::string& name) {
    return std::ranges::any_of(all.unseen,
                               [&](const std::string& beginning) { return name.starts_with(beginning); });
  };
  Changes changes;
  Statement known = index.prepare(
      "SELECT name, bytes, modified, problem FROM volumes WHERE bytes IS NOT NULL ORDER BY name");
  auto file = found.begin();
  while (known.next()) {
    const std::string name = known.text(0);
    while (file != found.end() && file->name < name) changes.changed.push_back(*file++);
    if (file == found.end() || file->name != name) {
      if (!is_unseen(name)) changes.gone.push_back(name);
      continue;
    }
    // What could not be read may have been repaired, which changes neither its size nor its time.
    if (known.integer(1) != static_cast<std::int64_t>(file->bytes) || known.integer(2) != file->modified ||
        !known.is_null(3))
      changes.changed.push_back(*file);
    ++file;
  }
  changes.changed.insert(changes.changed.end(), file, found.end());
  return changes;
}

struct ReadFile {
  std::optional<FileFacts> facts;
  std::string problem;
};

ReadFile read_file(const std::string& path) {
  try {
    return {facts_of(path), ""};
  } catch (const Error& error) {
    return {std::nullopt, without_path(error.what(), path)};
  }
}

class OutputNotes {
 public:
  explicit OutputNotes(const Database& index)
      : row_(index.prepare("INSERT INTO volumes (name) VALUES (?) ON CONFLICT DO NOTHING")),
        file_(index.prepare(
            "UPDATE volumes SET bytes = ?2, modified = ?3, problem = ?4, patient = ?5, patient_id = ?6, "
            "study = ?7, "
            "study_description = ?8, study_date = ?9, series = ?10, modality = ?11, type = ?12, bound = ?13, "
            "voxels = ?14, raw_bytes = ?15, as_written = NULL, is_new = 1 WHERE name = ?1")),
        details_(index.prepare("INSERT INTO details (name, facts) VALUES (?, ?) "
                               "ON CONFLICT (name) DO UPDATE SET facts = excluded.facts")) {}

  void note(const FoundFile& file, const ReadFile& read) {
    row_.run(file.name);
    if (!read.facts) {
      file_.run(file.name, file.bytes, file.modified, read.problem);
      details_.run(file.name, std::nullopt);
      return;
    }
    const FileFacts& facts = *read.facts;
    file_.run(file.name, file.bytes, file.modified, std::nullopt, facts.subject.patient,
              facts.subject.patient_id, facts.subject.study, facts.subject.study_description,
              facts.subject.study_date, facts.subject.series, facts.subject.modality, facts.type, facts.bound,
              facts.voxels, facts.raw_bytes);
    details_.run(file.name, written_json(facts.more));
  }

  void forget(const std::string& name) {
    file_.run(name);
    details_.run(name, std::nullopt);
  }

 private:
  Statement row_, file_, details_;
};

/// Files of another size than their record says. Parity that was added makes a file larger than it was written.
void compare_sizes(const Database& index, const std::string& folder) {
  index.execute("UPDATE volumes SET as_written = (bytes = written) WHERE is_new");
  std::vector<std::string> whole;
  {
    Statement others = index.prepare("SELECT name, written FROM volumes WHERE is_new AND as_written = 0");
    while (others.next()) {
      KnownOutput known;
      known.bytes_out = static_cast<std::uint64_t>(others.integer(1));
      try {
        if (has_written_size(known, folder + "/" + others.text(0))) whole.push_back(others.text(0));
      } catch (const Error&) {
        // It cannot be read, which is its problem.
      }
    }
  }
  Statement note = index.prepare("UPDATE volumes SET as_written = 1 WHERE name = ?");
  for (const std::string& name : whole) note.run(name);
  index.execute("UPDATE volumes SET is_new = NULL WHERE is_new");
}

}  // namespace

bool has_outputs(const std::string& folder) {
  std::vector<std::string> remarks;
  FoundFiles found{{}, {}, remarks};
  add_outputs(folder, "", found);
  return !found.files.empty() || !found.unseen.empty();
}

void note_outputs(const Database& index, const std::string& folder, int threads,
                  std::vector<std::string>& remarks) {
  FoundFiles found{{}, {}, remarks};
  add_outputs(folder, "", found);
  std::ranges::sort(found.files, {}, &FoundFile::name);
  const auto [changed, gone] = changes_since(index, found);
  OutputNotes notes(index);
  for (const std::string& name : gone) notes.forget(name);
  constexpr std::size_t together = 4096;  // whose facts are in memory
  Threads readers(threads);
  for (std::size_t first = 0; first < changed.size(); first += together) {
    const std::span files = std::span(changed).subspan(first, std::min(together, changed.size() - first));
    std::vector<ReadFile> read(files.size());
    readers.run([&] {
      share_rows(std::ssize(files), bytes_of_task, 1, [&](std::int64_t i, std::int64_t) {
        const auto at = static_cast<std::size_t>(i);
        read[at] = read_file(folder + "/" + files[at].name);
      });
    });
    for (std::size_t i = 0; i < files.size(); ++i) notes.note(files[i], read[i]);
  }
  compare_sizes(index, folder);
}

}  // namespace tagrid
