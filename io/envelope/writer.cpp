#include <algorithm>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/envelope/envelope.h"
#include "io/envelope/plain_bytes.h"
#include "io/samples/stored_bits.h"

namespace tagrid {
namespace {

constexpr std::uint64_t step = 1 << 18;  // bytes of a file that are read at once: complete samples

/// Passes the bytes [begin, end) of a file in steps.
template <class Use>
void read_stretch(PlainBytes& source, std::uint64_t begin, std::uint64_t end, Use use) {
  std::vector<std::byte> bytes;
  for (; begin < end; begin += bytes.size()) {
    bytes.resize(std::min(step, end - begin));
    source.read_at(begin, bytes);
    use(bytes);
  }
}

void leave_only_spare(const StoredBits& stored, std::size_t size, std::span<std::byte> samples) {
  with_bits_of(size, [&]<class Bits>(Bits) {
    const BitsThatCount<Bits> bits(stored);
    change_each<Bits>(samples, [&](Bits integer) { return static_cast<Bits>(integer & ~bits.used); });
  });
}

bool has_spare(const SlicesInFile& slices, std::size_t size) {
  return slices.run.stored.bits > 0 && static_cast<std::size_t>(slices.run.stored.bits) < 8 * size;
}

/// Whether look_at_content() reads a file to its end: for its checksum, or for its spare bits.
bool is_content_read(const SourceFiles& source, bool exact, std::size_t number) {
  if (!PlainBytes(source.pieces[number], source.paths).is_complete()) return false;
  const std::size_t size = size_of(source.shape.type);
  return exact || std::ranges::any_of(source.files[number].slices,
                                      [&](const auto& slices) { return has_spare(slices, size); });
}

std::vector<std::byte> description_of(const EnvelopeFile& file) {
  FieldWriter out;
  out.put(static_cast<std::uint16_t>(file.name.size()));
  out.put_bytes(std::as_bytes(std::span(file.name)));
  out.put(file.size);
  out.put(static_cast<std::uint8_t>((file.checksum ? 1 : 0) | (file.is_changed ? 2 : 0)));
  if (file.checksum) out.put(*file.checksum);
  out.put(static_cast<std::uint32_t>(file.slices.size()));
  for (const auto& [first, run, spare] : file.slices) {
    out.put(static_cast<std::uint64_t>(first));
    out.put(static_cast<std::uint64_t>(run.slices));
    out.put(run.offset);
    out.put(run.step);
    out.put(static_cast<std::uint8_t>((run.big_endian ? 1 : 0) | (run.stored.is_signed ? 2 : 0) |
                                      (run.row_step != 0 ? 4 : 0) | (run.bottom_up ? 8 : 0)));
    out.put(static_cast<std::uint8_t>(run.stored.bits));
    out.put(static_cast<std::uint8_t>(spare));
    out.put(run.stored.add);
    if (run.row_step != 0) out.put(run.row_step);
  }
  return std::move(out.bytes());
}

}  // namespace

void look_at_content(SourceFiles& source, bool exact, std::size_t number) {
  EnvelopeFile& file = source.files[number];
  PlainBytes content(source.pieces[number], source.paths);
  const std::size_t size = size_of(source.shape.type);
  if (!content.is_complete()) {
    // Samples will be stored as most programs do it.
    for (SlicesInFile& slices : file.slices)
      if (has_spare(slices, size))
        slices.spare = slices.run.stored.is_signed ? SpareBits::sign : SpareBits::zero;
    return;
  }
  if (!is_content_read(source, exact, number)) return;
  RunningChecksum checksum;
  std::vector<SpareBitsSeen> seen(file.slices.size());
  for_each_stretch(file, source.shape, [&](std::uint64_t begin, std::uint64_t end, const auto* slices) {
    read_stretch(content, begin, end, [&](std::span<std::byte> bytes) {
      checksum.add(bytes);
      if (slices == nullptr || !has_spare(*slices, size)) return;
      swap_if_not_native(bytes.data(), bytes.size() / size, size, slices->run.big_endian);
      look_at_spare(slices->run.stored, size, bytes,
                    seen[static_cast<std::size_t>(slices - file.slices.data())]);
    });
  });
  for (std::size_t i = 0; i < seen.size(); ++i)
    file.slices[i].spare = seen[i].zero ? SpareBits::zero : seen[i].sign ? SpareBits::sign : SpareBits::kept;
  if (exact) file.checksum = checksum.value();
}

double times_read_for_envelope(const SourceFiles& source, bool exact) {
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < source.files.size(); ++i) {
    const bool is_read = is_content_read(source, exact, i);
    for (const SlicesInFile& slices : source.files[i].slices)
      bytes += (std::uint64_t{is_read} + (slices.spare == SpareBits::kept)) *
               static_cast<std::uint64_t>(slices.run.slices) * source.shape.slice_bytes();
  }
  return static_cast<double>(bytes) / static_cast<double>(source.shape.bytes());
}

void write_envelope(const SourceFiles& source, const PutBytes& put,
                    const std::function<void(std::size_t)>& next_file) {
  const std::size_t size = size_of(source.shape.type);
  FieldWriter beginning;
  beginning.put(static_cast<std::uint64_t>(source.files.size()));
  beginning.put(static_cast<std::uint16_t>(source.compression.size()));
  beginning.put_bytes(std::as_bytes(std::span(source.compression)));
  put(beginning.bytes());
  for (std::size_t i = 0; i < source.files.size(); ++i) {
    if (next_file) next_file(i);
    const EnvelopeFile& file = source.files[i];
    PlainBytes bytes_of_file(source.pieces[i], source.paths);
    put(description_of(file));
    for_each_stretch(file, source.shape, [&](std::uint64_t begin, std::uint64_t end, const auto* slices) {
      if (slices != nullptr && slices->spare != SpareBits::kept) return;
      read_stretch(bytes_of_file, begin, end, [&](std::span<std::byte> bytes) {
        if (slices != nullptr) {
          const bool big_endian = slices->run.big_endian;
          swap_if_not_native(bytes.data(), bytes.size() / size, size, big_endian);
          leave_only_spare(slices->run.stored, size, bytes);
          swap_if_not_native(bytes.data(), bytes.size() / size, size, big_endian);
        }
        put(bytes);
      });
    });
  }
}

}  // namespace tagrid
