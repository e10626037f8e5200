#include "io/formats/dicom/exported.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "io/bytes/checksum.h"
#include "io/errors/errors.h"
#include "io/formats/dicom/elements.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr std::uint64_t preamble = 128 + 4;  // bytes, with the magic
constexpr DicomTag media_class = {0x0002, 0x0002}, media_instance = {0x0002, 0x0003},
                   transfer_syntax = {0x0002, 0x0010}, image_type = {0x0008, 0x0008},
                   sop_class = {0x0008, 0x0016}, sop_instance = {0x0008, 0x0018}, series = {0x0020, 0x000E},
                   concatenation = {0x0020, 0x9161}, description = {0x0008, 0x2111},
                   source_images = {0x0008, 0x2112}, derivation_codes = {0x0008, 0x9215},
                   frame_type = {0x0008, 0x9007}, lossy = {0x0028, 0x2110}, lossy_ratio = {0x0028, 0x2112},
                   lossy_method = {0x0028, 0x2114}, shared_groups = {0x5200, 0x9229},
                   groups_of_frames = {0x5200, 0x9230}, pixel_data = {0x7FE0, 0x0010};
/// The extremes of the samples, which a loss changes: of the image and of the series.
constexpr DicomTag extremes[] = {{0x0028, 0x0106}, {0x0028, 0x0107}, {0x0028, 0x0108}, {0x0028, 0x0109}};
/// What signs the data set, with its UIDs; and the distance to its end, which nobody uses any more.
constexpr DicomTag no_longer_true[] = {{0x4FFE, 0x0001}, {0xFFFA, 0xFFFA}, {0x0008, 0x0001}};

constexpr std::size_t longest_description = 1024;  // of an ST
constexpr std::string_view original = "ORIGINAL", derived = "DERIVED";

class Export {
 public:
  Export(const ByteSource& file, const std::string& name, const DicomExport& how)
      : size_(file.size()), name_(name), elements_(file, name), how_(how) {}

  std::vector<PlainPiece> pieces() {
    const bool has_magic = size_ >= preamble && elements_.bytes(preamble - 4, preamble) == "DICM";
    if (has_magic) read_meta();
    const bool is_long = begin_ + 8 <= size_;
    if (is_long) coding_ = elements_.coding_at(begin_);
    // Without the magic, only a data set that begins as those of images do is one.
    if (!has_magic && (!is_long || elements_.tag(begin_, coding_).group != image_type.group))
      throw BrokenInput(name_ +
                        ": is not a DICOM file, and only volumes from DICOM files can become a DICOM series; "
                        "choose another format, such as nrrd or nifti");
    if (!is_long) elements_.fail("ends too soon");
    read_data_set();
    change();
    write_meta();
    write_data_set();
    return std::move(pieces_);
  }

 private:
  static constexpr DicomCoding coding_of_meta = {true, false};

  void read_meta() {
    begin_ = preamble;
    while (begin_ + 2 <= size_ && elements_.bytes(begin_, begin_ + 2) == std::string_view("\2\0", 2)) {
      meta_.push_back(elements_.at(begin_, size_, coding_of_meta));
      begin_ = meta_.back().end;
    }
  }

  void read_data_set() {
    elements_.add(data_set_, begin_, size_, coding_, pixel_data);
    if (data_set_.empty() || data_set_.back().tag != pixel_data)
      elements_.fail("has no samples in PixelData, so it is not exported");
    const DicomElement pixels = data_set_.back();
    const bool has_fragments = pixels.end != pixels.value_end();
    const auto syntax = found(meta_, transfer_syntax);
    // Of compressed files, the plain form is restored. Plain samples in fragments (PS3.5, A.4.11) stay there.
    constexpr std::string_view plain_fragments = "1.2.840.10008.1.2.1.98";
    if (has_fragments && (!syntax || text(*syntax) != plain_fragments))
      elements_.fail("has compressed samples, which cannot be exported");
    try {
      elements_.add(data_set_, pixels.end, size_, coding_);
    } catch (const BrokenInput&) {
      // Bytes that are no attribute stay at the end.
    }
  }

