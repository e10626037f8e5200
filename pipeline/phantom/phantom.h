// Writes a phantom, slice by slice.
#pragma once

#include <cstdint>
#include <string>

#include "io/formats/formats.h"
#include "pipeline/memory/progress.h"

namespace tagrid {

struct PhantomOptions {
  Index3 dims;
  SampleType type = SampleType::int16;
  std::uint64_t seed = 1;
};

/// Writes the phantom of stages/phantom/phantom.h to `output` ("-": standard output), with `threads` slices
/// at a time in memory. The samples depend on the options alone. Returns the number of bytes written. Throws
/// UsageError and WorldError; then nothing is left under the name of the output.
std::uint64_t write_phantom(const PhantomOptions& options, const std::string& output, const Format& format,
                            bool overwrite, int threads, const Progress& progress = {},
                            const BeforeNaming<std::uint64_t>& before_naming = {});

}  // namespace tagrid
