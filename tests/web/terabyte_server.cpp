// Serves a made-up volume of a terabyte on 127.0.0.1, as /scan.tag, until its standard input ends. Prints the port.
//   terabyte_server FILE.tag     a phantom of 256^3 int16 samples with the overview 4, from which it takes bricks
#include <exception>
#include <iostream>
#include <memory>

#include "io/files/file_bytes.h"
#include "io/tag/bricks.h"
#include "pipeline/job/options.h"
#include "pipeline/overview/header.h"
#include "pipeline/serving/serve.h"
#include "tests/support/repeated_tag.h"

int main(int, char** arguments) {
  using namespace tagrid;
  try {
    const TagBricks file(std::make_shared<FileSource>(arguments[1]));
    const BrickBytes samples = file.read(file.parameters().bricks().id({1, 1, 1}));
    const BrickBytes means = file.nested(file.index().members.at(0))->read(0);
    TagHeader header = file.header();
    header.parameters.dims = {8192, 8192, 8192};
    std::vector<RepeatedTag::Overview> overviews;
    for (const int factor : factors_for(header.parameters.dims)) {
      // Views of slices do not need the finest one, which would take long to make.
      const BrickBytes one = factor == 4 ? BrickBytes{0, {}, {0, 5, 0}} : means;
      overviews.push_back({static_cast<std::uint32_t>(factor),
                           file_of_equal_bricks(overview_header(header, factor, {}), one)});
    }
    WebSite site;
    site.items["/scan.tag"] = {std::make_shared<RepeatedTag>(header, samples, overviews),
                               "application/octet-stream"};
    const LocalPort port = open_port(0);
    std::cout << port.number << ' ' << site.items.at("/scan.tag").bytes->size() << std::endl;
    serve(port, site, 0, [] {});
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
