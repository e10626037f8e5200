#include "io/formats/dicom/reader/jpeg_xl.h"

#include <jxl/decode.h>
#include <jxl/decode_cxx.h>

#include <new>
#include <optional>
#include <string_view>

#include "io/errors/errors.h"

namespace tagrid {
namespace {

constexpr int most_bits = 16;

void require_supported(const JxlBasicInfo& info) {
  const auto require = [](bool is_understood, std::string_view why) {
    if (!is_understood) throw BrokenInput("the JPEG XL stream {}", why);
  };
  require(info.num_color_channels == 1 && info.num_extra_channels == 0, "has several components, not one");
  require(info.exponent_bits_per_sample == 0 && info.bits_per_sample <= most_bits,
          "has floating-point samples, or samples of more than 16 bits, which are not supported");
  require(info.have_animation == JXL_FALSE, "has several images, not one");
  require(info.orientation == JXL_ORIENT_IDENTITY,
          "says that its image is to be turned, which is not supported");
}

/// How the numbers of samples follow from light; nothing if a profile says it, not a list of numbers.
std::optional<JxlColorEncoding> colors_of(const JxlDecoder* decoder, JxlColorProfileTarget target) {
  const JxlPixelFormat format{1, JXL_TYPE_FLOAT, JXL_NATIVE_ENDIAN, 0};
  JxlColorEncoding colors = {};
  // Later releases have one parameter less.
  const auto get = [&](auto* function) {
    if constexpr (requires { function(decoder, &format, target, &colors); })
      return function(decoder, &format, target, &colors);
    else
      return function(decoder, target, &colors);
  };
  return get(&JxlDecoderGetColorAsEncodedProfile) == JXL_DEC_SUCCESS ? std::optional(colors) : std::nullopt;
}

/// Samples that were converted to other colors must come back as those of the image.
void set_colors(JxlDecoder* decoder, const JpegXlImage& image) {
  if (image.has_own_colors) return;
  const auto original = colors_of(decoder, JXL_COLOR_PROFILE_TARGET_ORIGINAL);
  if (original) JxlDecoderSetPreferredColorProfile(decoder, &*original);
  const auto decoded = colors_of(decoder, JXL_COLOR_PROFILE_TARGET_DATA);
  const bool are_same =
      original && decoded && original->color_space == decoded->color_space &&
      original->transfer_function == decoded->transfer_function &&
      (original->transfer_function != JXL_TRANSFER_FUNCTION_GAMMA || original->gamma == decoded->gamma) &&
      original->white_point == decoded->white_point;
  if (!are_same)
    throw BrokenInput(
        "the JPEG XL stream has samples in other colors than those of its image, which are not known");
}

/// The number that the library has as a share of the largest one: both are exact for so few bits.
std::uint16_t number_of(float share, int bits) {
  const float most = static_cast<float>((1U << bits) - 1);
  const float number = share * most + 0.5F;
  if (!(number > 0)) return 0;  // neither is what is not a number
  return number < most ? static_cast<std::uint16_t>(number) : static_cast<std::uint16_t>(most);
}

/// `with_samples`: not only the header. A size of 0 is any.
JpegXlImage decode(std::span<const std::byte> bytes, std::int64_t width, std::int64_t height,
                   bool with_samples) {
  const JxlDecoderPtr decoder = JxlDecoderMake(nullptr);
  if (!decoder) throw std::bad_alloc();
  const auto require = [](bool is_good) {
    if (!is_good) throw BrokenInput("the JPEG XL stream is broken, or ends too soon");
  };
  require(JxlDecoderSubscribeEvents(decoder.get(), JXL_DEC_BASIC_INFO | JXL_DEC_COLOR_ENCODING |
                                                       JXL_DEC_FULL_IMAGE) == JXL_DEC_SUCCESS);
  require(JxlDecoderSetInput(decoder.get(), reinterpret_cast<const std::uint8_t*>(bytes.data()),
                             bytes.size()) == JXL_DEC_SUCCESS);
  JxlDecoderCloseInput(decoder.get());
  JpegXlImage image;
  std::vector<float> shares;
  while (true) {
    switch (JxlDecoderProcessInput(decoder.get())) {
      case JXL_DEC_BASIC_INFO: {
        JxlBasicInfo info;
        require(JxlDecoderGetBasicInfo(decoder.get(), &info) == JXL_DEC_SUCCESS);
        require_supported(info);
        image = {info.xsize,
                 info.ysize,
                 static_cast<int>(info.bits_per_sample),
                 info.uses_original_profile == JXL_TRUE,
                 {}};
        if (!with_samples) return image;
        // Before anything is allocated for the samples.
        if (image.width != width || image.height != height)
          throw BrokenInput("the JPEG XL stream has {} x {} samples, but {} x {} are expected", image.width,
                            image.height, width, height);
        break;
      }
      case JXL_DEC_COLOR_ENCODING:
        set_colors(decoder.get(), image);
        break;
      case JXL_DEC_NEED_IMAGE_OUT_BUFFER: {
        const JxlPixelFormat format{1, JXL_TYPE_FLOAT, JXL_NATIVE_ENDIAN, 0};
        shares.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
        require(JxlDecoderSetImageOutBuffer(decoder.get(), &format, shares.data(),
                                            shares.size() * sizeof(float)) == JXL_DEC_SUCCESS);
        break;
      }
      case JXL_DEC_FULL_IMAGE:
        require(!shares.empty());
        image.samples.reserve(shares.size());
        for (const float share : shares) image.samples.push_back(number_of(share, image.bits));
        return image;
      default:
        require(false);
    }
  }
}

}  // namespace

JpegXlImage decode_jpeg_xl(std::span<const std::byte> bytes, std::int64_t width, std::int64_t height) {
  return decode(bytes, width, height, true);
}

JpegXlImage jpeg_xl_header(std::span<const std::byte> bytes) { return decode(bytes, 0, 0, false); }

}  // namespace tagrid
