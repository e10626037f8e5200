// make_fuzz_seeds GOLDEN FOLDER: writes the seeds of every target to FOLDER/<target>/.
#include <filesystem>
#include <fstream>
#include <iostream>

#include "tests/fuzz/seeds.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: make_fuzz_seeds GOLDEN FOLDER\n";
    return 64;
  }
  for (const auto& [target, seeds] : tagrid::fuzz::make_seeds(argv[1])) {
    const std::filesystem::path folder = std::filesystem::path(argv[2]) / target;
    std::filesystem::create_directories(folder);
    int number = 0;
    for (const auto& seed : seeds)
      std::ofstream(folder / ("seed" + std::to_string(number++)), std::ios::binary)
          .write(reinterpret_cast<const char*>(seed.data()), static_cast<std::streamsize>(seed.size()));
  }
}
