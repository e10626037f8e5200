// tagrid_documents: writes the manual page, the completions of shells and docs/options.md, all from the command
// line of tagrid and from the texts in docs/options.in. It is not installed.
#include <fmt/format.h>

#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "tools/documents/documents.h"

namespace {

using namespace tagrid;
namespace fs = std::filesystem;

std::string content_of(const fs::path& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path.string() + ": cannot be read");
  return {std::istreambuf_iterator<char>(file), {}};
}

void write_document(const fs::path& path, const std::string& content) {
  std::ofstream file(path);
  file << content;
  file.close();
  if (!file) throw std::runtime_error(path.string() + ": cannot be written");
}

void write_documents(const fs::path& docs, const fs::path& folder) {
  const std::vector<Command> commands = command_line_table();
  const fs::path source = docs / "options.in";
  try {
    const Texts texts = texts_in(content_of(source));
    compare(texts, commands);
    write_document(folder / "tagrid.1", manual_page(content_of(docs / "tagrid.1.in"), texts, commands));
    write_document(folder / "options.md", reference(texts, commands));
  } catch (const std::exception& error) {
    throw std::runtime_error(source.string() + ": " + error.what());
  }
  write_document(folder / "tagrid.bash", bash_completion(commands));
  write_document(folder / "_tagrid", zsh_completion(commands));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "usage: tagrid_documents DOCS FOLDER\n");
    return 64;
  }
  try {
    write_documents(argv[1], argv[2]);
  } catch (const std::exception& error) {
    fmt::print(stderr, "tagrid_documents: {}\n", error.what());
    return 65;
  }
  return 0;
}
