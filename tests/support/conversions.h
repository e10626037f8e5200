// A directory with volumes and a list of them for `convert`.
#pragma once

#include <xxhash.h>

#include <array>
#include <cstdio>
#include <sstream>

#include "tests/support/command_line.h"

namespace tagrid {

template <class Base>
class Conversions : public Base {
 protected:
  using typename CommandLine::Arguments;
  using Json = nlohmann::json;

  /// One small volume, different for every seed.
  void volume(const std::string& name, int seed, const Arguments& more = {}) const {
    Arguments arguments = {"phantom", "--dims", "21,18,13", "--seed", std::to_string(seed), "-qfo", name};
    arguments.insert(arguments.end(), more.begin(), more.end());
    this->expect_ok(this->tagrid(arguments));
  }
  /// a.nrrd, b.nrrd ..., and list.tsv of them.
  void volumes(int count) const {
    std::string list;
    for (int i = 0; i < count; ++i) {
      const std::string name = std::string(1, static_cast<char>('a' + i)) + ".nrrd";
      volume(name, i + 1);
      list += name + "\n";
    }
    this->file("list.tsv", list);
  }

  static inline const Arguments command_ = {"convert", "--manifest", "list.tsv", "--output-dir", "out"};
  Ending convert(const Arguments& more = {}) const { return this->tagrid(this->with(command_, more)); }

  /// The same volumes, and their outputs.
  void converted(int count, const Arguments& more = {}) const {
    volumes(count);
    this->expect_ok(convert(more));
  }

  /// Expects that volumes failed or were kept, and a message that contains `what`.
  static void expect_failed(const Ending& ending, std::string_view what) {
    EXPECT_EQ(ending.code, broken_input);
    EXPECT_TRUE(has(ending.err, what));
  }

  std::vector<Json> records(const std::string& name = "out/results.jsonl") const {
    std::vector<Json> records;
    std::istringstream lines(this->content(name));
    for (std::string line; std::getline(lines, line);) records.push_back(Json::parse(line));
    return records;
  }
  /// "a ok, b failed": of the last `count` records, or of all.
  std::string statuses(std::size_t count = 1000, const std::string& name = "out/results.jsonl") const {
    std::string text;
    const std::vector<Json> all = records(name);
    for (std::size_t i = all.size() - std::min(count, all.size()); i < all.size(); ++i) {
      const auto output = all[i]["output"].template get<std::string>();
      text += (text.empty() ? "" : ", ") + output.substr(0, output.size() - 4) + " " +
              all[i]["status"].template get<std::string>();
    }
    return text;
  }
  Json last() const { return records().back(); }
  std::string error_of_last() const { return last()["error"].template get<std::string>(); }

  std::vector<std::string> outputs() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(this->path("out")))
      if (entry.path().extension() != ".jsonl") names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }
  bool exists(const std::string& name) const { return std::filesystem::exists(this->path(name)); }

  static std::string checksum(const std::string& bytes) {
    std::array<char, 17> text = {};
    std::snprintf(text.data(), text.size(), "%016llx",
                  static_cast<unsigned long long>(XXH3_64bits(bytes.data(), bytes.size())));
    return text.data();
  }

  /// Changes the last byte but one, and keeps size and time.
  void damage(const std::string& name) const {
    const auto time = std::filesystem::last_write_time(this->path(name));
    std::string bytes = this->content(name);
    bytes[bytes.size() - 2] = static_cast<char>(bytes[bytes.size() - 2] ^ 1);
    this->file(name, bytes);
    std::filesystem::last_write_time(this->path(name), time);
  }
};

}  // namespace tagrid
