// The tables of the index of an archive.
#pragma once

#include "tools/catalogue/database.h"

namespace tagrid {

/// Whose tables a database has.
enum class Owner { nobody, tagrid, other_version, other };
Owner owner_of(const Database& database);

/// Makes the tables. REQUIRES: owner_of(database) == Owner::nobody.
void make_tables(const Database& database);

}  // namespace tagrid
