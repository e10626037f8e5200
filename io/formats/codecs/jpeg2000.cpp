#include "io/formats/codecs/jpeg2000.h"

#include <openjpeg.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>

#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/samples/stored_bits.h"

namespace tagrid {
namespace {

constexpr std::string_view code_stream = "\xff\x4f\xff\x51";

/// Bytes, and the next one to be read.
struct Source {
  const ByteSource& bytes;
  std::uint64_t at = 0;

  std::uint64_t left() const { return bytes.size() - at; }
};

OPJ_SIZE_T read_bytes(void* out, OPJ_SIZE_T size, void* user) {
  Source& source = *static_cast<Source*>(user);
  if (source.left() == 0) return static_cast<OPJ_SIZE_T>(-1);
  const std::uint64_t count = std::min<std::uint64_t>(size, source.left());
  try {
    source.bytes.read_at(source.at, {static_cast<std::byte*>(out), count});
  } catch (const std::exception&) {
    return static_cast<OPJ_SIZE_T>(-1);  // C code cannot be left by an exception
  }
  source.at += count;
  return count;
}

OPJ_OFF_T skip_bytes(OPJ_OFF_T size, void* user) {
  Source& source = *static_cast<Source*>(user);
  if (size < 0) return -1;
  const std::uint64_t count = std::min(static_cast<std::uint64_t>(size), source.left());
  source.at += count;
  return static_cast<OPJ_OFF_T>(count);
}

OPJ_BOOL seek_byte(OPJ_OFF_T at, void* user) {
  Source& source = *static_cast<Source*>(user);
  if (at < 0 || static_cast<std::uint64_t>(at) > source.bytes.size()) return OPJ_FALSE;
  source.at = static_cast<std::uint64_t>(at);
  return OPJ_TRUE;
}

void keep_message(const char* message, void* user) {
  auto& text = *static_cast<std::string*>(user);
  if (text.empty()) text = message;
  while (!text.empty() && text.back() == '\n') text.pop_back();
}

template <class T>
using Owned = std::unique_ptr<T, void (*)(T*)>;

/// `with_samples`: not only the header. A size of 0 is any.
Jpeg2000Image decode(const ByteSource& bytes, std::int64_t width, std::int64_t height, bool with_samples) {
  std::array<std::byte, 12> beginning = {};
  bytes.read_at(0, std::span(beginning).first(std::min<std::size_t>(beginning.size(), bytes.size())));
  const std::string_view text(reinterpret_cast<const char*>(beginning.data()), beginning.size());
  const Owned<opj_stream_t> stream(opj_stream_default_create(OPJ_TRUE),
                                   [](opj_stream_t* s) { opj_stream_destroy(s); });
  const Owned<opj_codec_t> codec(
      opj_create_decompress(text.starts_with(code_stream) ? OPJ_CODEC_J2K : OPJ_CODEC_JP2),
      [](opj_codec_t* c) { opj_destroy_codec(c); });
  if (!stream || !codec) throw std::bad_alloc();
  Source source{bytes};
  opj_stream_set_user_data(stream.get(), &source, nullptr);
  opj_stream_set_user_data_length(stream.get(), bytes.size());
  opj_stream_set_read_function(stream.get(), read_bytes);
  opj_stream_set_skip_function(stream.get(), skip_bytes);
  opj_stream_set_seek_function(stream.get(), seek_byte);
  std::string message;
  opj_set_error_handler(codec.get(), keep_message, &message);
  const auto require = [&](bool is_good) {
    if (!is_good)
      throw BrokenInput("the JPEG 2000 stream is broken: {}", message.empty() ? "it ends too soon" : message);
  };
  opj_dparameters_t parameters;
  opj_set_default_decoder_parameters(&parameters);
  require(opj_setup_decoder(codec.get(), &parameters));
  opj_decoder_set_strict_mode(codec.get(), OPJ_TRUE);
  opj_image_t* made = nullptr;
  const bool has_header = opj_read_header(stream.get(), codec.get(), &made);
  const Owned<opj_image_t> image(made, [](opj_image_t* i) { opj_image_destroy(i); });
  require(has_header && image);
  if (image->numcomps != 1)
    throw BrokenInput("the JPEG 2000 stream has {} components, not one", image->numcomps);
  const opj_image_comp_t& component = image->comps[0];
  // Before anything is allocated for the samples.
  if ((width != 0 && component.w != width) || (height != 0 && component.h != height))
    throw BrokenInput("the JPEG 2000 stream has {} x {} samples, but {} x {} are expected", component.w,
                      component.h, width, height);
  Jpeg2000Image result{component.w,         component.h, static_cast<int>(component.prec),
                       component.sgnd != 0, false,       {}};
  if (opj_codestream_info_v2_t* info = opj_get_cstr_info(codec.get()); info != nullptr) {
    result.is_lossless =
        info->m_default_tile_info.tccp_info != nullptr && info->m_default_tile_info.tccp_info[0].qmfbid == 1;
    opj_destroy_cstr_info(&info);
  }
  if (!with_samples) return result;
  require(opj_decode(codec.get(), stream.get(), image.get()));
  require(opj_end_decompress(codec.get(), stream.get()));
  // A palette makes several components of one, in other memory.
  if (image->numcomps != 1 || image->comps[0].w != result.width || image->comps[0].h != result.height)
    throw BrokenInput("the JPEG 2000 stream has other components than its header says");
  const opj_image_comp_t& decoded = image->comps[0];
  require(decoded.data != nullptr);
  result.samples.assign(decoded.data, decoded.data + static_cast<std::size_t>(decoded.w) * decoded.h);
  return result;
}

/// Adds the path to what is wrong.
Jpeg2000Image decode_file(const std::string& path, bool with_samples) try {
  return decode(FileSource(path), 0, 0, with_samples);
} catch (const BrokenInput& error) {
  throw BrokenInput("{}: {}", path, error.what());
}

}  // namespace

Jpeg2000Image decode_jpeg2000(std::span<const std::byte> bytes, std::int64_t width, std::int64_t height) {
  return decode(BytesInMemory(bytes), width, height, true);
}

Jpeg2000Image jpeg2000_header(std::span<const std::byte> bytes) {
  return decode(BytesInMemory(bytes), 0, 0, false);
}

Jpeg2000Image jpeg2000_header(const std::string& path) { return decode_file(path, false); }
Jpeg2000Image decode_jpeg2000_file(const std::string& path) { return decode_file(path, true); }

void store_samples(const Jpeg2000Image& image, std::size_t size, std::byte* out) {
  with_bits_of(size, [&]<class Bits>(Bits) {
    for (const std::int32_t sample : image.samples) {
      const auto bits = static_cast<Bits>(sample);
      std::memcpy(out, &bits, sizeof bits);
      out += sizeof bits;
    }
  });
}

}  // namespace tagrid
