// What the caller of a run is told while it goes on.
#pragma once

#include <cstdint>
#include <functional>

namespace tagrid {

/// Told how many bytes of samples of how many are done; called by one thread at a time.
using Progress = std::function<void(std::uint64_t done, std::uint64_t total)>;

/// Told of a result when everything is written, just before the output gets its name: what has to succeed
/// together with it goes here. What it throws leaves nothing of the output.
template <class Result>
using BeforeNaming = std::function<void(const Result&)>;

}  // namespace tagrid
