#include "io/formats/hdf5/reader/datasets.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>

#include "io/formats/hdf5/attributes.h"
#include "io/formats/hdf5/description.h"
#include "io/formats/hdf5/reader/conventions.h"
#include "io/formats/hdf5/reader/geometry.h"
#include "io/formats/hdf5/reader/links.h"
#include "io/formats/hdf5/reader/nexus.h"
#include "io/programs/serve_reader.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {

BrokenInput broken_hdf5(const std::string& path, std::string_view why) {
  return BrokenInput("{}: HDF5 file: {}", path, why);
}

std::string file_of(hid_t dataset) {
  const ssize_t size = H5Fget_name(dataset, nullptr, 0);
  if (size <= 0) return "";
  std::string name(static_cast<std::size_t>(size), '\0');
  H5Fget_name(dataset, name.data(), name.size() + 1);
  return name;
}

bool is_in_folder_of(const std::string& path, hid_t dataset) {
  const std::string other = file_of(dataset);
  if (other.empty() || other == path) return true;
  const auto folder = [](const std::string& file) {
    return real_path_if_known(absolute_path(path_of(file)).parent_path());
  };
  return folder(other) == folder(path);
}

bool has_own_samples(const std::string& path, hid_t dataset) {
  const Hdf5Handle properties(H5Dget_create_plist(dataset), H5Pclose);
  return properties && H5Pget_external_count(properties.get()) == 0 &&
         H5Pget_layout(properties.get()) != H5D_VIRTUAL && is_in_folder_of(path, dataset);
}

std::vector<hsize_t> dims_of(hid_t dataset) {
  const Hdf5Handle space = space_of(dataset);
  const int rank = space ? H5Sget_simple_extent_ndims(space.get()) : -1;
  if (rank < 1) return {};
  std::vector<hsize_t> dims(static_cast<std::size_t>(rank));
  H5Sget_simple_extent_dims(space.get(), dims.data(), nullptr);
  return dims;
}

std::optional<Index3> volume_size(const std::vector<hsize_t>& dims) {
  std::array<std::int64_t, 3> sizes = {1, 1, 1};  // z, y, x
  for (std::size_t i = 0; i < dims.size(); ++i) {
    const std::size_t from_end = dims.size() - 1 - i;
    if (from_end > 2 ? dims[i] != 1 : dims[i] < 1 || dims[i] > std::uint64_t{1} << 40) return std::nullopt;
    if (from_end <= 2) sizes[2 - from_end] = static_cast<std::int64_t>(dims[i]);
  }
  if (dims.size() < 2) return std::nullopt;
  return Index3{sizes[2], sizes[1], sizes[0]};
}

std::string in_words(const std::vector<hsize_t>& dims) {
  if (dims.empty()) return "no axes of";
  std::string words;
  for (std::size_t i = dims.size(); i > 0; --i)
    words += fmt::format("{}{}", words.empty() ? "" : " x ", dims[i - 1]);
  return words;
}

Hdf5Handle opened_dataset(hid_t file, const std::string& name) {
  if (!has_object(file, name)) return {};
  Hdf5Handle object = object_at(file, name);
  return H5Iget_type(object.get()) == H5I_DATASET ? std::move(object) : Hdf5Handle();
}

// Which data set of a file is meant.

namespace {

/// A data set of numbers that can be a volume.
struct Candidate {
  std::string name, text;
  bool is_signal = false;
};

/// Other things that a message names: the first ones, as a file may have millions.
class ShortList {
 public:
  void add(const std::string& text) {
    if (++count_ <= most_named) text_ += (text_.empty() ? "" : ", ") + text;
  }
  bool empty() const { return count_ == 0; }
  bool is_full() const { return count_ >= most_named; }
  std::string text() const {
    return count_ <= most_named ? text_ : fmt::format("{} and {} more", text_, count_ - most_named);
  }

