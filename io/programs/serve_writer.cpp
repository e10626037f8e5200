#include "io/programs/serve_writer.h"

#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "io/files/errors.h"
#include "io/nrrd/geometry.h"
#include "io/programs/serve.h"
#include "stages/volume/coding_parameters.h"

namespace tagrid {
namespace {

WriteRequest request_of(const OrderedJson& json) {
  const OrderedJson& volume = json.at("volume");
  const auto& dims = volume.at("dims");
  const auto type = sample_type_named(volume.at("type").get<std::string>());
  if (!type) throw UsageError(fmt::format("the type {} is not known", volume.at("type").dump()));
  return {json.at("path"), json.value("name", json.at("path").get<std::string>()),
          volume_info({dims.at(0), dims.at(1), dims.at(2)}, *type, volume.value("nrrd", "")),
          json.value("options", WriterOptions())};
}

/// What follows a request for slices: their bytes, which this program must take.
void take_slices(ServedOutput& output, const VolumeInfo& info, std::int64_t from, std::int64_t to) {
  std::vector<std::byte> slice(*sample_bytes({info.dims.x, info.dims.y, 1}, info.type));
  for (std::int64_t z = from; z < to; ++z) {
    if (!std::cin.read(reinterpret_cast<char*>(slice.data()), static_cast<std::streamsize>(slice.size())))
      throw WorldError(fmt::format("the samples end within slice {}", z));
    output.write_slice(z, slice.data());
  }
}

void say_done(ServedOutput& output) {
  OrderedJson facts = OrderedJson::object();
  for (const auto& [name, value] : output.finish()) facts[name] = OrderedJson::parse(value);
  say({{"answer", "done"}, {"facts", facts}});
}

void say_ready(const ServedOutput& output, const VolumeInfo& info) {
  const std::uint64_t slice = *sample_bytes({info.dims.x, info.dims.y, 1}, info.type);
  say({{"answer", "ready"},
       {"memory", memory_besides + 2 * memory_of_program() + slice + output.memory},
       {"warnings", output.warnings}});
}

}  // namespace

int serve_writer(const std::string& name, const BeginServed& begin) {
  std::ios::sync_with_stdio(false);
  begin_to_answer();
  say({{"tagrid-writer", 1}, {"name", name}, {"version", TAGRID_VERSION}});
  std::unique_ptr<ServedOutput> output;
  VolumeInfo info;
  std::string path;
  try {
    for (std::string line; std::getline(std::cin, line);) {
      const OrderedJson json = OrderedJson::parse(line);
      const std::string what = json.value("request", "");
      if (what == "write") {
        const WriteRequest request = request_of(json);
        info = request.info;
        path = request.name;
        output = begin(request);
        say_ready(*output, info);
      } else if (what == "slices" || what == "finish") {
        if (!output) throw UsageError("samples come before a volume");
        if (what == "slices")
          take_slices(*output, info, json.at("from"), json.at("to"));
        else
          say_done(*output);
      } else {
        say({{"answer", "unknown"}});
      }
    }
  } catch (const std::exception&) {
    // What follows may be samples: this conversation cannot go on.
    say_error(std::current_exception(), path,
              output ? "writing it needs more memory than was to be expected"
                     : "writing it needs more memory than its writer may take to begin");
  }
  return 0;
}

}  // namespace tagrid
