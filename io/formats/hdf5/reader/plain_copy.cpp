#include "io/formats/hdf5/reader/plain_copy.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/formats/hdf5/handle.h"
#include "io/programs/serve.h"
#include "io/programs/stored_samples.h"
#include "io/system/files.h"
#include "io/system/this_process.h"

namespace tagrid {
namespace {

/// The copy, in which what was never written takes no memory. All functions throw WorldError.
class CopiedFile {
 public:
  const FileForLibrary& file() const { return file_; }
  std::uint64_t size() const { return FileSource(file_.path()).size(); }
  /// Bytes that it takes.
  std::uint64_t stored() const {
    FileStatus status;
    if (!files().status(file_.path(), true, status))
      throw world_error("cannot look at", "the copy of an HDF5 file", errno);
    return status.stored;
  }
  /// REQUIRES: begin <= end <= size().
  std::string bytes(std::uint64_t begin, std::uint64_t end) const {
    std::string bytes(end - begin, '\0');
    FileSource(file_.path()).read_at(begin, std::as_writable_bytes(std::span(bytes)));
    return bytes;
  }

 private:
  FileForLibrary file_;
};

/// Groups in groups: links are untrusted input.
constexpr int deepest_group = 64;

/// A handle of what the library has opened or made.
Hdf5Handle made(hid_t id, herr_t (*closes)(hid_t), const char* what) {
  if (id < 0) throw NoPlainForm{fmt::format("{} cannot be copied", what)};
  return {id, closes};
}

void require_copied(bool done, const char* what) {
  if (!done) throw NoPlainForm{fmt::format("{} cannot be copied", what)};
}

haddr_t known_address(hid_t object) {
  const auto address = address_of(object);
  require_copied(address.has_value(), "one of its objects");
  return *address;
}

std::vector<std::string> names_of_links(hid_t group, H5_index_t index) {
  std::vector<std::string> names;
  const auto add = [](hid_t, const char* name, const H5L_info_t*, void* all) -> herr_t {
    static_cast<std::vector<std::string>*>(all)->emplace_back(name);
    return 0;
  };
  require_copied(H5Literate(group, index, H5_ITER_INC, nullptr, add, &names) >= 0, "one of its groups");
  return names;
}

std::vector<std::string> names_of_attributes(hid_t object) {
  std::vector<std::string> names;
  const auto add = [](hid_t, const char* name, const H5A_info_t*, void* all) -> herr_t {
    static_cast<std::vector<std::string>*>(all)->emplace_back(name);
    return 0;
  };
  // The order in which they were made is not always kept.
  if (H5Aiterate2(object, H5_INDEX_CRT_ORDER, H5_ITER_INC, nullptr, add, &names) >= 0) return names;
  names.clear();
  require_copied(H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_INC, nullptr, add, &names) >= 0,
                 "its attributes");
  return names;
}

/// Sets for a new group, or the root of a new file, what was chosen for another one. (A list of properties
/// that the library gives of a group also has places in its file.)
void set_like(hid_t group, hid_t properties) {
  const Hdf5Handle old = made(H5Gget_create_plist(group), H5Pclose, "one of its groups");
  unsigned order = 0, most_compact = 0, least_dense = 0, links = 0, name_length = 0;
  if (H5Pget_link_creation_order(old.get(), &order) >= 0) H5Pset_link_creation_order(properties, order);
  if (H5Pget_attr_creation_order(old.get(), &order) >= 0) H5Pset_attr_creation_order(properties, order);
  if (H5Pget_link_phase_change(old.get(), &most_compact, &least_dense) >= 0)
    H5Pset_link_phase_change(properties, most_compact, least_dense);
  if (H5Pget_attr_phase_change(old.get(), &most_compact, &least_dense) >= 0)
    H5Pset_attr_phase_change(properties, most_compact, least_dense);
  if (H5Pget_est_link_info(old.get(), &links, &name_length) >= 0)
    H5Pset_est_link_info(properties, links, name_length);
  H5Pset_obj_track_times(properties, false);  // the same bytes at any time
}

/// The values of an attribute in memory; what the library has allocated for them goes with them.
class AttributeValues {
 public:
  AttributeValues(hid_t attribute, std::uint64_t most)
      : type_(made(H5Aget_type(attribute), H5Tclose, "one of its attributes")),
        space_(made(H5Aget_space(attribute), H5Sclose, "one of its attributes")) {
    const hssize_t count = H5Sget_simple_extent_npoints(space_.get());
    require_copied(count >= 0, "one of its attributes");
    size_ = H5Tget_size(type_.get());
    std::uint64_t bytes = 0;
    if (__builtin_mul_overflow(static_cast<std::uint64_t>(count), size_, &bytes) || bytes > most)
      throw NoPlainForm{"one of its attributes is too large"};
    values_.resize(bytes);
    if (!values_.empty())
      require_copied(H5Aread(attribute, type_.get(), values_.data()) >= 0, "one of its attributes");
  }
  ~AttributeValues() {
    if (!values_.empty()) H5Dvlen_reclaim(type_.get(), space_.get(), H5P_DEFAULT, values_.data());
  }
  AttributeValues(const AttributeValues&) = delete;
  AttributeValues& operator=(const AttributeValues&) = delete;

