// One TIFF file: its pages, their samples, and its plain form. On libtiff
// (https://libtiff.gitlab.io/libtiff/).
#pragma once

#include <tiffio.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/formats/tiff/reader/tiff_page.h"
#include "io/programs/reader_conversation.h"

namespace tagrid {

class TiffFile {
 public:
  /// Throws WorldError if the file cannot be opened, BrokenInput if it is not a TIFF file.
  explicit TiffFile(const std::string& path);

  const std::string& path() const { return path_; }
  std::uint64_t size() const { return size_; }

  /// All pages but previews and masks, in the order of the file. Throws BrokenInput for a page that is
  /// broken, or whose samples are not single numbers of a type that tagrid knows.
  std::vector<TiffPage> pages();
  /// ImageDescription of the current page: before pages(), of the first one. "" if there is none.
  std::string description() const;
  /// What users should know of the pages that pages() gave, and of the samples that read() gave.
  const TiffRemarks& remarks() const { return remarks_; }

  /// Reads the samples of a page, in the byte order of memory. Throws BrokenInput.
  void read(const TiffPage& page, std::byte* out);

 private:
  struct Samples {
    SampleType type;
    int packed_bits = 0;
  };
  TiffPage size_of_page() const;
  bool is_preview_or_mask(const TiffPage& page, const std::vector<TiffPage>& slices) const;
  TiffPage current_page();
  void require_readable(const TiffPage& page) const;
  void require_single_numbers() const;
  Samples kind_of_samples();
  void check_pieces(TiffPage& page) const;
  std::vector<std::uint64_t> replaced_counts(const TiffPage& page) const;
  void require_all_places(const TiffPage& page) const;
  void look_at_tags(TiffPage& first);
  void look_at_values(TiffPage& page);
  void look_at_sub_images(const TiffPage& page);
  void look_at_left_out(const std::vector<TiffPage>& pages, const std::vector<TiffPage>& left_out);
  std::optional<std::uint64_t> plain_place(const TiffPage& page) const;
  std::uint64_t memory_for_page() const;
  bool is_unwritten(std::uint32_t piece) const;
  [[noreturn]] void fail_in(std::uint32_t piece) const;
  void check_stream(std::uint32_t piece, std::uint64_t least, std::uint64_t most);
  void read_strips(const TiffPage& page, std::byte* out);
  void read_tiles(const TiffPage& page, std::byte* out);
  [[noreturn]] void fail(const std::string& why) const;

  struct Close {
    void operator()(TIFF* tiff) const { TIFFClose(tiff); }
  };
  std::string path_;
  std::uint64_t size_ = 0;
  TiffRemarks remarks_;
  std::unique_ptr<TIFF, Close> tiff_;
  std::vector<std::byte> stream_;  ///< of a strip or tile
};

/// The plain form of the file at `path`, which is number `number` among those of its volume; `pages` are
/// those of its pages that are slices, in the order of the volume. Their samples lie one after the other from
/// `samples_at` on, and all directories come after them. Pages keep all tags but those that say how samples
/// are stored: they become uncompressed, in one strip each, and packed samples get 8 or 16 bits. Pages that
/// are not slices of the volume keep their strips as they are; but if they are compressed and of full size,
/// there is no plain form. The file is BigTIFF if it was, or if it would be too large otherwise. Without a
/// plain form, `why_not` is given. Throws WorldError.
ReaderPlainFile plain_tiff_file(const std::string& path, std::size_t number,
                                const std::vector<const TiffPage*>& pages, std::uint64_t& samples_at);

}  // namespace tagrid
