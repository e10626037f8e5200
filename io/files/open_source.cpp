#include "io/files/open_source.h"

#include <map>
#include <mutex>
#include <utility>

namespace tagrid {
namespace {

struct Declared {
  std::uint64_t memory = 0;
  std::function<std::shared_ptr<const ByteSource>()> open;
  std::shared_ptr<const ByteSource> source;  ///< nullptr until it is needed
};

struct Names {
  std::mutex mutex;
  std::map<std::string, Declared> sources;
};

// Never destroyed: when the process ends, libraries that sources use may be gone before them.
Names& names() {
  static Names& all = *new Names;
  return all;
}

/// nullptr if it was not declared.
std::shared_ptr<const ByteSource> declared(const std::string& name) {
  Names& all = names();
  const std::lock_guard lock(all.mutex);
  const auto found = all.sources.find(name);
  if (found == all.sources.end()) return nullptr;
  if (!found->second.source) found->second.source = found->second.open();
  return found->second.source;
}

}  // namespace

void declare_source(const std::string& name, std::uint64_t memory,
                    std::function<std::shared_ptr<const ByteSource>()> open) {
  Names& all = names();
  const std::lock_guard lock(all.mutex);
  all.sources[name] = {memory, std::move(open), nullptr};
}

bool is_declared_source(const std::string& name) {
  Names& all = names();
  const std::lock_guard lock(all.mutex);
  return all.sources.contains(name);
}

std::uint64_t memory_of_declared_sources() {
  Names& all = names();
  const std::lock_guard lock(all.mutex);
  std::uint64_t sum = 0;
  for (const auto& [name, source] : all.sources) sum += source.memory;
  return sum;
}

std::shared_ptr<const ByteSource> open_source(const std::string& path) {
  if (auto source = declared(path)) return source;
  return std::make_shared<FileSource>(path);
}

std::unique_ptr<ByteStream> open_stream(const std::string& path) {
  if (auto source = declared(path)) return std::make_unique<SourceStream>(std::move(source));
  return std::make_unique<FileBytes>(path);
}

}  // namespace tagrid