  hid_t type() const { return type_.get(); }
  hid_t space() const { return space_.get(); }
  bool is_empty() const { return values_.empty(); }
  std::byte* data() { return values_.data(); }
  std::size_t count() const { return size_ == 0 ? 0 : values_.size() / size_; }

 private:
  Hdf5Handle type_, space_;
  std::size_t size_ = 0;
  std::vector<std::byte> values_;
};

class Copy {
 public:
  Copy(const std::string& path, hid_t dataset)
      : old_(made(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose, "the file")),
        target_(dataset),
        target_address_(known_address(dataset)),
        old_file_(path),
        new_(make_file()) {
    const Hdf5Handle root = made(H5Gopen2(old_.get(), "/", H5P_DEFAULT), H5Gclose, "its root"),
                     new_root = made(H5Gopen2(new_.get(), "/", H5P_DEFAULT), H5Gclose, "its root");
    copies_[known_address(root.get())] = "/";
    objects_.emplace_back(known_address(root.get()), "/");
    copy_group(root.get(), new_root.get(), "/", 0);
    if (!found_) throw NoPlainForm{"no link in it leads to the data set"};
    // References can lead to what was copied later.
    for (const auto& [address, name] : objects_) copy_attributes(address, name);
  }

  /// Where the samples begin. The file is complete from then on.
  std::uint64_t finish() {
    const Hdf5Handle dataset = made(H5Dopen2(new_.get(), copies_.at(target_address_).c_str(), H5P_DEFAULT),
                                    H5Dclose, "the data set");
    const haddr_t offset = H5Dget_offset(dataset.get());
    require_copied(offset != HADDR_UNDEF, "the data set");
    require_copied(H5Fflush(new_.get(), H5F_SCOPE_GLOBAL) >= 0, "the file");
    return offset;
  }
  void close() { require_copied(new_.close(), "the file"); }
  /// What programs that know nothing of HDF5 put in front.
  std::string user_block() const {
    std::string bytes(user_block_, '\0');
    if (old_file_.size() < user_block_) throw NoPlainForm{"it ends too soon"};
    old_file_.read_at(0, std::as_writable_bytes(std::span(bytes)));
    return bytes;
  }
  const CopiedFile& file() const { return copy_; }

  /// What may still be copied. Throws NoPlainForm if that is not even `wanted`.
  std::uint64_t room_for(std::uint64_t wanted) const {
    const std::uint64_t taken = copy_.stored();
    if (taken + wanted > most_around_samples)
      throw NoPlainForm{
          fmt::format("it has more than {} MiB besides these samples{}", most_around_samples >> 20,
                      has_holes_ ? "" : ", or the folder for temporary files has no files with holes")};
    return most_around_samples - taken;
  }