 private:
  static constexpr std::size_t most_named = 3;
  std::size_t count_ = 0;
  std::string text_;
};

/// A picture of two axes is no volume, unless the file says that it is one.
bool is_slice(hid_t dataset, const std::string& name, std::size_t rank) {
  return rank > 2 || is_vtkhdf_array(name) || H5Aexists(dataset, hdf5_header_attribute) > 0;
}

/// Everything in a file that could be meant.
class Candidates : private Visitor {
 public:
  explicit Candidates(hid_t file) : file_(file) {
    visit_objects(file, *this);
    for (const std::string& signal : signals_) look_at_signal(file, signal);
  }

  /// Those with several slices; without any, those with one.
  std::vector<Candidate>& list() { return volumes_.empty() ? slices_ : volumes_; }
  /// Data sets with several axes that cannot be volumes.
  const ShortList& others() const { return others_; }
  /// Links into other files, which were not followed.
  const ShortList& links() const { return links_; }
  const ShortList& dangling() const { return dangling_; }
  const std::string& missing_signal() const { return missing_signal_; }

 private:
  void dataset(hid_t object, const std::string& path) override { look_at(object, path); }
  void group(hid_t object, const std::string& path) override {
    if (std::string signal = nexus_signal_of(object, path); !signal.empty())
      signals_.push_back(std::move(signal));
  }
  void link(const FoundLink& found) override { look_at_link(file_, found); }

  void look_at(hid_t object, const std::string& name) {
    const std::vector<hsize_t> dims = dims_of(object);
    const auto size = volume_size(dims);
    const Hdf5Handle type(H5Dget_type(object), H5Tclose);
    const auto stored = stored_samples_of(type.get());
    // An array of VTKHDF with a fourth axis has several numbers for each sample.
    if (!size || !stored || (is_vtkhdf_array(name) && dims.size() > 3)) {
      if (dims.size() >= 3)
        others_.add(stored ? fmt::format("{} has {} axes ({})", name, dims.size(), in_words(dims))
                           : fmt::format("{} has {}", name, samples_in_words(type.get())));
      return;
    }
    const bool has_slices = dims.size() > 2 && size->z > 1;
    if (!has_slices && !is_slice(object, name, dims.size())) return;
    std::vector<Candidate>& list = has_slices ? volumes_ : slices_;
    if (const auto address = address_of(object)) places_.emplace(*address, std::pair(&list, list.size()));
    list.push_back({name, fmt::format("{} {}", in_words(dims), name_of(stored->type))});
  }

  void look_at_link(hid_t file, const FoundLink& found) {
    // There may be thousands of other files: few are opened.
    const std::string why = found.is_external && links_.is_full() ? "" : why_missing(file, found.path);
    if (!why.empty())
      dangling_.add(why);
    else if (found.is_external)
      links_.add(fmt::format("{} is a link to {}", found.path, found.target));
  }

  /// The path of a signal has axes beside it, which other paths of the same data set have not.
  void look_at_signal(hid_t file, const std::string& name) {
    const Hdf5Handle object = opened_dataset(file, name);
    if (!object) {
      const std::string why = why_missing(file, name);
      if (missing_signal_.empty())
        missing_signal_ = why.empty() ? fmt::format("{} is no data set", name) : why;
      return;
    }
    if (file_of(object.get()) != file_of(file)) return look_at(object.get(), name);
    const auto address = address_of(object.get());
    const auto known = address ? places_.find(*address) : places_.end();
    if (known == places_.end()) return;
    Candidate& candidate = (*known->second.first)[known->second.second];
    if (!candidate.is_signal) candidate.name = name;
    candidate.is_signal = true;
  }

