#include "io/formats/dicom/reader/header_stream.h"

#include <dcmtk/dcmdata/dcerror.h>
#include <dcmtk/dcmdata/dcistrmf.h>

#include <algorithm>
#include <cstring>
#include <span>

#include "io/errors/errors.h"
#include "io/text/paths.h"

namespace tagrid {

OFCondition HeaderBytes::status() const { return failure_ ? EC_InvalidStream : EC_Normal; }

offile_off_t HeaderBytes::read(void* out, offile_off_t size) {
  const auto left =
      std::min(static_cast<std::uint64_t>(std::max<offile_off_t>(size, 0)), file_.size() - position_);
  std::span<std::byte> to(static_cast<std::byte*>(out), static_cast<std::size_t>(left));
  while (!failure_ && !to.empty()) try {
      if (position_ < begin_ || position_ >= end_) {
        begin_ = position_;
        end_ = std::min(begin_ + buffer_.size(), file_.size());
        file_.read_at(begin_, std::span(buffer_).first(static_cast<std::size_t>(end_ - begin_)));
      }
      const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(to.size(), end_ - position_));
      std::memcpy(to.data(), buffer_.data() + (position_ - begin_), count);
      position_ += count;
      to = to.subspan(count);
    } catch (const WorldError&) {
      // DCMTK's functions do not expect exceptions.
      failure_ = std::current_exception();
      end_ = begin_;
    }
  return static_cast<offile_off_t>(left - to.size());
}

offile_off_t HeaderBytes::skip(offile_off_t size) {
  const auto count =
      std::min(static_cast<std::uint64_t>(std::max<offile_off_t>(size, 0)), file_.size() - position_);
  position_ += count;
  return static_cast<offile_off_t>(count);
}

void HeaderBytes::putback(offile_off_t size) {
  position_ -= std::min(static_cast<std::uint64_t>(std::max<offile_off_t>(size, 0)), position_);
}

void HeaderBytes::require_good() const {
  if (failure_) std::rethrow_exception(failure_);
}

HeaderStream::~HeaderStream() = default;

DcmInputStreamFactory* HeaderStream::newFactory() const {
  // As its own streams of files: not if what was read so far is inflated.
  return currentProducer() == &bytes_
             ? new DcmInputFileStreamFactory(OFFilename(path_of(path_).c_str()), tell())
             : nullptr;
}

}  // namespace tagrid
