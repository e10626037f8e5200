#include "io/formats/zeiss/reader/compound_file.h"

#include <fmt/format.h>
#include <gsf/gsf.h>

#include <algorithm>

#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

template <class T>
std::shared_ptr<T> owned(T* object) {
  return {object, [](T* one) {
            if (one != nullptr) g_object_unref(one);
          }};
}

/// The text of an error, which is freed.
std::string text_of(GError* error) {
  if (error == nullptr) return "it cannot be opened";
  std::string text = printable(error->message);
  g_error_free(error);
  return text;
}

/// The entry of a storage with this name; nullptr without one.
std::shared_ptr<GsfInput> entry(GsfInfile* storage, std::string_view name) {
  const std::string wanted = lower_case(name);
  const int count = gsf_infile_num_children(storage);
  for (int i = 0; i < count; ++i) {
    const char* own = gsf_infile_name_by_index(storage, i);
    if (own != nullptr && lower_case(own) == wanted) return owned(gsf_infile_child_by_index(storage, i));
  }
  return nullptr;
}

}  // namespace

std::uint64_t CompoundStream::size() const {
  return static_cast<std::uint64_t>(std::max<gsf_off_t>(gsf_input_size(input_.get()), 0));
}

void CompoundStream::read(std::span<std::byte> out) const {
  if (size() < out.size() || gsf_input_seek(input_.get(), 0, G_SEEK_SET) ||
      gsf_input_read(input_.get(), out.size(), reinterpret_cast<guint8*>(out.data())) == nullptr)
    throw BrokenInput("{}: is truncated or damaged: {} bytes of the stream cannot be read", path_,
                      out.size());
}

CompoundFile::CompoundFile(const std::string& path) : path_(path) {
  static_cast<void>(FileSource(path));  // says what is wrong with a file that cannot be opened
  GError* error = nullptr;
  const std::shared_ptr<GsfInput> input = owned(gsf_input_stdio_new(path.c_str(), &error));
  if (!input) throw BrokenInput("{}: Zeiss file: {}", path, text_of(error));
  GsfInfile* root = gsf_infile_msole_new(input.get(), &error);
  if (root == nullptr)
    throw BrokenInput("{}: Zeiss file: is truncated, or not an OLE2 file: {}", path, text_of(error));
  root_ = owned(root);
}

std::optional<CompoundStream> CompoundFile::find(std::string_view name) const {
  const std::size_t slash = name.find('/');
  GsfInfile* storage = root_.get();
  if (slash != name.npos) {
    const std::string_view outer = name.substr(0, slash);
    if (storage_name_ != outer) {
      const std::shared_ptr<GsfInput> found = entry(root_.get(), outer);
      storage_name_ = outer;
      storage_ = found && GSF_IS_INFILE(found.get())
                     ? std::shared_ptr<GsfInfile>(found, GSF_INFILE(found.get()))
                     : nullptr;
    }
    storage = storage_.get();
  }
  if (storage == nullptr) return std::nullopt;
  std::shared_ptr<GsfInput> stream = entry(storage, slash == name.npos ? name : name.substr(slash + 1));
  // A storage has entries, and a stream has none.
  if (!stream || (GSF_IS_INFILE(stream.get()) && gsf_infile_num_children(GSF_INFILE(stream.get())) >= 0))
    return std::nullopt;
  return CompoundStream(fmt::format("{}: Zeiss file: {}", path_, name), std::move(stream));
}

CompoundStream CompoundFile::at(std::string_view name) const {
  auto stream = find(name);
  if (!stream) throw BrokenInput("{}: Zeiss file: has no stream {}; it may be truncated", path_, name);
  return *std::move(stream);
}

std::optional<std::vector<std::byte>> CompoundFile::content(std::string_view name, std::size_t most) const {
  const auto stream = find(name);
  if (!stream) return std::nullopt;
  if (stream->size() > most)
    throw BrokenInput("{}: Zeiss file: {} has {} bytes, but at most {} are expected", path_, name,
                      stream->size(), most);
  std::vector<std::byte> bytes(memory_size(stream->size()));
  stream->read(bytes);
  return bytes;
}

}  // namespace tagrid