  hid_t file_;
  std::vector<std::string> signals_;  ///< those that groups of NeXus name
  std::vector<Candidate> volumes_, slices_;
  std::map<haddr_t, std::pair<std::vector<Candidate>*, std::size_t>> places_;  ///< in the lists, of this file
  ShortList others_, links_, dangling_;
  std::string missing_signal_;
};

BrokenInput has_no_volume(hid_t file, const std::string& path, const Candidates& all) {
  const std::string type = vtkhdf_type(file);
  if (!type.empty() && type != "ImageData")
    return BrokenInput("{}: VTKHDF file: holds {}, which is no volume", path, tagrid::quoted(type));
  std::string why =
      "has no data set with three axes of integers of 8, 16 or 32 bits, or floats of 32 or 64 bits";
  if (!all.others().empty()) why += "; " + all.others().text();
  if (!all.links().empty())
    why += fmt::format("; {} (--dataset reads what a link leads to)", all.links().text());
  if (!all.dangling().empty()) why += "; " + all.dangling().text();
  return broken_hdf5(path, why);
}

/// Names in messages and lists are UTF-8; others are "#2" there, and the text shows them as well as it can.
std::vector<Choice> choices_of(const std::vector<Candidate>& list) {
  std::vector<Choice> choices;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const bool is_plain = is_utf8(list[i].name);
    choices.push_back({is_plain ? list[i].name : fmt::format("#{}", i + 1),
                       is_plain ? list[i].text : fmt::format("{}  {}", list[i].name, list[i].text)});
  }
  return choices;
}

/// What else is in the file, when its only volume is read.
std::vector<std::string> remarks_on_the_only_one(const std::string& path, const std::string& name,
                                                 const Candidates& all) {
  std::vector<std::string> remarks;
  for (const auto* list : {&all.others(), &all.links(), &all.dangling()})
    if (!list->empty())
      remarks.push_back(
          fmt::format("{}: HDF5 file: {} is read, because it is the only volume of the file itself, but {}",
                      path, name, list->text()));
  return remarks;
}

void require_no_dangling_link(hid_t file, const std::string& path, const std::string& wanted) {
  const std::string why = why_missing(file, inside("/", wanted));
  if (!why.empty() && !why.starts_with("there is no ")) throw broken_hdf5(path, why);
}

}  // namespace

DatasetChoice chosen_dataset(hid_t file, const std::string& path, const std::string& wanted) {
  if (!wanted.empty() && opened_dataset(file, wanted)) return {wanted, {}};
  if (wanted.empty())
    if (const std::string name = nexus_default(file, path); !name.empty()) return {name, {}};
  if (!wanted.empty()) require_no_dangling_link(file, path, wanted);
  Candidates all(file);
  std::vector<Candidate>& list = all.list();
  for (Candidate& candidate : list) candidate.is_signal |= is_nexus_signal(file, candidate.name);
  const auto signals = std::ranges::count(list, true, &Candidate::is_signal);
  if (wanted.empty() && signals == 0 && !all.missing_signal().empty())
    throw broken_hdf5(path, fmt::format("the signal of a group is missing: {}; --dataset chooses a data set "
                                        "regardless of it",
                                        all.missing_signal()));
  if (list.empty()) throw has_no_volume(file, path, all);
  // The other levels are means of the finest one, which --dataset chooses by their paths.
  if (is_imaris(file))
    std::erase_if(list, [](const Candidate& one) { return !one.name.starts_with(finest_of_imaris); });
  if (list.empty()) throw has_no_volume(file, path, all);
  if (wanted.empty() && signals == 1) {
    DatasetChoice choice = {std::ranges::find(list, true, &Candidate::is_signal)->name, {}};
    if (!all.missing_signal().empty())
      choice.warnings.push_back(
          fmt::format("{}: HDF5 file: {} is read, because it is the only signal that exists: {}", path,
                      choice.name, all.missing_signal()));
    return choice;
  }
  const std::string& name = list[chosen(path, "dataset", wanted, choices_of(list))].name;
  return {name, wanted.empty() ? remarks_on_the_only_one(path, name, all) : std::vector<std::string>()};
}

}  // namespace tagrid
