// A reader of the .vtu files that VtuFile writes, array by array.
#pragma once

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace tagrid {

/// The name of a type of numbers in files of VTK.
template <class T>
const char* vtk_type() {
  constexpr bool real = std::is_floating_point_v<T>;
  if (real) return sizeof(T) == 4 ? "Float32" : "Float64";
  if (sizeof(T) == 1) return std::is_signed_v<T> ? "Int8" : "UInt8";
  if (sizeof(T) == 2) return std::is_signed_v<T> ? "Int16" : "UInt16";
  return std::is_signed_v<T> ? "Int32" : "UInt32";
}

class Vtu {
 public:
  explicit Vtu(const std::string& path) : file_(path, std::ios::binary) {
    constexpr std::string_view mark = "<AppendedData encoding=\"raw\">\n_";
    for (char c; !xml.ends_with(mark) && file_.get(c);) xml += c;
    if (!xml.ends_with(mark)) throw std::runtime_error(path + ": no appended data");
    appended_ = static_cast<std::uint64_t>(file_.tellg());
    file_.seekg(0, std::ios::end);
    size_ = static_cast<std::uint64_t>(file_.tellg());
  }

  /// The number in the first attribute="..." at or after `from`.
  std::uint64_t number(const std::string& attribute, std::size_t from = 0) const {
    const std::size_t at = xml.find(attribute + "=\"", from);
    if (at == std::string::npos) throw std::runtime_error("no attribute " + attribute);
    return std::stoull(xml.substr(at + attribute.size() + 2));
  }

  template <class T>
  std::vector<T> array(const std::string& type, const std::string& name) {
    const std::size_t line = xml.find("<DataArray type=\"" + type + "\" Name=\"" + name + "\"");
    if (line == std::string::npos) throw std::runtime_error("no array " + name + " of " + type);
    const std::uint64_t begin = appended_ + number("offset", line);
    std::uint64_t bytes = 0;
    read(begin, &bytes, 8);
    if (bytes > size_ || begin + 8 + bytes > size_) throw std::runtime_error("array too long: " + name);
    std::vector<T> numbers(bytes / sizeof(T));
    read(begin + 8, numbers.data(), bytes);
    end_ = std::max(end_, begin + 8 + bytes);
    return numbers;
  }

  /// Everything after the last array that was read.
  std::string rest() {
    std::string bytes(size_ - end_, ' ');
    read(end_, bytes.data(), bytes.size());
    return bytes;
  }

  std::string xml;  ///< up to the arrays

 private:
  void read(std::uint64_t at, void* to, std::uint64_t bytes) {
    file_.seekg(static_cast<std::streamoff>(at));
    if (!file_.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes)))
      throw std::runtime_error("too short");
  }

  std::ifstream file_;
  std::uint64_t appended_ = 0, size_ = 0, end_ = 0;
};

}  // namespace tagrid
