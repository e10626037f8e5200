// The table of the commands: who adds each of them, and two examples for the end of its help.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "io/text/text.h"
#include "tools/commands/commands.h"
#include "tools/options/command_line.h"

namespace tagrid {
namespace {

struct Row {
  std::string name;  ///< "": the program itself
  Action (*add)(CLI::App&);
  std::array<Example, 2> examples;
};

// A command line has at most 76 characters, so that help fits 80 columns.
const std::vector<Row>& rows() {
  static const std::vector<Row> all = {
      {"",
       nullptr,
       {{{"Encode a volume, every voxel within half the noise",
          "tagrid encode scan.nhdr --max-error noise:0.5"},
         {"Decode it", "tagrid decode scan.tag -o scan.nrrd"}}}},
      {"encode",
       add_encode_command,
       {{{"Without loss, to scan.tag", "tagrid encode scan.nhdr"},
         {"A directory of TIFF slices, every voxel within half the noise",
          "tagrid encode slices/ --max-error noise:0.5 --spacing 10um -o bone.tag"}}}},
      {"decode",
       add_decode_command,
       {{{"To scan.nrrd", "tagrid decode scan.tag"},
         {"One slice, as TIFF", "tagrid decode scan.tag --region :,:,20:21 -o slice.tif"}}}},
      {"info",
       add_info_command,
       {{{"Sizes, errors and levels", "tagrid info scan.tag"},
         {"For scripts, without the levels", "tagrid info scan.tag --json --no-levels"}}}},
      {"verify",
       add_verify_command,
       {{{"Check that the file is intact", "tagrid verify scan.tag"},
         {"Compare it with its original", "tagrid verify scan.tag --against scan.nhdr"}}}},
      {"restore",
       add_restore_command,
       {{{"The original files, in the directory originals", "tagrid restore scan.tag -o originals"},
         {"All originals that convert removed from an archive", "tagrid restore --records tags"}}}},
      {"mesh",
       add_mesh_command,
       {{{"A coarse mesh, to look at in ParaView", "tagrid mesh scan.tag --level 9 -o scan.vtu"},
         {"Soft tissue and bone, for CalculiX and Abaqus",
          "tagrid mesh scan.tag --materials soft=-200:300,bone=300: -o scan.inp"}}}},
      {"surface",
       add_surface_command,
       {{{"The surface where the value is 300.5", "tagrid surface scan.tag --iso 300.5 -o bone.ply"},
         {"Closed at the border of the volume, for a printer",
          "tagrid surface scan.tag --iso 300.5 --close -o bone.stl"}}}},
      {"preview",
       add_preview_command,
       {{{"To scan.png", "tagrid preview scan.tag"},
         {"Slice 20 along z, from black at 0 to white at 1000",
          "tagrid preview scan.tag --slice z=20 --window 0:1000 -o bone.png"}}}},
      {"view",
       add_view_command,
       {{{"Open the viewer in a browser", "tagrid view scan.tag"},
         {"Through a tunnel of ssh: only print the address",
          "tagrid view scan.tag --port 8080 --no-browser"}}}},
      {"serve",
       add_serve_command,
       {{{"For napari, Fiji and other programs on this machine", "tagrid serve scan.tag"},
         {"For a page that shows OME-Zarr",
          "tagrid serve scan.tag --origin https://neuroglancer-demo.appspot.com"}}}},
      {"convert",
       add_convert_command,
       {{{"List the volumes below a directory", "tagrid convert --find scans > list.tsv"},
         {"Encode those that are not done yet",
          "tagrid convert --manifest list.tsv --output-dir tags --skip-done"}}}},
      {"archive list",
       add_archive_list_command,
       {{{"What is in an archive", "tagrid archive list tags"},
         {"For scripts", "tagrid archive list tags --json"}}}},
      {"archive find",
       add_archive_find_command,
       {{{"The scans of a patient since 2020",
          "tagrid archive find tags 'patient=Smith*' 'study_date>=2020'"},
         {"Volumes that could not be encoded, with the reasons", "tagrid archive find tags status=failed"}}}},
      {"archive check",
       add_archive_check_command,
       {{{"All volumes", "tagrid archive check tags"},
         {"Every night: those that were not checked for the longest time",
          "tagrid archive check tags --older-than 90d --budget 2h"}}}},
      {"archive repair",
       add_archive_repair_command,
       {{{"What the last check found damaged", "tagrid archive repair tags"},
         {"One volume", "tagrid archive repair tags 2019/knee.tag"}}}},
      {"archive restore",
       add_archive_restore_command,
       {{{"The originals of a patient", "tagrid archive restore tags 'patient=Smith*' -o originals"},
         {"Of one volume", "tagrid archive restore tags 2019/knee.tag -o originals"}}}},
      {"archive export",
       add_archive_export_command,
       {{{"CT scans as NIfTI", "tagrid archive export tags modality=CT --format nifti -o exported"},
         {"Small overviews of all volumes, as NRRD",
          "tagrid archive export tags 'name=*' --step 4 --format nrrd -o small"}}}},
      {"archive forget",
       add_archive_forget_command,
       {{{"All scans of a patient", "tagrid archive forget tags patient_id=4711"},
         {"Records of outputs that are gone, in a script",
          "tagrid archive forget tags status=missing --yes"}}}},
      {"archive move",
       add_archive_move_command,
       {{{"Originals are on another disk now", "tagrid archive move tags --from /scans --to /mnt/scans"},
         {"They were renamed", "tagrid archive move tags --from /data/2019 --to /data/old"}}}},
      {"estimate",
       add_estimate_command,
       {{{"Sizes for bounds around the noise", "tagrid estimate scan.nhdr"},
         {"Sizes for these bounds, and for a PSNR of 45 dB",
          "tagrid estimate scan.nhdr --errors 0,2,5 --psnr 45"}}}},
      {"formats",
       add_formats_command,
       {{{"What can be read and written on this machine", "tagrid formats"},
         {"For scripts", "tagrid formats --json"}}}},
      {"phantom",
       add_phantom_command,
       {{{"A volume to try the commands with", "tagrid phantom --dims 512,512,300 -o scan.nhdr"},
         {"Another one, of other samples",
          "tagrid phantom --dims 96,96,48 --type uint8 --seed 2 -o other.nrrd"}}}},
      {"repair",
       add_repair_command,
       {{{"Rebuild what is damaged, in a new file", "tagrid repair damaged.tag -o repaired.tag"},
         {"In at most 500 MB of memory", "tagrid repair damaged.tag -o repaired.tag -M 500M"}}}},
      {"protect",
       add_protect_command,
       {{{"Add parity, 5 % of the size of the file", "tagrid protect scan.tag --parity 5%"},
         {"Write it to scan.tag.parity instead", "tagrid protect scan.tag --parity 5% --beside"}}}},
  };
  return all;
}

std::string in_help(const std::array<Example, 2>& examples) {
  std::string text = "Examples:";
  for (const Example& example : examples) text += fmt::format("\n  {}:\n    {}", example.wish, example.line);
  return text;
}

}  // namespace

std::array<Example, 2> examples_of(const std::string& command) {
  return std::ranges::find(rows(), command, &Row::name)->examples;
}

std::vector<std::pair<CLI::App*, Action>> add_commands(CLI::App& app, const std::string& version) {
  app.set_version_flag("-V,--version", version, "Print the version and exit");
  app.require_subcommand(1);
  lay_out_help(app);
  app.set_help_flag("-h,--help", "Print this help and exit");
  app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  std::vector<std::pair<CLI::App*, Action>> commands;
  for (const Row& row : rows()) {
    if (row.add == nullptr) {
      app.footer(in_help(row.examples));
      continue;
    }
    Action action = row.add(app);
    CLI::App* command = &app;
    for (const std::string_view word : words_of(row.name))
      command = command->get_subcommand(std::string(word));
    command->group("Commands");
    if (command->get_parent() != &app) command->get_parent()->group("Commands")->footer("");
    command->footer(in_help(row.examples));
    commands.emplace_back(command, std::move(action));
  }
  return commands;
}

}  // namespace tagrid
