#include "io/formats/hdf5/attributes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "io/formats/hdf5/handle.h"
#include "io/metadata/metadata.h"
#include "io/programs/stored_samples.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

std::string member_name(hid_t type, unsigned number) {
  char* const name = H5Tget_member_name(type, number);
  const std::string text = name == nullptr ? "" : name;
  H5free_memory(name);
  return text;
}

/// As h5py and others write them.
bool is_complex(hid_t type) {
  return H5Tget_nmembers(type) == 2 && member_name(type, 0) == "r" && member_name(type, 1) == "i";
}
bool is_of_ieee(hid_t type) {
  return stored_samples_of(type) || H5Tget_size(type) == 2 || H5Tget_size(type) > 8;
}
bool is_boolean(hid_t type) {
  return H5Tget_nmembers(type) == 2 && member_name(type, 0) == "FALSE" && member_name(type, 1) == "TRUE";
}

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
  const bool has_blanks_behind = H5Tget_strpad(type) == H5T_STR_SPACEPAD;
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < count; ++i) {
    std::string text = all.substr(i * size, size);
    text = text.substr(0, text.find('\0'));
    if (has_blanks_behind) text.erase(text.find_last_not_of(' ') + 1);
    texts.push_back(std::move(text));
  }
  return texts;
}

/// The parts of a text that should be `count` numbers.
std::vector<std::string> parts_of_list(std::string text, std::size_t count) {
  for (char& c : text)
    if (std::string_view("()[]{};").find(c) != std::string_view::npos) c = ' ';
  std::vector<std::string> parts;
  for (std::string_view word : words_of(text)) {
    if (word.ends_with(',')) word.remove_suffix(1);
    parts.emplace_back(word);
  }
  // "1,2,3" are three numbers; one with a decimal comma would not have as many commas.
  const auto commas = parts.size() == 1 ? std::ranges::count(parts[0], ',') : 0;
  if (count < 2 || static_cast<std::size_t>(commas) + 1 != count) return parts;
  const std::vector<std::string_view> numbers = split(parts[0], ',');
  return {numbers.begin(), numbers.end()};
}

}  // namespace

hid_t hdf5_type_of(SampleType type) {
  switch (type) {
    case SampleType::uint8:
      return H5T_STD_U8LE;
    case SampleType::int8:
      return H5T_STD_I8LE;
    case SampleType::uint16:
      return H5T_STD_U16LE;
    case SampleType::int16:
      return H5T_STD_I16LE;
    case SampleType::uint32:
      return H5T_STD_U32LE;
    case SampleType::int32:
      return H5T_STD_I32LE;
    case SampleType::float32:
      return H5T_IEEE_F32LE;
    case SampleType::float64:
      return H5T_IEEE_F64LE;
  }
  return -1;
}

std::optional<StoredSamples> stored_samples_of(hid_t type) {
  const std::size_t size = H5Tget_size(type);
  const bool big = H5Tget_order(type) == H5T_ORDER_BE;
  const H5T_class_t kind = H5Tget_class(type);
  if (kind == H5T_FLOAT) {
    for (const hid_t known : {H5T_IEEE_F32LE, H5T_IEEE_F32BE})
      if (H5Tequal(type, known) > 0) return StoredSamples{SampleType::float32, big};
    for (const hid_t known : {H5T_IEEE_F64LE, H5T_IEEE_F64BE})
      if (H5Tequal(type, known) > 0) return StoredSamples{SampleType::float64, big};
    return std::nullopt;
  }
  if (kind != H5T_INTEGER || H5Tget_precision(type) != 8 * size) return std::nullopt;
  const bool is_signed = H5Tget_sign(type) == H5T_SGN_2;
  const auto integer = integer_type(size, is_signed);
  return integer ? std::optional(StoredSamples{*integer, big}) : std::nullopt;
}

std::string samples_in_words(hid_t type) {
  const std::size_t size = 8 * H5Tget_size(type), precision = H5Tget_precision(type);
  switch (H5Tget_class(type)) {
    case H5T_INTEGER:
      return fmt::format("{}integers of {} bits{}", H5Tget_sign(type) == H5T_SGN_2 ? "" : "unsigned ",
                         precision, precision < size ? fmt::format(" in {}", size) : "");
    case H5T_FLOAT:
      return fmt::format("floats of {} bits{}", precision,
                         is_of_ieee(type) ? "" : " that are not those of IEEE 754");
    case H5T_STRING:
      return "texts";
    case H5T_BITFIELD:
      return fmt::format("fields of {} bits", precision);
    case H5T_OPAQUE:
      return "bytes without a meaning (an opaque type)";
    case H5T_COMPOUND:
      return is_complex(type) ? "complex numbers" : "several numbers each (a compound type)";
    case H5T_REFERENCE:
      return "references";
    case H5T_ENUM:
      return is_boolean(type) ? "booleans" : "values of a list (an enumeration)";
    case H5T_VLEN:
      return "lists of any length";
    case H5T_ARRAY:
      return "several numbers each (an array type)";
    default:
      return "a type that is not one of numbers";
  }
}

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

namespace {

/// Nothing if the attribute has neither.
std::optional<std::string> texts_or_numbers(hid_t object, const std::string& name) {
  if (const auto texts = text_list_attribute(object, name); !texts.empty())
    return fmt::format("{}", fmt::join(texts, ", "));
  if (const auto numbers = number_attribute(object, name); !numbers.empty())
    return fmt::format("{}", fmt::join(numbers, " "));
  return std::nullopt;
}

}  // namespace

std::string attribute_in_words(hid_t object, const std::string& name) {
  const Hdf5Handle attribute = opened(object, name);
  if (!attribute) return "";
  if (const auto words = texts_or_numbers(object, name)) return *words;
  const Hdf5Handle type(H5Aget_type(attribute.get()), H5Tclose);
  return count_of(attribute.get()) == 0 ? "" : samples_in_words(type.get());
}

AttributeNumbers foreign_numbers(hid_t object, const std::string& name, std::size_t count) {
  AttributeNumbers result;
  if (H5Aexists(object, name.c_str()) <= 0) return result;
  result.outcome = ForeignNumber::Outcome::unreadable;
  result.text = attribute_in_words(object, name);
  result.values = number_attribute(object, name);
  std::vector<std::string> texts = text_list_attribute(object, name);
  if (texts.size() == 1 && count > 1) texts = parts_of_list(texts[0], count);
  for (const std::string& text : texts) {
    const ForeignNumber number = foreign_number(text);
    if (!number.is_number()) return result;
    result.values.push_back(number.value);
    result.decimal_comma |= number.decimal_comma;
  }
  if (result.values.size() == count) result.outcome = ForeignNumber::Outcome::number;
  return result;
}

std::vector<std::string> attribute_names(hid_t object) {
  std::vector<std::string> names;
  // HDF5 crashes when it lists attributes of which it cannot read one. A search for a name that
  // does not exist reads all of them, and fails properly.
  if (H5Aexists(object, "\x01") < 0) return names;
  const auto add = [](hid_t, const char* name, const H5A_info_t*, void* user) -> herr_t {
    static_cast<std::vector<std::string>*>(user)->emplace_back(name);
    return 0;
  };
  hsize_t index = 0;
  H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_INC, &index, add, &names);
  return names;
}

KeyValues all_attributes(hid_t object) {
  KeyValues all;
  for (const std::string& name : attribute_names(object))
    if (std::string value = texts_or_numbers(object, name).value_or(""); !value.empty())
      all.emplace_back(name, std::move(value));
  return all;
}

}  // namespace tagrid