  static std::optional<DicomElement> found(const std::vector<DicomElement>& elements, DicomTag tag) {
    const auto element = std::ranges::find(elements, tag, &DicomElement::tag);
    return element == elements.end() ? std::nullopt : std::optional(*element);
  }
  std::string text(const DicomElement& element) {
    std::string bytes = elements_.bytes(element.value, element.value_end());
    bytes.resize(bytes.find_last_not_of(std::string_view(" \0", 2)) + 1);
    return bytes;
  }
  /// The value of an attribute of the data set; "" if it is absent.
  std::string text(DicomTag tag) {
    const auto element = found(data_set_, tag);
    return element ? text(*element) : "";
  }
  std::vector<std::string> values(DicomTag tag) {
    const std::string all = text(tag);
    std::vector<std::string> values;
    if (all.empty()) return values;
    for (const std::string_view value : split(all, '\\')) values.emplace_back(value);
    return values;
  }

  void set(DicomTag tag, std::string_view vr, std::string value) {
    constexpr std::size_t longest = 0xFFFE;  // of a length of two bytes
    if (value.size() > longest)
      elements_.fail(
          fmt::format("its attribute ({:04X},{:04X}) has no room for more", tag.group, tag.element));
    changed_[tag] = dicom_element(tag, vr, std::move(value), coding_);
  }
  void remove(DicomTag tag) {
    if (found(data_set_, tag)) changed_[tag] = "";
  }

  /// Adds an item to a sequence, which may not be there yet.
  template <class Elements>
  void add_item(DicomTag tag, Elements elements) {
    const auto earlier = found(data_set_, tag);
    const DicomCoding coding = earlier ? coding_of_items(*earlier, coding_) : coding_;
    std::string items = earlier ? elements_.bytes(earlier->value, earlier->value_end(), 1 << 24) : "";
    // An item without a length has its delimiter among these bytes.
    items += dicom_item(elements(coding), coding);
    changed_[tag] =
        dicom_element(tag, earlier && earlier->vr == "UN" ? "UN" : "SQ", std::move(items), coding_);
  }
  static std::string code(std::string value, std::string meaning, DicomCoding coding) {
    return dicom_element({0x0008, 0x0100}, "SH", std::move(value), coding) +
           dicom_element({0x0008, 0x0102}, "SH", "DCM", coding) +
           dicom_element({0x0008, 0x0104}, "LO", std::move(meaning), coding);
  }

  /// A UID that follows from this one and from what was done: the number of a UUID (PS3.5, B.2).
  std::string new_uid(const std::string& uid) const {
    // Of version 8 and variant 2 (RFC 9562): all other bits are the checksum's.
    auto [high, low] = wide_checksum_of(how_.done + '\0' + uid);
    high = (high & ~std::uint64_t{0xF000}) | 0x8000;
    low = (low & ~(std::uint64_t{3} << 62)) | std::uint64_t{2} << 62;
    return "2.25." + decimal(high, low);
  }
  static std::string decimal(std::uint64_t high, std::uint64_t low) {
    __extension__ using Wide = unsigned __int128;
    std::string digits;
    for (Wide number = static_cast<Wide>(high) << 64 | low; number > 0; number /= 10)
      digits += static_cast<char>('0' + static_cast<int>(number % 10));
    return {digits.rbegin(), digits.rend()};
  }

