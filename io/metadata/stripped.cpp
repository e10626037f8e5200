// What --strip leaves of a description.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "io/metadata/entries.h"
#include "io/metadata/lengths.h"
#include "io/metadata/loss.h"
#include "io/metadata/metadata.h"
#include "io/metadata/rescale.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// Texts of headers may name a patient: only numbers stay, and words that are known.
using IsHarmless = bool (*)(std::string_view text);

bool is_number(std::string_view word) { return word == "nan" || number_of(word); }

bool are_numbers(std::string_view text) { return std::ranges::all_of(words_of(text), is_number); }

/// Numbers, and vectors of them in parentheses.
bool are_vectors(std::string_view text) {
  std::string words(text);
  std::ranges::replace_if(
      words, [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
  return std::ranges::all_of(words_of(words),
                             [](std::string_view word) { return word == "none" || is_number(word); });
}

bool are_known_words(std::string_view text) {
  constexpr std::array known = {"cell", "node", "none", "???", "domain", "space"};
  return std::ranges::all_of(words_of(text), [&](std::string_view word) {
    return std::ranges::find(known, lower_case(word)) != known.end();
  });
}

/// The spaces of NRRD that have three axes.
bool is_known_space(std::string_view text) {
  constexpr std::array known = {"right-anterior-superior",
                                "ras",
                                "left-anterior-superior",
                                "las",
                                "left-posterior-superior",
                                "lps",
                                "right-posterior-superior",
                                "rps",
                                "left-anterior-inferior",
                                "lai",
                                "right-anterior-inferior",
                                "rai",
                                "left-posterior-inferior",
                                "lpi",
                                "right-posterior-inferior",
                                "rpi",
                                "scanner-xyz",
                                "3d-right-handed",
                                "3d-left-handed"};
  return std::ranges::find(known, lower_case(text)) != known.end();
}

/// Units of lengths in quotes, as "mm" "mm" "um".
bool are_lengths(std::string_view text) {
  const auto parts = split(text, '"');
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const bool is_inside = i % 2 == 1, is_empty = trimmed(parts[i]).empty();
    if (!is_empty && (!is_inside || (parts[i] != "???" && !length_unit(parts[i])))) return false;
  }
  return true;
}

/// "HU", "g/cm3", "1/mm", "Bq/ml": symbols of units, their powers and quotients; and the names of scales in DICOM.
bool is_unit_of_values(std::string_view text) {
  constexpr std::array known = {"%",
                                "1",
                                "A",
                                "Bq",
                                "BQML",
                                "C",
                                "CM",
                                "CNTS",
                                "Ci",
                                "DVPX",
                                "ED",
                                "EDW",
                                "F",
                                "Gy",
                                "GML",
                                "HU",
                                "Hz",
                                "HU_MOD",
                                "IU",
                                "J",
                                "K",
                                "MBq",
                                "MGML",
                                "MLG",
                                "MLMG",
                                "MPa",
                                "N",
                                "NONE",
                                "OD",
                                "PCT",
                                "PROPCPS",
                                "PROPCNT",
                                "Pa",
                                "S",
                                "STDDEV",
                                "SUV",
                                "SUVbw",
                                "T",
                                "US",
                                "V",
                                "W",
                                "Z_EFF",
                                "arb",
                                "au",
                                "cGy",
                                "cm",
                                "counts",
                                "cps",
                                "d",
                                "deg",
                                "g",
                                "h",
                                "keV",
                                "kBq",
                                "kPa",
                                "kg",
                                "l",
                                "m",
                                "mGy",
                                "mL",
                                "mT",
                                "mV",
                                "meV",
                                "mg",
                                "min",
                                "ml",
                                "mm",
                                "mol",
                                "ms",
                                "nm",
                                "ng",
                                "percent",
                                "pixel",
                                "ppb",
                                "ppm",
                                "px",
                                "rad",
                                "s",
                                "ug",
                                "um",
                                "us",
                                "voxel",
                                "x",
                                "L",
                                "Sv",
                                "mSv",
                                "eV",
                                "MeV",
                                "GPa",
                                "\xc2\xb0"
                                "C",
                                "\xc2\xb5m",
                                "\xc2\xb5g",
                                "\xc2\xb5s"};
  // What stands between symbols, and powers of them: digits, signs and their forms above the line in Unicode.
  constexpr std::array between = {"\xc2\xb2", "\xc2\xb3", "\xc2\xb7", "\xc2\xb9", "\xe2\x81\xbb"};
  std::string symbols(text);
  for (const std::string_view sign : between)
    for (std::size_t at; (at = symbols.find(sign)) != symbols.npos;) symbols.replace(at, sign.size(), " ");
  std::ranges::replace_if(
      symbols,
      [](char c) { return is_digit(c) || std::string_view("/*^.-+()[]").find(c) != std::string_view::npos; },
      ' ');
  return std::ranges::all_of(words_of(symbols), [&](std::string_view symbol) {
    return std::ranges::find(known, symbol) != known.end();
  });
}

/// Three distances and a unit, as "0.7 0.7 nan um"; without the unit, if it is not known.
std::string spacing_in(std::string_view text) {
  const auto words = words_of(text);
  if (words.size() < 3 || !std::ranges::all_of(words.begin(), words.begin() + 3, is_number)) return "";
  const bool is_known = words.size() == 3 || (words.size() == 4 && length_unit(words[3]));
  return is_known ? std::string(text) : fmt::format("{} {} {}", words[0], words[1], words[2]);
}

std::string numbers_in(std::string_view text) { return are_numbers(text) ? std::string(text) : "unknown"; }

struct KeptField {
  std::string_view field;
  IsHarmless is_harmless;
};
constexpr std::array<KeptField, 19> kept_fields = {{{"block size", are_numbers},
                                                    {"min", are_numbers},
                                                    {"max", are_numbers},
                                                    {"old min", are_numbers},
                                                    {"old max", are_numbers},
                                                    {"sample units", is_unit_of_values},
                                                    {"spacings", are_numbers},
                                                    {"thicknesses", are_numbers},
                                                    {"axis mins", are_numbers},
                                                    {"axis maxs", are_numbers},
                                                    {"centers", are_known_words},
                                                    {"units", are_lengths},
                                                    {"kinds", are_known_words},
                                                    {"space", is_known_space},
                                                    {"space dimension", are_numbers},
                                                    {"space units", are_lengths},
                                                    {"space origin", are_vectors},
                                                    {"space directions", are_vectors},
                                                    {"measurement frame", are_vectors}}};

struct KeptPair {
  std::string_view key;
  std::string (*kept)(std::string_view value);  ///< what is kept of a value; "": the pair goes
};
constexpr std::array<KeptPair, 18> kept_pairs = {
    {{"rescale_slope", numbers_in},
     {"rescale_intercept", numbers_in},
     {"rescale_units",
      [](std::string_view text) { return std::string(is_unit_of_values(text) ? text : ""); }},
     {"slice_positions", numbers_in},
     {"slice_slopes", numbers_in},
     {"slice_intercepts", numbers_in},
     {"slice_applied_slopes", numbers_in},
     {"slice_applied_intercepts", numbers_in},
     {"dicom_added_intercept", numbers_in},
     {applied_slope_key, numbers_in},
     {applied_intercept_key, numbers_in},
     {"vdb_origin", numbers_in},
     {"vdb_background", numbers_in},
     {lossy_source_key, [](std::string_view) { return std::string("an earlier compression"); }},
     {scale_doubt_key, [](std::string_view) { return std::string("what values samples mean is in doubt"); }},
     {not_understood_key,
      [](std::string_view) { return std::string("its reader did not understand all of it"); }},
     {"given spacing", spacing_in},
     {"overridden spacing", spacing_in}}};

const KeptField* kept_field(const MetadataEntry& entry) {
  const auto* found = std::ranges::find(kept_fields, entry.field, &KeptField::field);
  return found == kept_fields.end() ? nullptr : found;
}

const KeptPair* kept_pair(const MetadataEntry& entry) {
  const auto* found = std::ranges::find(kept_pairs, entry.key, &KeptPair::key);
  return found == kept_pairs.end() ? nullptr : found;
}

bool is_field(const MetadataEntry& entry) { return entry.kind == MetadataEntry::Kind::field; }

bool has_field(const Metadata& metadata, std::string_view field) {
  return std::ranges::any_of(metadata.entries(), [&](const MetadataEntry& entry) {
    return is_field(entry) && entry.field == field;
  });
}

}  // namespace

Metadata stripped(const Metadata& metadata) {
  MetadataEntries kept;
  for (const MetadataEntry& entry : metadata.entries()) {
    if (const KeptField* field = is_field(entry) ? kept_field(entry) : nullptr) {
      if (field->is_harmless(entry.value))
        kept.add(entry);
      else if (entry.field == "space" && !has_field(metadata, "space dimension"))
        kept.add_field("space dimension", "3");  // vectors need one of the two
    } else if (const KeptPair* pair = entry.kind == MetadataEntry::Kind::pair ? kept_pair(entry) : nullptr) {
      if (const std::string value = pair->kept(entry.value); !value.empty())
        kept.add_written_pair(entry.key, value);
    }
  }
  return Metadata(std::move(kept));
}

bool has_only_needed(const Metadata& metadata) {
  return std::ranges::all_of(metadata.entries(), [](const MetadataEntry& entry) {
    return is_field(entry) ? entry.field != "content" && entry.field != "number"
                           : entry.kind == MetadataEntry::Kind::pair &&
                                 (kept_pair(entry) != nullptr || entry.key.starts_with("vdb_"));
  });
}

}  // namespace tagrid
