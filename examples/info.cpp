// Prints the description of a .tag file, its largest brick, and the number of tetrahedra in its grid.
//
//     info scan.tag
#include <algorithm>
#include <cstdio>
#include <exception>
#include <tagrid/tagrid.hpp>

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: info FILE\n");
    return 2;
  }
  // Every call may throw tagrid::Error, which has a message and a status.
  try {
    const tagrid::Reader reader(argv[1]);
    const tagrid_info info = reader.info();
    std::printf("libtagrid %s\n", tagrid_version());
    std::printf("%lld x %lld x %lld samples of %zu bytes\n", static_cast<long long>(info.dims[0]),
                static_cast<long long>(info.dims[1]), static_cast<long long>(info.dims[2]),
                tagrid_sample_size(info.type));
    std::printf("%llu bytes, largest error %g, psnr %g dB\n",
                static_cast<unsigned long long>(info.file_bytes), info.achieved_max_error,
                info.achieved_psnr);

    tagrid_brick largest = reader.brick(0);
    for (std::int64_t i = 1; i < info.bricks[0] * info.bricks[1] * info.bricks[2]; ++i)
      if (const tagrid_brick brick = reader.brick(i); brick.bytes > largest.bytes) largest = brick;
    std::printf("the largest brick has %llu bytes and begins at (%lld, %lld, %lld)\n",
                static_cast<unsigned long long>(largest.bytes), static_cast<long long>(largest.box.low[0]),
                static_cast<long long>(largest.box.low[1]), static_cast<long long>(largest.box.low[2]));

    if (info.type == TAGRID_INT16 && std::min({info.dims[0], info.dims[1], info.dims[2]}) > 1)
      std::printf("%zu tetrahedra\n", reader.mesh<std::int16_t>().levels.size());
    reader.verify();
    std::printf("verified\n");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "info: %s\n", error.what());
    return 1;
  }
  return 0;
}
