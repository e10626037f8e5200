// Zip files whose members are stored as they are: APPNOTE.TXT 6.3.10 of PKWARE, sections 4.3 to 4.5.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "io/files/file_bytes.h"

namespace tagrid {

/// The members of a zip file, by the table at its end. Safe for any bytes.
class ZipFile {
 public:
  struct Member {
    std::uint64_t header = 0;  ///< the position of the header before the bytes
    std::uint64_t size = 0;
    std::uint32_t crc = 0;
    bool is_plain = true;  ///< stored as it is
  };

  /// Throws BrokenInput if the table is damaged, or has a name twice, or one that leads elsewhere;
  /// WorldError.
  explicit ZipFile(const std::string& path);

  const std::map<std::string, Member>& members() const { return members_; }
  /// nullptr if there is none.
  const Member* member(const std::string& name) const;
  /// The bytes of a member. Throws BrokenInput if they are compressed or encrypted, or if the header before
  /// them says something else than the table.
  std::unique_ptr<ByteSource> open(const std::string& name, const Member& member) const;

 private:
  struct Table {
    std::uint64_t position = 0, size = 0, members = 0;
  };
  Table find_table() const;
  void read_members(const Table& table);

  std::shared_ptr<const FileSource> file_;
  std::map<std::string, Member> members_;
};

}  // namespace tagrid
