#include "io/formats/png/reader/image.h"

#include <png.h>

#include <exception>
#include <limits>
#include <new>
#include <string_view>
#include <vector>

#include "io/errors/errors.h"
#include "io/programs/serve.h"

namespace tagrid {
namespace {

/// What libpng asks for. No exception may pass through it, as it is C and leaves by longjmp().
struct Reading {
  FileSource file;
  std::uint64_t at = 0;
  std::string message;
  std::string warning;  ///< the first one about samples
  std::exception_ptr error;
};

void read_bytes(png_structp png, png_bytep out, png_size_t size) {
  auto& reading = *static_cast<Reading*>(png_get_io_ptr(png));
  try {
    say_working();
    if (reading.file.size() - reading.at < size) {
      reading.message = "is truncated";
    } else {
      reading.file.read_at(reading.at, std::as_writable_bytes(std::span(out, size)));
      reading.at += size;
    }
  } catch (...) {
    reading.error = std::current_exception();
  }
  if (reading.error || !reading.message.empty()) png_error(png, "");
}

[[noreturn]] void leave(png_structp png, png_const_charp message) {
  auto& reading = *static_cast<Reading*>(png_get_error_ptr(png));
  try {
    if (reading.message.empty()) reading.message = message;
  } catch (...) {
    reading.error = std::current_exception();
  }
  png_longjmp(png, 1);
}

/// Most warnings are about chunks that need not be read. Those about the samples say that there are more of them, or
/// that their checksum is wrong.
void note_warning(png_structp png, png_const_charp message) {
  auto& reading = *static_cast<Reading*>(png_get_error_ptr(png));
  try {
    if (reading.warning.empty() && std::string_view(message).starts_with("IDAT: ")) reading.warning = message;
  } catch (...) {
    reading.error = std::current_exception();
  }
}

// Returns false if libpng gave up. No object with a destructor lives across longjmp().
bool decode(png_structp png, png_infop info, const PngOutline& outline, png_bytep* rows) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_read_info(png, info);
  // The outline was read from the same bytes, but a file may change meanwhile.
  if (png_get_image_width(png, info) != static_cast<png_uint_32>(outline.width) ||
      png_get_image_height(png, info) != static_cast<png_uint_32>(outline.height) ||
      png_get_bit_depth(png, info) != outline.bits || png_get_color_type(png, info) != PNG_COLOR_TYPE_GRAY)
    png_error(png, "its header has changed");
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  png_read_image(png, rows);
  png_read_end(png, nullptr);
  return true;
}

}  // namespace

void read_png(const std::string& path, const PngOutline& outline, std::span<std::byte> samples) {
  Reading reading{FileSource(path), 0, {}, {}, nullptr};
  const std::size_t row = samples.size() / static_cast<std::size_t>(outline.height);
  std::vector<png_bytep> rows;
  for (std::size_t y = 0; y < static_cast<std::size_t>(outline.height); ++y)
    rows.push_back(reinterpret_cast<png_bytep>(samples.data() + y * row));
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reading, leave, note_warning);
  if (png == nullptr) throw std::bad_alloc();
  png_infop info = png_create_info_struct(png);
  bool is_done = false;
  if (info != nullptr) {
    // The size of the image was checked by whoever has room for its samples.
    png_set_user_limits(png, std::numeric_limits<std::int32_t>::max(),
                        std::numeric_limits<std::int32_t>::max());
    // Wrong checksums are damage, also those of chunks that need not be read.
    png_set_crc_action(png, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
    png_set_read_fn(png, &reading, read_bytes);
    is_done = decode(png, info, outline, rows.data());
  }
  png_destroy_read_struct(&png, &info, nullptr);
  if (reading.error) std::rethrow_exception(reading.error);
  if (info == nullptr && !is_done && reading.message.empty()) throw std::bad_alloc();
  if (is_done && !reading.warning.empty())
    throw BrokenInput("{}: PNG file: its samples are damaged, or are more than its header says: {}", path,
                      reading.warning);
  if (!is_done) throw BrokenInput("{}: PNG file: is damaged: {}", path, reading.message);
}

}  // namespace tagrid
