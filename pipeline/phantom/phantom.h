// Writes a phantom, slice by slice.
#pragma once

#include <cstdint>
#include <string>

#include "io/formats/table/formats.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

struct PhantomOptions {
  Index3 dims;
  SampleType type = SampleType::int16;
  std::uint64_t seed = 1;
};

struct PhantomRun {
  PhantomOptions options;
  std::string output;  ///< "-": the standard output
  const Format& format = format_named("nrrd");
  bool overwrite = false;
  int threads = 1;
  Progress progress = {};
};

/// Writes the phantom of stages/phantom/phantom.h, `threads` slices at a time. Returns the bytes written.
/// Throws UsageError and WorldError; then nothing is left under the name of the output.
Finished<std::uint64_t> write_phantom(const PhantomRun& run);

}  // namespace tagrid
