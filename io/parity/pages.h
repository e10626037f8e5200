// The pages that hold the checksums of all blocks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "io/parity/layout.h"

namespace tagrid {

/// Checksum of the table: of all checksums.
std::uint64_t id_of_table(std::span<const std::uint64_t> checksums);

/// Calls use(number, page) for every page of a table, those of its parity included. `layout` has its id.
void make_pages(const ParityLayout& layout, std::span<const std::uint64_t> checksums,
                const std::function<void(std::uint64_t number, std::span<const std::byte> page)>& use);

/// Reads the table from its pages. read(number, page) fills a page, whatever is there. `damaged` receives the
/// number of pages that are wrong. Nothing if too many are.
std::optional<std::vector<std::uint64_t>> read_pages(
    const ParityLayout& layout,
    const std::function<void(std::uint64_t number, std::span<std::byte> page)>& read, std::uint64_t& damaged);

}  // namespace tagrid
