// tagrid serve: gives .tag files to viewers on this machine, as OME-Zarr.

#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <regex>

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
    WebSite site;
    for (const std::string& origin : origins) site.origins.push_back(origin_of(origin));
    const std::string root = "/" + random_token() + "/";
    const std::vector<Image> images = open_images(root);
    std::string page;
    site.made = [&](std::string_view path) -> WebSite::Item {
      if (path == root) return {std::make_shared<BytesInMemory>(page), std::string(media_type(".html"))};
      for (const Image& image : images) {
        if (path == image.path)
          return {std::make_shared<BytesInMemory>(page), std::string(media_type(".html"))};
        if (path.starts_with(image.path))
          return {image.zarr->file(path.substr(image.path.size())), std::string(media_type(path))};
      }
      return {};
    };
    LocalSite local(port);
    const std::string machine = local.machine();
    page = page_of(images, machine, site.origins);
    for (const Image& image : images) std::cout << machine << image.path << std::endl;
    flush_standard_output();
    if (!run.quiet) tell(images, machine, site.origins);
    local.serve_until_interrupted(site);
  }

  /// What browsers send as the origin of the pages of a site: nothing follows the host and the port, and the
  /// port that the scheme has anyway is left out.
  static std::string origin_of(const std::string& given) {
    static const std::regex form(R"((https?)://([a-z0-9.-]+|\[[0-9a-f:.]+\])(:[1-9][0-9]{0,4})?)");
    std::smatch parts;
    // Names of hosts have 253 letters. The stack of a match grows with the text.
    constexpr std::size_t longest = 300;
    if (given.size() > longest || !std::regex_match(given, parts, form) ||
        (parts[3].matched && std::stoi(parts.str(3).substr(1)) > 65535))
      throw UsageError(
          "--origin {}: must be http:// or https://, a host in small letters and perhaps a port, such as "
          "https://neuroglancer-demo.appspot.com",
          given);
    const bool is_usual = parts[3] == (parts[1] == "https" ? ":443" : ":80");
    return is_usual ? given.substr(0, given.size() - parts.str(3).size()) : given;
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
        throw UsageError("{}: another file of this name is served, too; serve one of them at a time", input);
    images.push_back({name, path, std::make_unique<ServedZarr>(file, name, available_threads())});
    tell_of_losses(input, images.back().zarr->info());
    for (const std::string& why : images.back().zarr->left_out())
      warn(run, "{}: an overview is not served: {}", input, why);
  }

  void tell_of_losses(const std::string& input, const VolumeInfo& info) const {
    const Format& zarr = format_named("zarr");
    if (const std::string lost = zarr.keeps.lost_rescale(info); !lost.empty())
      warn(run, "{}: viewers show stored samples: {}", input, lost);
    for (const std::string& lost : zarr.keeps.lost(info)) warn(run, "{}: {}", input, lost);
  }

  /// The address of a viewer at `origin` that shows the images.
  static std::string neuroglancer(const std::string& origin, const std::vector<Image>& images,
                                  const std::string& machine) {
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
    return origin + "/#!" + percent_encoded(state, ":/,");
  }

  /// What a browser shows that is given one of the addresses.
  static std::string page_of(const std::vector<Image>& images, const std::string& machine,
                             const std::vector<std::string>& origins) {
    std::string page =
        "<!DOCTYPE html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>tagrid serve</title>\n"
        "<h1>Served by tagrid</h1>\n"
        "<p>These addresses are for programs that read OME-Zarr 0.5:</p>\n<ul>\n";
    for (const Image& image : images) {
      const Index3& dims = image.zarr->dims();
      page += fmt::format("<li>{}, {} x {} x {} samples, levels: {}<br><code>{}</code></li>\n",
                          html_text(image.name), dims.x, dims.y, dims.z,
                          image.zarr->facts().levels.size() + 1, html_text(machine + image.path));
    }
    page += "</ul>\n";
    for (const std::string& origin : origins)
      page += fmt::format("<p><a href=\"{}\">Show in neuroglancer at {}</a></p>\n",
                          html_text(neuroglancer(origin, images, machine)), html_text(origin));
    if (origins.empty()) page += "<p>No page of another site may read them; see <code>--origin</code>.</p>\n";
    return page + "</html>\n";
  }

  static std::string html_text(std::string_view text) {
    std::string result;
    for (const char c : text) {
      if (c == '<' || c == '>' || c == '&' || c == '"')
        result += fmt::format("&#{};", static_cast<int>(c));
      else
        result += c;
    }
    return result;
  }

  void tell(const std::vector<Image>& images, const std::string& machine,
            const std::vector<std::string>& site_origins) const {
    for (const std::string& origin : site_origins)
      say_line("in neuroglancer: " + neuroglancer(origin, images, machine));
    if (site_origins.empty())
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
                   "Pages of this site, such as https://neuroglancer-demo.appspot.com, may read the volumes; "
                   "repeatable")
      ->option_text("ORIGIN")
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->expected(1)
      ->allow_extra_args(false);
  add_volume_option(*command, state->volume);
  command->add_flag("-q,--quiet", state->run.quiet, "Print only addresses and errors");
  return [state](Ranks&) { state->execute(); };
}

}  // namespace tagrid
