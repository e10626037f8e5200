#include "tools/report/advice.h"

#include <fmt/format.h>

#include "pipeline/memory/resources.h"

namespace tagrid {
namespace {

std::string memory_advice(const std::vector<std::uint64_t>& needed) {
  const auto mebibytes = [](std::uint64_t bytes) { return (bytes + (1 << 20) - 1) >> 20; };
  const std::string limit = fmt::format("; give -M {}M", mebibytes(needed[0]));
  if (needed.size() < 3) return limit;
  return fmt::format("{}, or --spool DIR, a folder for the samples, and -M {}M", limit, mebibytes(needed[2]));
}

// Advice that follows the message of the error.
std::string advice_on(const ErrorDetail& detail) {
  switch (detail.problem) {
    case Problem::none:
      return "";
    case Problem::output_exists:
      return "; give -f to overwrite it";
    case Problem::memory_limit:
      return memory_advice(detail.numbers);
    case Problem::writer_memory:
      return fmt::format(
          "{}, which is safe where there is less memory if most voxels are background, or choose another "
          "format, such "
          "as .nrrd",
          memory_advice({detail.numbers.at(0)}));
    case Problem::no_known_format:
      return "; if it holds samples without a header, describe them with --dims and --type";
    case Problem::compressed_file:
      return "; decompress it into a file: zcat FILE > OTHER, or, if it holds NRRD, NIfTI, MetaImage or "
             "samples without a header, which need --dims and --type, into a pipe: "
             "zcat FILE | tagrid encode - -o NAME.tag (or tagrid verify NAME.tag --against -); "
             "use zstdcat, xzcat or bzcat for zstd, xz or bzip2";
    case Problem::not_openvdb:
      return "; leave out --vdb-grid";
    case Problem::describes_itself:
      return "; leave out --dims and the other options that describe samples";
    case Problem::endian_differs:
      return "; leave out --endian";
    case Problem::spacing_differs:
      return "; leave out --spacing";
    case Problem::spacing_not_in_header:
      return "; leave out --spacing, or add to its header the line \"spacings: x y z\"";
    case Problem::mesh_fills_no_space:
      return "; give --padded for the mesh of whole root cubes";
    case Problem::no_source_files:
      return "; tagrid decode FILE.tag -o FILE.nrrd gives the volume, with all that is known of it";
    case Problem::slices_missing:
      return "; give --gaps-ok if it is meant to be so";
    case Problem::program_memory:
      return fmt::format("; a larger -M gives it more, and -M {}M the most that it may have",
                         limit_for_most_first_memory() >> 20);
  }
  return "";
}

/// The sentence, in which a search is the whole command: other commands have no such option.
Sentence with_commands(Sentence sentence) {
  for (Term& term : sentence.terms)
    if (term.setting == "find") term = Term("tagrid convert --find " + sentence.terms.front().text);
  return sentence;
}

std::string words_of(const std::string& message, const ErrorDetail& detail) {
  const bool in_terms = !detail.sentence.text.empty();
  return (in_terms ? detail.context + text_of(with_commands(detail.sentence), "--") : message) +
         advice_on(detail);
}

}  // namespace

std::string words_of(const SortedError& error) { return words_of(error.message, error.detail); }
std::string words_of(const Error& error) { return words_of(error.what(), error.detail()); }

}  // namespace tagrid
