// What to do about a damaged .tag file, in words.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "io/errors/errors.h"
#include "io/files/byte_source.h"

namespace tagrid {

/// True if the first bytes of a file are those of a .tag file, of any version.
bool file_begins_as_tag(const ByteSource& file);

/// The message of an error of a .tag file. Where a file begins like no .tag file, but ends like one or has
/// parity, it says that the beginning is damaged.
std::string words_of_damage(const std::string& input, const BrokenInput& broken);

/// A path as it is written in a command of a shell: 'my scan.tag', in quotes only if it needs them.
std::string word_of_command(std::string_view path);

/// "tagrid repair scan.tag -o OUT".
std::string repair_command(const std::string& input);

/// The same, and how to repair a file that has parity.
std::string words_with_repair(const std::string& input, const BrokenInput& broken);

/// Does `work`, which reads a .tag file. Errors of damage have the words above.
void with_repair_advice(const std::string& input, const std::function<void()>& work);

}  // namespace tagrid
