// What only the content of source files says, found out by all ranks: their checksums take as long as reading them.
#pragma once

#include "io/envelope/envelope.h"
#include "pipeline/memory/resources.h"
#include "pipeline/ranks/ranks.h"

namespace tagrid {

/// Some files of a source, of whose content each rank looks at a share.
struct ContentOrder {
  SourceFiles source;
  bool exact = false;      ///< see look_at_content()
  Resources resources{0};  ///< per rank
};

/// Looks at the content of all files of a source, on all ranks. Called by rank 0; the others call serve(). The result does not
/// depend on ranks and threads. Throws as look_at_content() does.
void share_contents(Ranks& ranks, SourceFiles& source, bool exact, const Resources& resources);

/// Collective: looks at the content of some files; on rank 0, `order` then has that of all of them.
void look_at_share(Ranks& ranks, ContentOrder& order);

}  // namespace tagrid
