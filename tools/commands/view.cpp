// tagrid view: shows a .tag file, or two of the same size, in a browser of this machine.

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <iostream>

#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/files/open_source.h"
#include "io/server/site.h"
#include "io/system/this_process.h"
#include "io/tag/bricks.h"
#include "io/text/addresses.h"
#include "io/text/paths.h"
#include "pipeline/materials/settings.h"
#include "tools/commands/commands.h"
#include "tools/commands/local_site.h"
#include "tools/options/material_options.h"
#include "tools/options/shared_options.h"
#include "tools/report/damage.h"
#include "tools/report/process.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// Where the page of the viewer is: beside the program, or where it is installed.
fs::path viewer_folder() {
  std::error_code unknown;
  const fs::path program = program_path().value_or("").parent_path();
  const std::array folders = {program / "viewer", program.parent_path() / "share/tagrid/viewer"};
  for (const fs::path& folder : folders)
    if (fs::exists(folder / "index.html", unknown) && fs::exists(folder / "decoder/worker.js", unknown))
      return folder;
  throw WorldError(
      "the page of the viewer is not installed (looked for in {} and {}); install the Debian package "
      "tagrid, which contains it, or make it with tools/install_packages.sh page and web/build.sh",
      text_of(folders[0]), text_of(folders[1]));
}

/// A file that cannot be shown is an error here, not in the page.
std::shared_ptr<const ByteSource> opened(const std::string& input) {
  require_tag_input(input);
  if (input == "-") throw UsageError("standard input: only a file can be viewed; save it as one first");
  std::shared_ptr<const ByteSource> file = open_source(input);
  static_cast<void>(TagBricks(file));
  return file;
}

struct ViewCommand {
  std::vector<std::string> inputs;
  int port = 0;
  bool no_browser = false, quiet = false;
  MaterialTexts colors;

  void warn_of_colors(const std::string& input) const {
    const MaterialMeshInputs labels(input, 0, colors.label_volume);
    std::vector<std::string> warnings = settle_materials(labels.samples(), material_options(colors)).warnings;
    warnings.insert(warnings.end(), labels.warnings.begin(), labels.warnings.end());
    for (const std::string& warning : warnings)
      if (!quiet) say("tagrid: warning: {}", warning);
  }

  void execute() const {
    if (inputs.size() > 2)
      throw UsageError("{}: one file can be viewed, or two that are compared", inputs[2]);
    std::vector<std::shared_ptr<const ByteSource>> files;
    for (const std::string& name : inputs) with_repair_advice(name, [&] { files.push_back(opened(name)); });
    const std::string& input = inputs.front();
    if (colors.are_given()) with_repair_advice(input, [&] { warn_of_colors(input); });

    const std::string token = random_token(), root = "/" + token + "/";
    WebSite site;
    const fs::path folder = viewer_folder();
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (!entry.is_regular_file()) continue;
      const std::string name = text_of(relative_path(entry.path(), folder));
      site.items[root + name] = {std::make_shared<FileSource>(text_of(entry.path())),
                                 std::string(media_type(name))};
    }
    site.items[root] = site.items.at(root + "index.html");
    const auto add_file = [&](const std::string& key, const std::string& place, auto bytes) {
      site.items[root + place] = {std::move(bytes), "application/octet-stream"};
      site.entrance += key + percent_encoded(place);
    };
    add_file(root + "?src=", "file/" + percent_encoded(name_of_input(input)), files.front());
    if (files.size() == 2)
      add_file("&compare=", "second/" + percent_encoded(name_of_input(inputs[1])), files[1]);
    if (!colors.label_volume.empty())
      add_file("&label-volume=", "labels/" + percent_encoded(name_of_input(colors.label_volume)),
               open_source(colors.label_volume));
    if (!colors.materials.empty()) site.entrance += "&materials=" + percent_encoded(colors.materials);
    if (colors.labels == "all" || colors.labels.find('=') != std::string::npos)
      site.entrance += "&labels=" + percent_encoded(colors.labels);
    else if (!colors.labels.empty())
      add_file("&labels=", "names", std::make_shared<FileSource>(colors.labels));
    site.ticket = "/" + random_token();

    LocalSite local(port);
    std::cout << local.machine() << site.entrance << std::endl;
    flush_standard_output();
    const std::string ticket = local.machine() + site.ticket;
    if (const std::string why = no_browser ? "" : local.signals().open_in_browser(ticket); !why.empty())
      say_line(fmt::format("tagrid: no browser was opened, because {}; open the address above", why));
    if (!quiet) say_line("tagrid: serves this machine only; Ctrl-C ends it");
    local.serve_until_interrupted(site);
  }
};

}  // namespace

Action add_view_command(CLI::App& app) {
  auto state = std::make_shared<ViewCommand>();
  CLI::App* command = app.add_subcommand("view", "Show the slices in a browser on this machine");
  add_tag_inputs(*command, state->inputs, ".tag file or its address, not a pipe; a second one is compared");
  add_port_option(*command, state->port);
  add_text_option(*command, "--materials", state->colors.materials, "NAME=LOW:HIGH,...",
                  "Materials by ranges of values");
  add_text_option(*command, "--labels", state->colors.labels, "NAMES",
                  "The samples are labels of materials: LABEL=NAME,..., a file of names, or all");
  add_text_option(*command, "--label-volume", state->colors.label_volume, "FILE",
                  "A .tag file with the labels of the volume");
  command->add_flag("--no-browser", state->no_browser, "Only print the address");
  command->add_flag("-q,--quiet", state->quiet, "Print only addresses and errors");
  return [state](Ranks&) { state->execute(); };
}

}  // namespace tagrid