  void change() {
    const std::string instance = text(sop_instance), in_series = text(series);
    class_ = text(sop_class);
    if (class_.empty() || instance.empty() || in_series.empty())
      elements_.fail("has no SOPClassUID, SOPInstanceUID or SeriesInstanceUID, so no new ones can be made");
    instance_ = new_uid(instance);
    set(sop_instance, "UI", instance_);
    set(series, "UI", new_uid(in_series));
    // Its parts have new UIDs.
    if (const std::string uid = text(concatenation); !uid.empty()) set(concatenation, "UI", new_uid(uid));
    add_item(source_images, [&](DicomCoding coding) {
      return dicom_element({0x0008, 0x1150}, "UI", class_, coding) +
             dicom_element({0x0008, 0x1155}, "UI", instance, coding) +
             (how_.loss.empty() ? "" : purpose(coding));
    });
    if (!how_.loss.empty())
      mark_as_lossy();
    else if (how_.was_lossy)
      set(lossy, "CS", "01");
    for (const DicomTag tag : no_longer_true) remove(tag);
    // Lengths of groups, which no longer have to be there.
    for (const auto& [tag, bytes] : std::map(changed_)) remove({tag.group, 0});
  }

  static std::string purpose(DicomCoding coding) {
    return dicom_element({0x0040, 0xA170}, "SQ",
                         dicom_item(code("121320", "Uncompressed predecessor", coding), coding), coding);
  }

  void mark_as_lossy() {
    set(lossy, "CS", "01");
    std::vector<std::string> ratios = values(lossy_ratio), methods = values(lossy_method);
    // Both have a value for each compression (PS3.3, C.7.6.1.1.5).
    const std::size_t earlier = std::max(ratios.size(), methods.size());
    ratios.resize(earlier);
    methods.resize(earlier);
    ratios.push_back(fmt::format("{:.6g}", how_.ratio));
    methods.emplace_back("TAGRID");
    set(lossy_ratio, "DS", fmt::format("{}", fmt::join(ratios, "\\")));
    set(lossy_method, "CS", fmt::format("{}", fmt::join(methods, "\\")));
    if (std::vector<std::string> types = values(image_type); !types.empty()) {
      types[0] = derived;
      set(image_type, "CS", fmt::format("{}", fmt::join(types, "\\")));
    }
    // One that leaves no room for this is in the original.
    const std::string earlier_words = text(description), both = earlier_words + "; " + how_.loss;
    set(description, "ST", earlier_words.empty() || both.size() > longest_description ? how_.loss : both);
    add_item(derivation_codes,
             [](DicomCoding coding) { return code("113040", "Lossy Compression", coding); });
    for (const DicomTag tag : extremes) remove(tag);
    for (const DicomTag tag : {shared_groups, groups_of_frames})
      if (const auto groups = found(data_set_, tag)) find_frame_types(*groups);
  }

  /// Frames are derived as the image is. Their number stays, so the lengths around them do, too.
  void find_frame_types(const DicomElement& groups) {
    const DicomCoding coding = coding_of_items(groups, coding_);
    const auto items = elements_.items(groups, coding_);
    if (!items) return;
    for (const auto& group : *items)
      for (const DicomElement& macro : group) {
        const bool may_have_items = macro.vr == "SQ" || macro.vr == "UN" || macro.vr.empty();
        const DicomCoding inner = coding_of_items(macro, coding);
        if (!may_have_items || macro.tag.group % 2 != 0 || !elements_.has_item_at(macro.value, inner))
          continue;
        const auto inner_items = elements_.items(macro, coding);
        if (!inner_items) continue;
        for (const auto& item : *inner_items)
          if (const auto type = found(item, frame_type)) change_frame_type(*type);
      }
  }
  void change_frame_type(const DicomElement& type) {
    const std::string bytes = elements_.bytes(type.value, type.value_end());
    if (!bytes.starts_with(original)) return;
    std::string now = std::string(derived) + bytes.substr(original.size());
    now.resize(bytes.size(), ' ');  // blanks at the end mean nothing
    in_place_[type.value] = std::move(now);
  }

