#include "io/formats/hdf5/reader/emd.h"

#include <fmt/format.h>

#include "io/formats/hdf5/attributes.h"
#include "io/formats/hdf5/reader/datasets.h"

namespace tagrid {

std::vector<std::string> emd_axes(hid_t group, const std::string& name, std::size_t axes) {
  if (name != "data" || H5Aexists(group, "emd_group_type") <= 0) return {};
  // Version 1.0 counts from 0.
  const std::size_t first = H5Lexists(group, "dim0", H5P_DEFAULT) > 0 ? 0 : 1;
  std::vector<std::string> found;
  for (std::size_t i = 0; i < axes; ++i) found.push_back(fmt::format("dim{}", first + i));
  return found;
}

std::vector<std::string> names_of_emd_axes(hid_t group, const std::string& name, std::size_t axes) {
  std::vector<std::string> names;
  for (const std::string& axis : emd_axes(group, name, axes)) {
    const Hdf5Handle dataset = opened_dataset(group, axis);
    const auto texts = dataset ? text_list_attribute(dataset.get(), "name") : std::vector<std::string>();
    names.push_back(texts.empty() ? "" : texts.front());
  }
  return names;
}

}  // namespace tagrid
