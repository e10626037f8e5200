#include "tools/hdf5/attributes.h"

#include <fmt/format.h>

#include "tools/hdf5/handle.h"

namespace tagrid {
namespace {

constexpr hssize_t most_numbers = 1000, most_texts = 100;
constexpr std::size_t longest_text = 1 << 16;

Hdf5Handle opened(hid_t object, const std::string& name) {
  if (H5Aexists(object, name.c_str()) <= 0) return {};
  return {H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose};
}

hssize_t count_of(hid_t attribute) {
  const Hdf5Handle space(H5Aget_space(attribute), H5Sclose);
  return space ? H5Sget_simple_extent_npoints(space.get()) : -1;
}

std::vector<std::string> variable_texts(hid_t attribute, hid_t type, std::size_t count) {
  const Hdf5Handle memory(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(memory.get(), H5T_VARIABLE);
  H5Tset_cset(memory.get(), H5Tget_cset(type));
  std::vector<char*> pointers(count, nullptr);
  if (H5Aread(attribute, memory.get(), pointers.data()) < 0) return {};
  std::vector<std::string> texts;
  for (char* const pointer : pointers) {
    texts.emplace_back(pointer == nullptr ? "" : pointer);
    H5free_memory(pointer);
  }
  return texts;
}

std::vector<std::string> fixed_texts(hid_t attribute, hid_t type, std::size_t count) {
  const std::size_t size = H5Tget_size(type);
  if (size == 0 || size > longest_text) return {};
  std::string all(size * count, '\0');
  if (H5Aread(attribute, type, all.data()) < 0) return {};
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string text = all.substr(i * size, size);
    texts.push_back(text.substr(0, text.find('\0')));
  }
  return texts;
}

}  // namespace

std::optional<std::string> text_attribute(hid_t object, const std::string& name) {
  std::vector<std::string> texts = text_list_attribute(object, name);
  if (texts.size() != 1) return std::nullopt;
  return std::move(texts[0]);
}

std::vector<std::string> text_list_attribute(hid_t object, const std::string& name) {
  const Hdf5Handle attribute = opened(object, name);
  if (!attribute) return {};
  const Hdf5Handle type(H5Aget_type(attribute.get()), H5Tclose);
  const hssize_t count = count_of(attribute.get());
  if (!type || H5Tget_class(type.get()) != H5T_STRING || count < 1 || count > most_texts) return {};
  return H5Tis_variable_str(type.get()) > 0
             ? variable_texts(attribute.get(), type.get(), static_cast<std::size_t>(count))
             : fixed_texts(attribute.get(), type.get(), static_cast<std::size_t>(count));
}

std::vector<double> number_attribute(hid_t object, const std::string& name) {
  const Hdf5Handle attribute = opened(object, name);
  if (!attribute) return {};
  const Hdf5Handle type(H5Aget_type(attribute.get()), H5Tclose);
  const H5T_class_t kind = type ? H5Tget_class(type.get()) : H5T_NO_CLASS;
  const hssize_t count = count_of(attribute.get());
  if ((kind != H5T_INTEGER && kind != H5T_FLOAT) || count < 1 || count > most_numbers) return {};
  std::vector<double> numbers(static_cast<std::size_t>(count));
  if (H5Aread(attribute.get(), H5T_NATIVE_DOUBLE, numbers.data()) < 0) return {};
  return numbers;
}

KeyValues all_attributes(hid_t object) {
  KeyValues all;
  const auto add = [](hid_t where, const char* name, const H5A_info_t*, void* user) -> herr_t {
    std::string value;
    if (const auto text = text_attribute(where, name))
      value = *text;
    else
      for (const double number : number_attribute(where, name))
        value += fmt::format("{}{}", value.empty() ? "" : " ", number);
    if (!value.empty()) static_cast<KeyValues*>(user)->emplace_back(name, value);
    return 0;
  };
  hsize_t index = 0;
  H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_INC, &index, add, &all);
  return all;
}

}  // namespace tagrid
