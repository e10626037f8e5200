// Measures the code of the parity, with one thread, in bytes of data per second: 64 MiB, far beyond a cache.
// See docs/dev/benchmarks.md.

#include <benchmark/benchmark.h>

#include <numeric>
#include <random>
#include <vector>

#include "io/bytes/checksum.h"
#include "io/parity/parity.h"
#include "io/parity/reed_solomon.h"

namespace tagrid {
namespace {

class RandomBytes : public ByteSource {
 public:
  explicit RandomBytes(std::size_t size) : bytes_(size) {
    std::mt19937_64 random(1);
    for (std::byte& byte : bytes_) byte = static_cast<std::byte>(random());
  }
  std::uint64_t size() const override { return bytes_.size(); }
  void read_at(std::uint64_t position, std::span<std::byte> to) const override {
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(position), to.size(), to.begin());
  }
  const std::string& name() const override { return name_; }

 private:
  std::vector<std::byte> bytes_;
  std::string name_ = "random";
};

const RandomBytes& file() {
  static const RandomBytes bytes(std::size_t{64} << 20);
  return bytes;
}

/// Shares in per cent.
void shares(benchmark::internal::Benchmark* benchmark) {
  for (const int share : {1, 5, 20}) benchmark->Arg(share);
  benchmark->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
}

void set_bytes(benchmark::State& state) {
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(file().size()));
}

/// All stripes of the file in memory.
struct AllStripes {
  ParityLayout layout;
  StripeBand band;

  explicit AllStripes(ParityShare share)
      : layout(ParityLayout::of(file().size(), share)), band(layout, ~0ULL) {
    band.next();
    band.for_each_run(false, [](const BlockRun& run) {
      std::ranges::fill(run.bytes, static_cast<std::byte>(run.first + 1));
    });
  }
};

ParityShare share_of(const benchmark::State& state) {
  return static_cast<ParityShare>(1000 * state.range(0));
}

void Code(benchmark::State& state) {
  AllStripes all(share_of(state));
  const ReedSolomon code(all.layout.data(), all.layout.parity);
  for (auto _ : state) code.encode(all.band.row_starts(), all.band.row_bytes());
  set_bytes(state);
}
BENCHMARK(Code)->Apply(shares);

/// As many lost blocks in every stripe as it has parity.
void Restore(benchmark::State& state) {
  AllStripes all(share_of(state));
  const ReedSolomon code(all.layout.data(), all.layout.parity);
  std::vector<int> lost(all.layout.parity);
  std::iota(lost.begin(), lost.end(), 3);
  for (auto _ : state) code.restore(all.band.row_starts(), lost, all.band.row_bytes());
  set_bytes(state);
}
BENCHMARK(Restore)->Apply(shares);

void Checksums(benchmark::State& state) {
  AllStripes all(5000);
  for (auto _ : state)
    for (int row = 0; row < all.band.rows(); ++row)
      for (std::uint64_t i = 0; i < all.band.count(); ++i)
        benchmark::DoNotOptimize(checksum_of({all.band.block(row, i)}));
  set_bytes(state);
}
BENCHMARK(Checksums)->Unit(benchmark::kMillisecond);

/// All of it: read from memory, code, checksums, pages. What is written is forgotten.
void WriteParity(benchmark::State& state) {
  for (auto _ : state)
    write_parity(file(), share_of(state), file().size(), [](std::uint64_t, std::span<const std::byte> bytes) {
      benchmark::DoNotOptimize(bytes.data());
    });
  set_bytes(state);
}
BENCHMARK(WriteParity)->Apply(shares);

}  // namespace
}  // namespace tagrid

BENCHMARK_MAIN();
