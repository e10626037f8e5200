// What the benchmark does with samples outside of what it measures: their range, forms that other codecs
// take, and the error of what came back. TYPE is uint8, int8, uint16 or int16; samples are little endian, x
// fastest.
//
// It shares no code with tagrid: it is the judge.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

constexpr std::size_t piece = std::size_t{1} << 18;
using Arguments = std::vector<std::string>;

std::ifstream open_input(const std::string& name) {
  std::ifstream file(name, std::ios::binary);
  if (!file) throw std::runtime_error(name + ": cannot open");
  return file;
}

std::ofstream open_output(const std::string& name) {
  std::ofstream file(name, std::ios::binary);
  if (!file) throw std::runtime_error(name + ": cannot create");
  return file;
}

template <class T>
void write(std::ofstream& file, const std::vector<T>& values, const std::string& name) {
  file.write(reinterpret_cast<const char*>(values.data()),
             static_cast<std::streamsize>(values.size() * sizeof(T)));
  if (!file.flush()) throw std::runtime_error(name + ": cannot write");
}

/// The next values of a file, at most `count`.
template <class T>
std::vector<T> read(std::ifstream& file, std::size_t count, const std::string& name) {
  std::vector<T> values(count);
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(count * sizeof(T)));
  const auto bytes = static_cast<std::size_t>(file.gcount());
  if (bytes % sizeof(T) != 0) throw std::runtime_error(name + ": ends inside a sample");
  values.resize(bytes / sizeof(T));
  return values;
}

template <class From, class To>
void convert(const std::string& from, const std::string& to, const std::function<To(From)>& function) {
  std::ifstream in = open_input(from);
  std::ofstream out = open_output(to);
  for (std::vector<From> values; !(values = read<From>(in, piece, from)).empty();) {
    std::vector<To> converted(values.size());
    std::transform(values.begin(), values.end(), converted.begin(), function);
    write(out, converted, to);
  }
}

/// range TYPE FILE: smallest and largest sample.
template <class T>
void range(const Arguments& a) {
  std::ifstream in = open_input(a.at(0));
  T low = std::numeric_limits<T>::max(), high = std::numeric_limits<T>::min();
  for (std::vector<T> values; !(values = read<T>(in, piece, a.at(0))).empty();) {
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    low = std::min(low, *least);
    high = std::max(high, *most);
  }
  fmt::print("{} {}\n", static_cast<int>(low), static_cast<int>(high));
}

/// to-float TYPE FILE OUTPUT
template <class T>
void to_float(const Arguments& a) {
  convert<T, float>(a.at(0), a.at(1), [](T value) { return static_cast<float>(value); });
}

/// from-float TYPE FILE OUTPUT: rounded to the nearest value of the type.
template <class T>
void from_float(const Arguments& a) {
  convert<float, T>(a.at(0), a.at(1), [](float value) {
    const float low = std::numeric_limits<T>::min(), high = std::numeric_limits<T>::max();
    return static_cast<T>(std::lrint(std::clamp(value, low, high)));
  });
}

std::string slice_name(const std::string& folder, long slice) {
  return fmt::format("{}/{:05}.pgm", folder, slice);
}

/// to-pgm TYPE FILE FOLDER WIDTH HEIGHT LOW HIGH: writes slices, with LOW as 0. They have 8 bits if HIGH -
/// LOW fits, otherwise 16.
template <class T>
void to_pgm(const Arguments& a) {
  std::ifstream in = open_input(a.at(0));
  const long width = std::stol(a.at(2)), height = std::stol(a.at(3)), low = std::stol(a.at(4));
  const bool narrow = std::stol(a.at(5)) - low < 256;
  const auto count = static_cast<std::size_t>(width * height);
  long slice = 0;
  for (std::vector<T> values; (values = read<T>(in, count, a.at(0))).size() == count; ++slice) {
    std::vector<std::uint8_t> bytes;
    for (const T value : values) {
      const auto level = static_cast<std::uint16_t>(value - low);
      if (!narrow) bytes.push_back(static_cast<std::uint8_t>(level >> 8));
      bytes.push_back(static_cast<std::uint8_t>(level));
    }
    std::ofstream out = open_output(slice_name(a.at(1), slice));
    out << fmt::format("P5\n{} {}\n{}\n", width, height, narrow ? 255 : 65535);
    write(out, bytes, a.at(1));
  }
}

