// tagrid serve: gives .tag files to viewers on this machine, as OME-Zarr.

#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "io/errors/errors.h"
#include "io/files/open_source.h"
#include "io/formats/table/formats.h"
#include "io/server/site.h"
#include "io/tag/bricks.h"
#include "io/text/addresses.h"
#include "pipeline/memory/resources.h"
#include "pipeline/serving/served_zarr.h"
#include "tools/commands/commands.h"
#include "tools/commands/local_site.h"
#include "tools/options/output_options.h"
#include "tools/options/shared_options.h"
#include "tools/report/damage.h"
#include "tools/report/process.h"

namespace tagrid {
namespace {

struct ServeCommand {
  std::vector<std::string> inputs, origins;
  std::optional<std::int64_t> volume;
  int port = 0;
  RunOptions run;

  struct Image {
    std::string name, path;  ///< "scan", "/<token>/scan.zarr/"
    std::unique_ptr<ServedZarr> zarr;
  };

  void execute() const {
    for (const std::string& origin : origins) check_origin(origin);
    const std::vector<Image> images = open_images("/" + random_token() + "/");
    WebSite site;
    site.origins = origins;
    site.made = [&images](std::string_view path) -> std::shared_ptr<const ByteSource> {
      for (const Image& image : images)
        if (path.starts_with(image.path)) return image.zarr->file(path.substr(image.path.size()));
      return nullptr;
    };
    serve_until_interrupted(site, port, [&](const std::string& machine, const sigset_t&) {
      for (const Image& image : images) std::cout << machine << image.path << std::endl;
      flush_standard_output();
      if (!run.quiet) tell(images, machine);
    });
  }

  /// An origin is what browsers send of the address of a page: nothing follows the host and the port.
  static void check_origin(const std::string& origin) {
    const auto host = origin.find("://");
    const bool is_good =
        (origin.starts_with("https://") || origin.starts_with("http://")) && host + 3 < origin.size() &&
        origin.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789.-:[]", host + 3) == std::string::npos;
    if (!is_good)
      throw usage_error(
          "--origin {}: must be http:// or https://, a host in small letters and perhaps a port, such as "
          "https://neuroglancer-demo.appspot.com",
          origin);
  }

  std::vector<Image> open_images(const std::string& root) const {
    std::vector<Image> images;
    for (const std::string& input : inputs)
      with_repair_advice(input, [&] { open_image(input, root, images); });
    return images;
  }

  void open_image(const std::string& input, const std::string& root, std::vector<Image>& images) const {
    require_tag_input(input);
    if (input == "-") throw UsageError("standard input: only a file can be served; save it as one first");
    const std::int64_t number = chosen_volume(input, volume, run);
    const auto file = std::make_shared<const TagBricks>(volume_in(open_source(input), number));
    std::string name = name_of_input(input);
    if (name.ends_with(".tag")) name.resize(name.size() - 4);
    const std::string path = root + percent_encoded(name) + ".zarr/";
    for (const Image& other : images)
      if (other.path == path)
        throw usage_error("{}: another file of this name is served, too; serve one of them at a time", input);
    images.push_back({name, path, std::make_unique<ServedZarr>(file, name, available_threads())});
    tell_of_losses(input, images.back().zarr->info());
  }

  void tell_of_losses(const std::string& input, const VolumeInfo& info) const {
    const Format& zarr = format_named("zarr");
    if (const std::string lost = zarr.lost_rescale(info); !lost.empty())
      warn(run, "{}: viewers show stored samples: {}", input, lost);
    for (const std::string& lost : zarr.lost(info)) warn(run, "{}: {}", input, lost);
  }

  void tell(const std::vector<Image>& images, const std::string& machine) const {
    nlohmann::ordered_json layers = nlohmann::ordered_json::array();
    for (const Image& image : images) {
      layers.push_back(
          {{"type", "image"}, {"name", image.name}, {"source", "zarr://" + machine + image.path}});
      // Otherwise, grey values are those of the whole range of the type.
      if (const auto& range = image.zarr->facts().range)
        layers.back()["shaderControls"]["normalized"]["range"] = {(*range)[0], (*range)[1]};
    }
    const std::string state = nlohmann::ordered_json{{"layers", layers}}.dump(
        -1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
    for (const std::string& origin : origins)
      say_line("in neuroglancer: " + origin + "/#!" + percent_encoded(state, ":/,"));
    if (origins.empty())
      say_line(
          "no page of another site may read this; for neuroglancer, allow its page: "
          "--origin https://neuroglancer-demo.appspot.com");
    say_line("tagrid: serves this machine only; Ctrl-C ends it");
  }
};

}  // namespace

Action add_serve_command(CLI::App& app) {
  auto state = std::make_shared<ServeCommand>();
  CLI::App* command = app.add_subcommand("serve", "Give volumes as OME-Zarr to viewers on this machine");
  add_tag_inputs(*command, state->inputs, ".tag files or their addresses, not pipes");
  add_port_option(*command, state->port);
  command
      ->add_option("--origin", state->origins,
                   "Pages of this site may read the volumes, such as https://neuroglancer-demo.appspot.com; "
                   "may be given several times (default: none)")
      ->option_text("ORIGIN")
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->expected(1)
      ->allow_extra_args(false);
  add_volume_option(*command, state->volume);
  command->add_flag("-q,--quiet", state->run.quiet, "Print only addresses and errors");
  return [state](Ranks&) { state->execute(); };
}

}  // namespace tagrid
