#include "io/formats/dicom/elements.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <span>
#include <utility>

#include "io/errors/errors.h"

namespace tagrid {
namespace {

constexpr std::uint64_t undefined = 0xFFFFFFFF, window = 1 << 16;
constexpr std::size_t most_elements = 1 << 20;
constexpr int deepest = 32;  // items in items
constexpr DicomTag item_tag = {0xFFFE, 0xE000}, item_end = {0xFFFE, 0xE00D}, sequence_end = {0xFFFE, 0xE0DD};

/// Whether the length of a value with this representation has two bytes (PS3.5, 7.1.2).
bool is_short(std::string_view vr) {
  constexpr std::string_view all[] = {"AE", "AS", "AT", "CS", "DA", "DS", "DT", "FD", "FL", "IS", "LO",
                                      "LT", "PN", "SH", "SL", "SS", "ST", "TM", "UI", "UL", "US"};
  return std::ranges::find(all, vr) != std::end(all);
}

bool is_capital(std::uint64_t byte) { return byte >= 'A' && byte <= 'Z'; }

void append(std::string& bytes, std::uint64_t value, std::size_t count, bool big_endian) {
  for (std::size_t i = 0; i < count; ++i)
    bytes += static_cast<char>(value >> (8 * (big_endian ? count - 1 - i : i)) & 0xFF);
}

void append(std::string& bytes, DicomTag tag, DicomCoding coding) {
  append(bytes, tag.group, 2, coding.big_endian);
  append(bytes, tag.element, 2, coding.big_endian);
}

}  // namespace

DicomElements::DicomElements(const ByteSource& file, std::string name)
    : file_(file), name_(std::move(name)) {}

void DicomElements::fail(std::string_view what) const {
  throw BrokenInput("{}: DICOM file: {}", name_, what);
}

std::string DicomElements::bytes(std::uint64_t begin, std::uint64_t end, std::uint64_t most) {
  if (begin > end || end > file_.size()) fail("ends too soon");
  if (end - begin > most) fail(fmt::format("has a value of {} bytes where few are expected", end - begin));
  std::string bytes(end - begin, '\0');
  file_.read_at(begin, std::as_writable_bytes(std::span(bytes)));
  return bytes;
}

std::uint64_t DicomElements::number(std::uint64_t at, std::size_t count, bool big_endian) {
  const std::uint64_t size = file_.size();
  if (at > size || size - at < count) fail("ends too soon");
  if (at < window_at_ || at + count > window_at_ + window_.size()) {
    window_.resize(std::min(window, size - at));
    window_at_ = at;
    file_.read_at(at, window_);
  }
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto byte = std::to_integer<std::uint64_t>(window_[at - window_at_ + i]);
    value |= byte << (8 * (big_endian ? count - 1 - i : i));
  }
  return value;
}

DicomTag DicomElements::tag(std::uint64_t at, DicomCoding coding) {
  return {static_cast<std::uint16_t>(number(at, 2, coding.big_endian)),
          static_cast<std::uint16_t>(number(at + 2, 2, coding.big_endian))};
}

DicomCoding DicomElements::coding_at(std::uint64_t begin) {
  // Groups begin with small numbers. As a length, two capital letters would be that of a large first element.
  return {.is_explicit = is_capital(number(begin + 4, 1, false)) && is_capital(number(begin + 5, 1, false)),
          .big_endian = number(begin, 2, false) > number(begin, 2, true)};
}

bool DicomElements::has_item_at(std::uint64_t begin, DicomCoding coding) {
  return begin + 8 <= file_.size() && tag(begin, coding) == item_tag;
}

DicomElement DicomElements::element(std::uint64_t begin, std::uint64_t end, DicomCoding coding, int depth) {
  DicomElement found{.tag = tag(begin, coding), .vr = "", .begin = begin};
  std::uint64_t head = 8;
  if (coding.is_explicit) {
    for (const std::uint64_t at : {begin + 4, begin + 5}) {
      if (!is_capital(number(at, 1, false))) fail(fmt::format("has no attribute at byte {}", begin));
      found.vr += static_cast<char>(number(at, 1, false));
    }
    head = is_short(found.vr) ? 8 : 12;
  }
  const std::size_t of_length = head == 8 && coding.is_explicit ? 2 : 4;
  const std::uint64_t length = number(begin + head - of_length, of_length, coding.big_endian);
  found.value = begin + head;
  if (length == undefined && of_length == 4) {
    found.length = end_of_items(found.value, end, coding_of_items(found, coding), depth + 1) - found.value;
    found.end = found.value_end() + 8;
  } else {
    found.length = length;
    found.end = found.value_end();
  }
  if (found.end > end) fail(fmt::format("its attribute at byte {} is not complete", begin));
  return found;
}

std::uint64_t DicomElements::end_of_items(std::uint64_t at, std::uint64_t end, DicomCoding coding,
                                          int depth) {
  if (depth > deepest) fail("has too many sequences in each other");
  while (tag(at, coding) != sequence_end) at = end_of_item(at, end, coding, depth);
  return at;
}

std::uint64_t DicomElements::end_of_item(std::uint64_t at, std::uint64_t end, DicomCoding coding, int depth) {
  if (tag(at, coding) != item_tag) fail(fmt::format("has no item of a sequence at byte {}", at));
  const std::uint64_t length = number(at + 4, 4, coding.big_endian);
  at += 8;
  if (length != undefined)
    at += length;
  else {
    while (tag(at, coding) != item_end) at = element(at, end, coding, depth).end;
    at += 8;
  }
  if (at > end) fail("has a sequence that is not complete");
  return at;
}

void DicomElements::add(std::vector<DicomElement>& elements, std::uint64_t begin, std::uint64_t end,
                        DicomCoding coding, DicomTag last) {
  while (begin < end) {
    elements.push_back(at(begin, end, coding));
    if (elements.size() > most_elements) fail("has too many attributes");
    if (elements.back().tag == last) return;
    begin = elements.back().end;
  }
}

std::optional<std::vector<std::vector<DicomElement>>> DicomElements::items(const DicomElement& sequence,
                                                                           DicomCoding coding) {
  coding = coding_of_items(sequence, coding);
  std::vector<std::vector<DicomElement>> items;
  try {
    for (std::uint64_t at = sequence.value; at < sequence.value_end();) {
      const std::uint64_t end = end_of_item(at, sequence.value_end(), coding, 1);
      const bool has_delimiter = number(at + 4, 4, coding.big_endian) == undefined;
      add(items.emplace_back(), at + 8, end - (has_delimiter ? 8 : 0), coding);
      at = end;
    }
  } catch (const BrokenInput&) {
    return std::nullopt;
  }
  return items;
}

std::string dicom_element(DicomTag tag, std::string_view vr, std::string value, DicomCoding coding) {
  if (value.size() % 2 != 0) value += vr == "UI" ? '\0' : ' ';
  std::string bytes;
  append(bytes, tag, coding);
  if (coding.is_explicit) bytes += vr;
  if (coding.is_explicit && is_short(vr)) {
    assert(value.size() <= 0xFFFE);
    append(bytes, value.size(), 2, coding.big_endian);
  } else {
    if (coding.is_explicit) bytes.append(2, '\0');
    append(bytes, value.size(), 4, coding.big_endian);
  }
  return bytes + value;
}

std::string dicom_item(std::string_view elements, DicomCoding coding) {
  std::string bytes;
  append(bytes, item_tag, coding);
  append(bytes, elements.size(), 4, coding.big_endian);
  return bytes.append(elements);
}

}  // namespace tagrid
