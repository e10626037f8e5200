// Numbers of things that HDF5's library has opened.
#pragma once

#include <hdf5.h>

#include <optional>
#include <utility>

namespace tagrid {

/// Closes what it holds.
class Hdf5Handle {
 public:
  Hdf5Handle() = default;
  Hdf5Handle(hid_t id, herr_t (*closes)(hid_t)) : id_(id), close_(closes) {}
  Hdf5Handle(Hdf5Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Hdf5Handle& operator=(Hdf5Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Hdf5Handle() {
    if (id_ >= 0) close_(id_);
  }

  hid_t get() const { return id_; }
  /// Closes it now. Returns false if that fails, as when the library cannot write what it still had to.
  bool close() { return id_ < 0 || close_(std::exchange(id_, -1)) >= 0; }
  explicit operator bool() const { return id_ >= 0; }

 private:
  hid_t id_ = -1;
  herr_t (*close_)(hid_t) = nullptr;
};

namespace internal {
template <class Info>
Info info_type_of(herr_t (*)(hid_t, Info*, unsigned));
}

/// Where an object is in its file; nothing if the handle is none, or the object is damaged.
inline std::optional<haddr_t> address_of(hid_t object) {
  // The type that this function fills has another name in each version of HDF5.
  decltype(internal::info_type_of(&H5Oget_info2)) info = {};
  if (object < 0 || H5Oget_info2(object, &info, H5O_INFO_BASIC) < 0) return std::nullopt;
  return info.addr;
}

}  // namespace tagrid