/// from-pgm TYPE FOLDER OUTPUT LOW: the inverse.
template <class T>
void from_pgm(const Arguments& a) {
  std::ofstream out = open_output(a.at(1));
  const long low = std::stol(a.at(2));
  for (long slice = 0; std::ifstream(slice_name(a.at(0), slice)); ++slice) {
    const std::string name = slice_name(a.at(0), slice);
    std::ifstream in = open_input(name);
    std::string magic;
    std::size_t width = 0, height = 0, most = 0;
    in >> magic >> width >> height >> most;
    in.get();
    if (!in || magic != "P5") throw std::runtime_error(name + ": not a PGM file");
    const std::size_t width_of_sample = most < 256 ? 1 : 2, count = width * height;
    const auto bytes = read<std::uint8_t>(in, count * width_of_sample, name);
    if (bytes.size() != count * width_of_sample) throw std::runtime_error(name + ": ends too soon");
    std::vector<T> values(count);
    for (std::size_t i = 0; i < count; ++i)
      values[i] =
          static_cast<T>(low + (width_of_sample == 1 ? bytes[i] : bytes[2 * i] * 256 + bytes[2 * i + 1]));
    write(out, values, a.at(1));
  }
}

/// compare TYPE FILE FILE: largest absolute error and root mean square, as JSON.
template <class T>
void compare(const Arguments& a) {
  std::ifstream first = open_input(a.at(0)), second = open_input(a.at(1));
  long largest = 0;
  std::uint64_t squares = 0, count = 0;
  for (;;) {
    const std::vector<T> x = read<T>(first, piece, a.at(0)), y = read<T>(second, piece, a.at(1));
    if (x.size() != y.size()) throw std::runtime_error(a.at(0) + " and " + a.at(1) + " differ in size");
    if (x.empty()) break;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const long error = std::abs(long{x[i]} - long{y[i]});
      largest = std::max(largest, error);
      squares += static_cast<std::uint64_t>(error * error);
    }
    count += x.size();
  }
  const double mean = count ? static_cast<double>(squares) / static_cast<double>(count) : 0;
  fmt::print("{{\"max_error\": {}, \"rmse\": {:.9g}}}\n", largest, std::sqrt(mean));
}

template <class T>
void run(const std::string& what, const Arguments& arguments) {
  const std::map<std::string, void (*)(const Arguments&)> functions = {
      {"range", range<T>},   {"to-float", to_float<T>}, {"from-float", from_float<T>},
      {"to-pgm", to_pgm<T>}, {"from-pgm", from_pgm<T>}, {"compare", compare<T>}};
  functions.at(what)(arguments);
}

}  // namespace

int main(int count, char** values) {
  try {
    Arguments arguments(values + 1, values + count);
    const std::string what = arguments.at(0), type = arguments.at(1);
    arguments.erase(arguments.begin(), arguments.begin() + 2);
    const std::map<std::string, void (*)(const std::string&, const Arguments&)> types = {
        {"uint8", run<std::uint8_t>},
        {"int8", run<std::int8_t>},
        {"uint16", run<std::uint16_t>},
        {"int16", run<std::int16_t>}};
    types.at(type)(what, arguments);
  } catch (const std::out_of_range&) {
    fmt::print(stderr,
               "usage: bench_samples range|to-float|from-float|to-pgm|from-pgm|compare TYPE ARGUMENTS, see "
               "the source\n");
    return 64;
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_samples: {}\n", error.what());
    return 74;
  }
}
