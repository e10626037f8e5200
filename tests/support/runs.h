// Whole runs of one process, each as a short call for tests.
#pragma once

#include <string>

#include "pipeline/meshes/mesh.h"
#include "pipeline/meshes/surface.h"
#include "pipeline/parts/part_work.h"
#include "pipeline/phantom/phantom.h"
#include "pipeline/run/run.h"

namespace tagrid {

template <class Result>
Result committed(Finished<Result> finished) {
  finished.commit();
  return finished.result;
}

inline EncodeResult encode_volume(const std::string& input, const SourceDescription& source,
                                  const std::string& output, bool overwrite, const EncodeOptions& options,
                                  const Resources& resources) {
  Ranks alone;
  return committed(encode_volume(alone, {.input = input,
                                         .source = source,
                                         .output = output,
                                         .overwrite = overwrite,
                                         .options = options,
                                         .resources = resources}));
}

inline DecodeResult decode_region(const std::string& input, const std::string& output, const Format& format,
                                  bool overwrite, const WantedRegion& region, const Resources& resources) {
  Ranks alone;
  return committed(decode_volume(alone, {.input = input,
                                         .output = output,
                                         .format = format,
                                         .overwrite = overwrite,
                                         .region = region,
                                         .resources = resources}));
}

inline DecodeResult decode_volume(const std::string& input, const std::string& output, const Format& format,
                                  bool overwrite, const Resources& resources) {
  return decode_region(input, output, format, overwrite, {}, resources);
}

inline VerifyResult verify_file(const std::string& input, const std::optional<std::string>& original,
                                const SourceDescription& source, const Resources& resources) {
  Ranks alone;
  return verify_file(alone, {.input = input, .original = original, .source = source, .resources = resources});
}

inline MeshResult write_mesh(const std::string& input, const std::string& output, const MeshOptions& options,
                             const Resources& resources) {
  return committed(
      write_mesh({.input = input, .output = output, .options = options, .resources = resources}));
}

inline SurfaceResult write_surface(const std::string& input, const std::string& output,
                                   const SurfaceOptions& options, const Resources& resources) {
  return committed(
      write_surface({.input = input, .output = output, .options = options, .resources = resources}));
}

inline std::uint64_t write_phantom(const PhantomOptions& options, const std::string& output,
                                   const Format& format, bool overwrite, int threads) {
  return committed(write_phantom(
      {.options = options, .output = output, .format = format, .overwrite = overwrite, .threads = threads}));
}

}  // namespace tagrid
