// How DCMTK reads the header of a file that is open already.
#pragma once

// The configuration comes first.
#include <dcmtk/config/osconfig.h>

#include <dcmtk/dcmdata/dcistrma.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <string>

#include "io/files/file_bytes.h"

namespace tagrid {

/// The bytes of an open file, for DCMTK. REQUIRES: the file outlives this.
class HeaderBytes final : public DcmProducer {
 public:
  explicit HeaderBytes(const FileSource& file) : file_(file) {}

  OFBool good() const override { return !failure_; }
  OFCondition status() const override;
  OFBool eos() override { return position_ == file_.size(); }
  offile_off_t avail() override { return static_cast<offile_off_t>(file_.size() - position_); }
  offile_off_t read(void* out, offile_off_t size) override;
  offile_off_t skip(offile_off_t size) override;
  void putback(offile_off_t size) override;
  /// Throws the WorldError that reading has met, if any.
  void require_good() const;

 private:
  const FileSource& file_;
  std::uint64_t position_ = 0;
  std::array<std::byte, 8192> buffer_;
  std::uint64_t begin_ = 0, end_ = 0;  ///< of the bytes of the file that are in buffer_
  std::exception_ptr failure_;
};

/// A stream of them.
class HeaderStream final : public DcmInputStream {
 public:
  explicit HeaderStream(const FileSource& file) : DcmInputStream(&bytes_), path_(file.name()), bytes_(file) {}
  ~HeaderStream() override;

  /// Long values stay in the file; if they are wanted, DCMTK opens it.
  DcmInputStreamFactory* newFactory() const override;
  void require_good() const { bytes_.require_good(); }

 private:
  std::string path_;
  HeaderBytes bytes_;
};

}  // namespace tagrid
