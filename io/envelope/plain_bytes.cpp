#include "io/envelope/plain_bytes.h"

#include <algorithm>
#include <cassert>
#include <cstring>

#include "io/errors/errors.h"

namespace tagrid {

PlainBytes::Content::Content(const std::string& path, std::uint64_t offset) : file(path) {
  file.seek(offset);
  bytes.emplace(file, begins_bzip2(file)  ? Compression::bzip2
                      : begins_gzip(file) ? Compression::gzip
                                          : Compression::zlib);
}

std::size_t PlainBytes::Content::read(std::span<std::byte> to) {
  const std::size_t count = bytes->read(to.data(), to.size());
  position += count;
  return count;
}

PlainBytes::PlainBytes(const std::vector<PlainPiece>& pieces, OpenFiles& files)
    : pieces_(pieces), files_(files), sizes_(pieces.size()) {}

void PlainBytes::fail_changed(std::size_t piece) const {
  throw BrokenInput(files_.paths()[pieces_[piece].file] + ": was changed while it was being read");
}

std::uint64_t PlainBytes::size_of(std::size_t number) {
  const PlainPiece& piece = pieces_[number];
  if (piece.kind == PlainPiece::Kind::given) return piece.bytes.size();
  if (piece.size) return *piece.size;
  if (sizes_[number] == 0) {
    Content content(files_.paths()[piece.file], piece.offset);
    std::vector<std::byte> bytes(1 << 16);
    while (content.read(bytes) > 0) {
    }
    sizes_[number] = content.position;
  }
  return sizes_[number];
}

std::uint64_t PlainBytes::size() {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < pieces_.size(); ++i) sum += size_of(i);
  return sum;
}

bool PlainBytes::is_complete() const {
  return std::ranges::none_of(
      pieces_, [](const PlainPiece& piece) { return piece.kind == PlainPiece::Kind::samples; });
}

bool PlainBytes::has_bytes(std::uint64_t begin, std::uint64_t end) {
  std::uint64_t position = 0;
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const std::uint64_t next = position + size_of(i);
    if (pieces_[i].kind == PlainPiece::Kind::samples && position < end && next > begin) return false;
    position = next;
  }
  return true;
}

void PlainBytes::read_at(std::uint64_t position, std::span<std::byte> to) {
  std::uint64_t begin = 0;
  for (std::size_t i = 0; i < pieces_.size() && !to.empty(); ++i) {
    const std::uint64_t end = begin + size_of(i);
    if (position < end) {
      const std::size_t count = std::min<std::uint64_t>(to.size(), end - position);
      read_piece(i, position - begin, to.first(count));
      position += count;
      to = to.subspan(count);
    }
    begin = end;
  }
  assert(to.empty());
}

void PlainBytes::read_piece(std::size_t number, std::uint64_t position, std::span<std::byte> to) {
  const PlainPiece& piece = pieces_[number];
  switch (piece.kind) {
    case PlainPiece::Kind::given:
      std::memcpy(to.data(), piece.bytes.data() + position, to.size());
      return;
    case PlainPiece::Kind::stretch:
      if (!file_ || number_of_file_ != piece.file) file_ = files_.file(piece.file);
      number_of_file_ = piece.file;
      if (file_->size() < piece.offset + position + to.size()) fail_changed(number);
      file_->read_at(piece.offset + position, to);
      return;
    case PlainPiece::Kind::content:
      read_content(number, position, to);
      return;
    case PlainPiece::Kind::samples:
      assert(false);
  }
}

void PlainBytes::read_content(std::size_t number, std::uint64_t position, std::span<std::byte> to) {
  const PlainPiece& piece = pieces_[number];
  if (!content_ || piece_of_content_ != number || content_->position > position) {
    content_.reset();
    content_ = std::make_unique<Content>(files_.paths()[piece.file], piece.offset);
    piece_of_content_ = number;
  }
  std::vector<std::byte> skipped(std::min<std::uint64_t>(position - content_->position, 1 << 16));
  while (content_->position < position) {
    const std::uint64_t left = position - content_->position;
    if (content_->read(std::span(skipped).first(std::min<std::uint64_t>(left, skipped.size()))) == 0)
      fail_changed(number);
  }
  if (content_->read(to) != to.size()) fail_changed(number);
  // A stream is checked only at its end.
  std::byte more;
  if (content_->position == size_of(number) && content_->read({&more, 1}) != 0) fail_changed(number);
}

}  // namespace tagrid
