// Inputs by name: files, and sources that were declared under a name.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "io/files/file_bytes.h"

namespace tagrid {

/// From now on, open_source(name) is what `open` returns, as paths are names of files. It is opened once, when
/// it is first needed, and then stays open: everything that reads it sees the same bytes. Only callers that
/// know the name from the user may declare it, so that no file chooses what is read. `memory`: bytes that it
/// takes in all.
void declare_source(const std::string& name, std::uint64_t memory,
                    std::function<std::shared_ptr<const ByteSource>()> open);
bool is_declared_source(const std::string& name);
/// The sum of their memory.
std::uint64_t memory_of_declared_sources();

/// A declared source, or a regular file ("-": the standard input). Throws WorldError.
std::shared_ptr<const ByteSource> open_source(const std::string& path);

/// The same, read in order; a pipe is possible, too.
std::unique_ptr<ByteStream> open_stream(const std::string& path);

}  // namespace tagrid
