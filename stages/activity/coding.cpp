#include "stages/activity/coding.h"

#include <array>
#include <bit>

#include "stages/activity/candidates.h"
#include "stages/activity/contexts.h"
#include "stages/entropy/adaptive_bit.h"
#include "stages/entropy/rans_coder.h"

namespace tagrid {
namespace {

// Codes the activity bits of a box in both directions: `coder` decides which.
template <class Coder, class Contexts>
class ActivityModel {
 public:
  ActivityModel(Coder& coder, LatticeBits& active, const Forecast& forecast, int cube_size)
      : coder_(coder),
        active_(active),
        candidates_(active, cube_size),
        contexts_(active, candidates_.bits(), forecast),
        models_(Contexts::models()) {}

  /// Returns the number of active points.
  std::int64_t code_pass(const Pass& pass, const LatticeBits* known) {
    found_ = 0;
    candidates_.find(pass);
    contexts_.begin_pass(pass);
    for_each_row(pass, active_.box(), [&](std::int64_t y, std::int64_t z) {
      // Broken bytes can end long before the last point.
      if (!coder_.exhausted()) code_row(y, z, known);
    });
    contexts_.end_pass(candidates_.mask());
    return found_;
  }

 private:
  void code_row(std::int64_t y, std::int64_t z, const LatticeBits* known) {
    const Word* row = candidates_.bits().row(y, z);
    Word* active = active_.row(y, z);
    bool bit = false;  // of the candidate before
    for (std::size_t i = 0; i < active_.words_per_row(); ++i) {
      const Word candidates = row[i] & candidates_.mask()[i];
      if (candidates == 0) continue;
      contexts_.look(y, z, i);
      const Word wanted = known != nullptr ? known->row(y, z)[i] : 0;
      Word found = 0;
      for (Word rest = candidates; rest != 0; rest &= rest - 1) {
        const int x = std::countr_zero(rest);
        bit = code_point(contexts_.at(x, bit), (wanted >> x & 1) != 0);
        found |= Word{bit} << x;
      }
      active[i] |= found;
      found_ += std::popcount(found);
    }
  }

  bool code_point(const PointContext& context, bool bit) {
    return code_mixed(coder_, bit, {&models_[context.of[0]], &models_[context.of[1]]}, mixers_[context.mixer],
                      255);
  }

  Coder& coder_;
  LatticeBits& active_;
  Candidates candidates_;
  Contexts contexts_;
  std::int64_t found_ = 0;
  std::vector<AdaptiveBit> models_;
  std::array<Mixer, Contexts::mixers> mixers_;
};

// Heap bytes of the models, of one bit for every point, of three rows of bits, and of what was not forecast.
std::uint64_t model_bytes(Index3 size, bool forecast) {
  const auto& sizes = forecast ? ForecastContexts::sizes : PlainContexts::sizes;
  return (sizes[0] + sizes[1]) * sizeof(AdaptiveBit) + LatticeBits::working_bytes(size) +
         3 * LatticeBits::working_bytes({size.x, 1, 1}) + (forecast ? Surprises::working_bytes(size) : 0);
}

// `known` is null if the coder decodes.
template <class Contexts, class Coder>
void code_passes(Coder& coder, LatticeBits& active, const Forecast& forecast, int cube_size, int max_level,
                 const LatticeBits* known) {
  ActivityModel<Coder, Contexts> model(coder, active, forecast, cube_size);
  int cycle = 0;
  for (std::int64_t unit = cube_size / 2; unit >= 1; unit /= 2, ++cycle)
    for (int odd_count = 3; odd_count >= 1; --odd_count) {
      if (3 * cycle + 4 - odd_count > max_level) return;
      std::int64_t found = 0;
      for (unsigned axes = 1; axes < 8; ++axes)
        if (std::popcount(axes) == odd_count)
          found +=
              model.code_pass({unit, {(axes & 1) != 0, (axes & 2) != 0, (axes & 4) != 0}, odd_count}, known);
      // Every point has a parent in the level before.
      if (found == 0) return;
    }
}

template <class Contexts>
Status decode_passes(std::span<const std::uint8_t> bytes, const Forecast& forecast, int cube_size,
                     int max_level, LatticeBits& active) {
  RansDecoder coder(bytes);
  set_root_corners(active, cube_size);
  code_passes<Contexts>(coder, active, forecast, cube_size, max_level, nullptr);
  if (!coder.finished()) return Status::broken("the activity has the wrong number of bytes");
  return {};
}

}  // namespace

void encode_activity(const LatticeBits& active, const Forecast& forecast, int cube_size, int max_level,
                     std::vector<std::uint8_t>& out) {
  RansEncoder coder(out);
  LatticeBits coded(active.box());
  set_root_corners(coded, cube_size);
  if (forecast.exists())
    code_passes<ForecastContexts>(coder, coded, forecast, cube_size, max_level, &active);
  else
    code_passes<PlainContexts>(coder, coded, forecast, cube_size, max_level, &active);
  coder.finish();
}

Status decode_activity(std::span<const std::uint8_t> bytes, const Forecast& forecast, int cube_size,
                       int max_level, LatticeBits& active) {
  if (!forecast.exists()) return decode_activity(bytes, cube_size, max_level, active);
  return decode_passes<ForecastContexts>(bytes, forecast, cube_size, max_level, active);
}

Status decode_activity(std::span<const std::uint8_t> bytes, int cube_size, int max_level,
                       LatticeBits& active) {
  return decode_passes<PlainContexts>(bytes, {}, cube_size, max_level, active);
}

std::uint64_t working_bytes_of_encoding_activity(Index3 size, bool forecast) {
  return model_bytes(size, forecast) + LatticeBits::working_bytes(size) +
         RansEncoder::working_bytes(static_cast<std::uint64_t>(size.x * size.y * size.z));
}

std::uint64_t working_bytes_of_decoding_activity(Index3 size, bool forecast) {
  return model_bytes(size, forecast);
}

}  // namespace tagrid
