// JPEG-LS, slice by slice, for the benchmark: CharLS is a library only.
//   bench_jpegls encode TYPE WIDTH HEIGHT LOW HIGH NEAR INPUT OUTPUT
//   bench_jpegls decode TYPE WIDTH HEIGHT LOW INPUT OUTPUT
//   bench_jpegls version
// Samples are little endian, x fastest, all of them in LOW .. HIGH, which become 0 .. HIGH - LOW: JPEG-LS has
// no signed samples. The output is the slices one after the other, each after its size in bytes (4 of them).

#include <charls/charls.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using Arguments = std::vector<std::string>;

struct Files {
  std::ifstream in;
  std::ofstream out;

  Files(const std::string& input, const std::string& output)
      : in(input, std::ios::binary), out(output, std::ios::binary) {
    if (!in) throw std::runtime_error(input + ": cannot open");
    if (!out) throw std::runtime_error(output + ": cannot create");
  }
  /// False at the end of the input.
  bool read(void* bytes, std::size_t size) {
    in.read(static_cast<char*>(bytes), static_cast<std::streamsize>(size));
    return static_cast<std::size_t>(in.gcount()) == size;
  }
  void write(const void* bytes, std::size_t size) {
    if (!out.write(static_cast<const char*>(bytes), static_cast<std::streamsize>(size)))
      throw std::runtime_error("cannot write");
  }
};

/// T: the type of the samples; Level: unsigned, as CharLS gets them.
template <class T, class Level>
void encode(Files& files, charls::frame_info frame, int low, int near) {
  const std::size_t count = std::size_t{frame.width} * frame.height;
  std::vector<T> slice(count);
  std::vector<Level> levels(count);
  std::vector<std::uint8_t> bytes;
  while (files.read(slice.data(), count * sizeof(T))) {
    std::transform(slice.begin(), slice.end(), levels.begin(),
                   [low](T v) { return static_cast<Level>(v - low); });
    charls::jpegls_encoder encoder;
    encoder.frame_info(frame).near_lossless(near);
    bytes.resize(encoder.estimated_destination_size());
    encoder.destination(bytes);
    const auto size = static_cast<std::uint32_t>(encoder.encode(levels));
    files.write(&size, sizeof size);
    files.write(bytes.data(), size);
  }
}

template <class T, class Level>
void decode(Files& files, std::size_t count, int low) {
  std::vector<T> slice(count);
  std::vector<Level> levels(count);
  std::vector<std::uint8_t> bytes;
  for (std::uint32_t size = 0; files.read(&size, sizeof size);) {
    bytes.resize(size);
    if (!files.read(bytes.data(), size)) throw std::runtime_error("the input ends too soon");
    charls::jpegls_decoder decoder(bytes, true);
    decoder.decode(levels);
    std::transform(levels.begin(), levels.end(), slice.begin(),
                   [low](Level v) { return static_cast<T>(v + low); });
    files.write(slice.data(), count * sizeof(T));
  }
}

template <class T>
void encode_volume(const Arguments& a) {
  const int low = std::stoi(a.at(4)), span = std::stoi(a.at(5)) - low;
  const int bits = std::max(2, static_cast<int>(std::bit_width(static_cast<unsigned>(span))));
  const charls::frame_info frame{static_cast<std::uint32_t>(std::stoul(a.at(2))),
                                 static_cast<std::uint32_t>(std::stoul(a.at(3))), bits, 1};
  Files files(a.at(7), a.at(8));
  bits <= 8 ? encode<T, std::uint8_t>(files, frame, low, std::stoi(a.at(6)))
            : encode<T, std::uint16_t>(files, frame, low, std::stoi(a.at(6)));
}

/// How many bytes a level has is in the JPEG-LS header of the first slice.
template <class T>
void decode_volume(const Arguments& a) {
  Files files(a.at(5), a.at(6));
  const std::size_t count = std::stoul(a.at(2)) * std::stoul(a.at(3));
  std::uint32_t size = 0;
  if (!files.read(&size, sizeof size)) throw std::runtime_error("the input is empty");
  std::vector<std::uint8_t> bytes(size);
  if (!files.read(bytes.data(), size)) throw std::runtime_error("the input ends too soon");
  const charls::jpegls_decoder first(bytes, true);
  files.in.seekg(0);
  const int low = std::stoi(a.at(4));
  first.frame_info().bits_per_sample <= 8 ? decode<T, std::uint8_t>(files, count, low)
                                          : decode<T, std::uint16_t>(files, count, low);
}

template <class T>
void run(const Arguments& a) {
  a.at(0) == "encode" ? encode_volume<T>(a) : decode_volume<T>(a);
}

}  // namespace

int main(int count, char** values) {
  try {
    const Arguments arguments(values + 1, values + count);
    if (arguments.at(0) == "version") {
      fmt::print("{}\n", charls_get_version_string());
      return 0;
    }
    const std::string& type = arguments.at(1);
    if (type == "uint8") run<std::uint8_t>(arguments);
    if (type == "int8") run<std::int8_t>(arguments);
    if (type == "uint16") run<std::uint16_t>(arguments);
    if (type == "int16") run<std::int16_t>(arguments);
  } catch (const std::out_of_range&) {
    fmt::print(stderr, "usage: bench_jpegls encode|decode ARGUMENTS, see the source\n");
    return 64;
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_jpegls: {}\n", error.what());
    return 74;
  }
}