 private:
  Hdf5Handle make_file() {
    const Hdf5Handle before = made(H5Fget_create_plist(old_.get()), H5Pclose, "the file"),
                     root = made(H5Gopen2(old_.get(), "/", H5P_DEFAULT), H5Gclose, "its root"),
                     properties = made(H5Pcreate(H5P_FILE_CREATE), H5Pclose, "the file");
    set_like(root.get(), properties.get());
    const Hdf5Handle access = made(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "the file");
    // The usual driver looks for the name of a file. Only that one takes names of all letters on Windows.
    if (!FileForLibrary::has_name()) require_copied(H5Pset_fapl_stdio(access.get()) >= 0, "the file");
    require_copied(H5Pget_userblock(before.get(), &user_block_) >= 0 &&
                       H5Pset_userblock(properties.get(), user_block_) >= 0,
                   "the file");
    room_for(user_block_);
    H5F_info2_t info = {};
    require_copied(H5Fget_info2(old_.get(), &info) >= 0, "the file");
    if (info.super.version >= 2) H5Pset_libver_bounds(access.get(), H5F_LIBVER_V18, H5F_LIBVER_LATEST);
    Hdf5Handle file =
        made(H5Fcreate(copy_.file().path().c_str(), H5F_ACC_TRUNC, properties.get(), access.get()), H5Fclose,
             "the file");
    has_holes_ = copy_.file().leave_holes();
    return file;
  }

  /// Copies all links of a group, whose copy is named `name`, and what they lead to.
  void copy_group(hid_t group, hid_t copy, const std::string& name, int depth) {
    if (depth > deepest_group) throw NoPlainForm{"its groups are too deep"};
    const Hdf5Handle properties = made(H5Gget_create_plist(group), H5Pclose, "one of its groups");
    unsigned order = 0;
    H5Pget_link_creation_order(properties.get(), &order);
    for (const std::string& link :
         names_of_links(group, (order & H5P_CRT_ORDER_TRACKED) != 0 ? H5_INDEX_CRT_ORDER : H5_INDEX_NAME)) {
      say_working();
      room_for(0);
      H5L_info_t info = {};
      require_copied(H5Lget_info(group, link.c_str(), &info, H5P_DEFAULT) >= 0, "one of its links");
      const Hdf5Handle links = made(H5Pcreate(H5P_LINK_CREATE), H5Pclose, "one of its links");
      H5Pset_char_encoding(links.get(), info.cset);
      if (info.type == H5L_TYPE_HARD)
        copy_object(group, copy, link, (name == "/" ? "" : name) + "/" + link, links.get(), depth);
      else
        copy_link(group, copy, link, info, links.get());
    }
  }

  void copy_link(hid_t group, hid_t copy, const std::string& link, const H5L_info_t& info, hid_t properties) {
    if (info.type != H5L_TYPE_SOFT && info.type != H5L_TYPE_EXTERNAL)
      throw NoPlainForm{"it has links of an unknown kind"};
    room_for(info.u.val_size);
    std::vector<char> value(info.u.val_size + 1);
    require_copied(H5Lget_val(group, link.c_str(), value.data(), info.u.val_size, H5P_DEFAULT) >= 0,
                   "one of its links");
    if (info.type == H5L_TYPE_SOFT) {
      require_copied(H5Lcreate_soft(value.data(), copy, link.c_str(), properties, H5P_DEFAULT) >= 0,
                     "one of its links");
      return;
    }
    const char *file = nullptr, *object = nullptr;
    require_copied(H5Lunpack_elink_val(value.data(), info.u.val_size, nullptr, &file, &object) >= 0 &&
                       H5Lcreate_external(file, object, copy, link.c_str(), properties, H5P_DEFAULT) >= 0,
                   "one of its links");
  }

  void copy_object(hid_t group, hid_t copy, const std::string& link, const std::string& name, hid_t links,
                   int depth) {
    const Hdf5Handle object = made(H5Oopen(group, link.c_str(), H5P_DEFAULT), H5Oclose, "one of its objects");
    const haddr_t address = known_address(object.get());
    if (const auto known = copies_.find(address); known != copies_.end()) {
      require_copied(
          H5Lcreate_hard(new_.get(), known->second.c_str(), copy, link.c_str(), links, H5P_DEFAULT) >= 0,
          "one of its links");
      return;
    }
    copies_[address] = name;
    objects_.emplace_back(address, name);
    if (address == target_address_) {
      make_contiguous(copy, link, links);
    } else if (H5Iget_type(object.get()) == H5I_GROUP) {
      const Hdf5Handle properties = made(H5Pcreate(H5P_GROUP_CREATE), H5Pclose, "one of its groups");
      set_like(object.get(), properties.get());
      const Hdf5Handle made_group = made(H5Gcreate2(copy, link.c_str(), links, properties.get(), H5P_DEFAULT),
                                         H5Gclose, "one of its groups");
      copy_group(object.get(), made_group.get(), name, depth + 1);
    } else {
      copy_whole(object.get(), group, copy, link, links);
    }
  }