  void give(std::string bytes) {
    if (bytes.empty()) return;
    if (!pieces_.empty() && pieces_.back().kind == PlainPiece::Kind::given)
      pieces_.back().bytes += bytes;
    else
      pieces_.push_back(PlainPiece::given(std::move(bytes)));
  }
  void keep(std::uint64_t begin, std::uint64_t end) {
    if (begin == end) return;
    PlainPiece* last = pieces_.empty() ? nullptr : &pieces_.back();
    if (last != nullptr && last->kind == PlainPiece::Kind::stretch && last->offset + *last->size == begin)
      *last->size += end - begin;
    else
      pieces_.push_back(PlainPiece::stretch(0, begin, end));
  }

  void write_meta() {
    if (meta_.empty()) return write_new_meta();
    keep(0, preamble);
    std::string rest;
    bool has_instance = false, has_length = false;
    for (const DicomElement& element : meta_) {
      if (element.tag == DicomTag{0x0002, 0x0000}) {
        has_length = true;
        continue;
      }
      has_instance = has_instance || element.tag == media_instance;
      rest += element.tag == media_instance ? dicom_element(media_instance, "UI", instance_, coding_of_meta)
                                            : elements_.bytes(element.begin, element.end);
    }
    if (!has_instance) elements_.fail("its meta information has no MediaStorageSOPInstanceUID");
    if (has_length) give(length_of_meta(rest));
    give(std::move(rest));
  }
  /// Of a file that has none.
  void write_new_meta() {
    const std::string syntax = coding_.big_endian    ? "1.2.840.10008.1.2.2"
                               : coding_.is_explicit ? "1.2.840.10008.1.2.1"
                                                     : "1.2.840.10008.1.2";
    const std::string rest = dicom_element({0x0002, 0x0001}, "OB", std::string("\0\1", 2), coding_of_meta) +
                             dicom_element(media_class, "UI", class_, coding_of_meta) +
                             dicom_element(media_instance, "UI", instance_, coding_of_meta) +
                             dicom_element(transfer_syntax, "UI", syntax, coding_of_meta) +
                             dicom_element({0x0002, 0x0012}, "UI", new_uid("tagrid"), coding_of_meta);
    give(std::string(preamble - 4, '\0') + "DICM" + length_of_meta(rest) + rest);
  }
  static std::string length_of_meta(const std::string& rest) {
    std::string length;
    for (int i = 0; i < 4; ++i) length += static_cast<char>(rest.size() >> (8 * i) & 0xFF);
    return dicom_element({0x0002, 0x0000}, "UL", length, coding_of_meta);
  }

  void write_data_set() {
    auto next = changed_.begin();
    for (const DicomElement& element : data_set_) {
      // New attributes have their places in the order of tags.
      for (; next != changed_.end() && next->first < element.tag; ++next)
        if (written_.insert(next->first).second) give(next->second);
      if (const auto change = changed_.find(element.tag); change != changed_.end()) {
        if (written_.insert(element.tag).second) give(change->second);
        continue;
      }
      keep_with_changes(element.begin, element.end);
    }
    keep(data_set_.back().end, size_);
  }
  void keep_with_changes(std::uint64_t begin, std::uint64_t end) {
    for (auto change = in_place_.lower_bound(begin); change != in_place_.end() && change->first < end;
         ++change) {
      keep(begin, change->first);
      give(change->second);
      begin = change->first + change->second.size();
    }
    keep(begin, end);
  }

  std::uint64_t size_;
  std::string name_;
  DicomElements elements_;
  const DicomExport& how_;
  DicomCoding coding_;
  std::uint64_t begin_ = 0;  ///< of the data set
  std::vector<DicomElement> meta_, data_set_;
  std::string class_, instance_;
  std::map<DicomTag, std::string> changed_;        ///< new elements; "" for those that go
  std::map<std::uint64_t, std::string> in_place_;  ///< changed bytes of other elements, by their positions
  std::set<DicomTag> written_;
  std::vector<PlainPiece> pieces_;
};

}  // namespace

std::vector<PlainPiece> exported_dicom_file(const ByteSource& file, const std::string& name,
                                            const DicomExport& how) {
  return Export(file, name, how).pieces();
}

}  // namespace tagrid
