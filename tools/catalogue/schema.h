// The tables of the index of an archive.
#pragma once

#include "tools/catalogue/database.h"

namespace tagrid {

/// Whose tables a database has. Those of an index are the ones that make_tables() makes: anybody may have changed it.
enum class Owner { nobody, tagrid, other_version, other };
Owner owner_of(const Database& database);

/// Makes the tables. REQUIRES: owner_of(database) == Owner::nobody.
void make_tables(const Database& database);

}  // namespace tagrid