  /// Other data sets stay as they are stored.
  void copy_whole(hid_t object, hid_t group, hid_t copy, const std::string& link, hid_t links) {
    if (H5Iget_type(object) == H5I_DATASET) {
      const Hdf5Handle type = made(H5Dget_type(object), H5Tclose, "one of its data sets");
      if (H5Tdetect_class(type.get(), H5T_REFERENCE) > 0) throw NoPlainForm{"it has data sets of references"};
      room_for(H5Dget_storage_size(object));
    }
    const Hdf5Handle options = made(H5Pcreate(H5P_OBJECT_COPY), H5Pclose, "one of its objects");
    H5Pset_copy_object(options.get(), H5O_COPY_WITHOUT_ATTR_FLAG);
    require_copied(H5Ocopy(group, link.c_str(), copy, link.c_str(), options.get(), links) >= 0,
                   "one of its objects");
  }

  void make_contiguous(hid_t copy, const std::string& link, hid_t links) {
    constexpr const char* what = "the data set";
    const Hdf5Handle type_in_file = made(H5Dget_type(target_), H5Tclose, what),
                     type = made(H5Tcopy(type_in_file.get()), H5Tclose, what),
                     space_in_file = made(H5Dget_space(target_), H5Sclose, what),
                     before = made(H5Dget_create_plist(target_), H5Pclose, what),
                     properties = made(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, what);
    const int rank = H5Sget_simple_extent_ndims(space_in_file.get());
    require_copied(rank > 0, what);
    std::vector<hsize_t> sizes(static_cast<std::size_t>(rank));
    H5Sget_simple_extent_dims(space_in_file.get(), sizes.data(), nullptr);
    // It cannot grow any more.
    const Hdf5Handle space = made(H5Screate_simple(rank, sizes.data(), nullptr), H5Sclose, what);
    H5Pset_layout(properties.get(), H5D_CONTIGUOUS);
    H5Pset_alloc_time(properties.get(), H5D_ALLOC_TIME_EARLY);
    H5Pset_fill_time(properties.get(), H5D_FILL_TIME_NEVER);  // nothing is written
    H5Pset_obj_track_times(properties.get(), false);
    H5D_fill_value_t fill = H5D_FILL_VALUE_UNDEFINED;
    if (H5Pfill_value_defined(before.get(), &fill) >= 0 && fill == H5D_FILL_VALUE_USER_DEFINED) {
      std::vector<std::byte> value(H5Tget_size(type.get()));
      require_copied(H5Pget_fill_value(before.get(), type.get(), value.data()) >= 0 &&
                         H5Pset_fill_value(properties.get(), type.get(), value.data()) >= 0,
                     what);
    }
    unsigned order = 0;
    if (H5Pget_attr_creation_order(before.get(), &order) >= 0)
      H5Pset_attr_creation_order(properties.get(), order);
    const Hdf5Handle dataset =
        made(H5Dcreate2(copy, link.c_str(), type.get(), space.get(), links, properties.get(), H5P_DEFAULT),
             H5Dclose, what);
    found_ = true;
  }

  void copy_attributes(haddr_t address, const std::string& name) {
    const Hdf5Handle object = made(H5Oopen_by_addr(old_.get(), address), H5Oclose, "one of its objects"),
                     copy =
                         made(H5Oopen(new_.get(), name.c_str(), H5P_DEFAULT), H5Oclose, "one of its objects");
    for (const std::string& attribute : names_of_attributes(object.get())) {
      constexpr const char* what = "one of its attributes";
      const Hdf5Handle before = made(H5Aopen(object.get(), attribute.c_str(), H5P_DEFAULT), H5Aclose, what),
                       properties = made(H5Aget_create_plist(before.get()), H5Pclose, what);
      AttributeValues values(before.get(), room_for(0));
      for (std::size_t i = 0; i < values.count(); ++i)
        lead_to_copies(values.type(), values.data() + i * H5Tget_size(values.type()));
      const Hdf5Handle type = made(H5Tcopy(values.type()), H5Tclose, what);
      const Hdf5Handle after = made(H5Acreate2(copy.get(), attribute.c_str(), type.get(), values.space(),
                                               properties.get(), H5P_DEFAULT),
                                    H5Aclose, what);
      if (!values.is_empty()) require_copied(H5Awrite(after.get(), values.type(), values.data()) >= 0, what);
    }
  }

  /// Makes references in a value lead to the copies of what they lead to.
  void lead_to_copies(hid_t type, std::byte* value) {
    if (H5Tdetect_class(type, H5T_REFERENCE) <= 0) return;
    switch (H5Tget_class(type)) {
      case H5T_REFERENCE:
        if (H5Tequal(type, H5T_STD_REF_OBJ) <= 0) throw NoPlainForm{"it has references to regions"};
        lead_to_copy(value);
        return;
      case H5T_COMPOUND:
        for (unsigned i = 0; i < static_cast<unsigned>(H5Tget_nmembers(type)); ++i) {
          const Hdf5Handle member = made(H5Tget_member_type(type, i), H5Tclose, "one of its attributes");
          lead_to_copies(member.get(), value + H5Tget_member_offset(type, i));
        }
        return;
      case H5T_VLEN: {
        hvl_t list = {};
        std::memcpy(&list, value, sizeof list);  // members of a compound lie at any byte
        lead_all_to_copies(type, static_cast<std::byte*>(list.p), list.len);
        return;
      }
      case H5T_ARRAY: {
        const Hdf5Handle one = made(H5Tget_super(type), H5Tclose, "one of its attributes");
        lead_all_to_copies(type, value, H5Tget_size(type) / H5Tget_size(one.get()));
        return;
      }
      default:
        throw NoPlainForm{"it has references of an unknown kind"};
    }
  }
  void lead_all_to_copies(hid_t type_of_list, std::byte* values, std::size_t count) {
    const Hdf5Handle one = made(H5Tget_super(type_of_list), H5Tclose, "one of its attributes");
    for (std::size_t i = 0; i < count; ++i) lead_to_copies(one.get(), values + i * H5Tget_size(one.get()));
  }

  void lead_to_copy(std::byte* value) {
    hobj_ref_t reference = 0;
    std::memcpy(&reference, value, sizeof reference);
    if (reference == 0) return;
    const Hdf5Handle object(H5Rdereference2(old_.get(), H5P_DEFAULT, H5R_OBJECT, &reference), H5Oclose);
    const auto found = object ? copies_.find(known_address(object.get())) : copies_.end();
    reference = 0;  // for what is gone
    if (found != copies_.end())
      require_copied(H5Rcreate(&reference, new_.get(), found->second.c_str(), H5R_OBJECT, -1) >= 0,
                     "one of its references");
    std::memcpy(value, &reference, sizeof reference);
  }

  Hdf5Handle old_;
  hid_t target_;
  haddr_t target_address_;
  FileSource old_file_;
  CopiedFile copy_;
  bool has_holes_ = true;
  hsize_t user_block_ = 0;
  Hdf5Handle new_;
  std::map<haddr_t, std::string> copies_;  ///< where objects of the old file are in the new one
  std::vector<std::pair<haddr_t, std::string>> objects_ =
      {};  ///< the same, in the order in which they were copied
  bool found_ = false;
};

}  // namespace

PlainHdf5 plain_copy(const std::string& path, hid_t dataset, std::uint64_t sample_bytes) {
  PlainHdf5 plain;
  try {
    Copy copy(path, dataset);
    const std::uint64_t begin = copy.finish(), end = begin + sample_bytes;
    copy.close();
    const std::uint64_t size = copy.file().size();
    if (end > size) throw NoPlainForm{"the data set cannot be copied"};
    if (size - sample_bytes > most_around_samples) copy.room_for(most_around_samples + 1);
    plain.before = copy.file().bytes(0, begin);
    const std::string user_block = copy.user_block();
    plain.before.replace(0, user_block.size(), user_block);
    plain.behind = copy.file().bytes(end, size);
  } catch (const NoPlainForm& none) {
    plain.why_not = none.why;
  }
  return plain;
}

}  // namespace tagrid
