// Units of lengths by all their names, and places that stay where they are in another unit.
#include "io/volume/lengths.h"

#include <gtest/gtest.h>

#include <cmath>

#include "io/formats/nrrd/geometry.h"

namespace tagrid {
namespace {

std::string usual(std::string_view name) {
  const auto unit = length_unit(name);
  return unit ? std::string(unit->name) : "";
}

TEST(Lengths, AreKnownByAllTheirNames) {
  for (const char* micro :
       {"um", "UM", "\xc2\xb5m", "\xce\xbcm", "\xb5m", "micron", "Microns", "micrometer", "Micrometres"})
    EXPECT_EQ(usual(micro), "um") << micro;
  for (const char* milli : {"mm", "MM", "millimeter", "Millimetres", " mm "})
    EXPECT_EQ(usual(milli), "mm") << milli;
  for (const char* inch : {"inch", "in", "inches", "\""}) EXPECT_EQ(usual(inch), "inch") << inch;
  for (const char* angstrom : {"A", "\xc3\x85", "\xc5", "\xe2\x84\xab", "Angstroms", "ang"})
    EXPECT_EQ(usual(angstrom), "angstrom") << angstrom;
  EXPECT_EQ(usual("\\u00B5m") + usual("feet") + usual("thou") + usual("dam") + usual("fm"), "umftmildamfm");
  EXPECT_EQ(usual("cm") + usual("nm") + usual("m") + usual("Meters") + usual("km") + usual("pm"),
            "cmnmmmkmpm");
  for (const char* other : {"", "s", "Mm", "pixel", "mmHg", "furlong", "e", "1"})
    EXPECT_EQ(usual(other), "") << other;
}

TEST(Lengths, AreRoundedOnceIfOneUnitIsAWholeNumberOfTheOther) {
  const auto in_mm = [](double length, const char* unit) {
    return converted(length, *length_unit(unit), *length_unit("mm"));
  };
  EXPECT_EQ(in_mm(2500, "um"), 2.5);
  EXPECT_EQ(in_mm(0.3, "um"), 0.3 / 1000);
  EXPECT_EQ(in_mm(1.1, "m"), 1.1 * 1000);
  EXPECT_EQ(in_mm(2, "in"), 50.8);
}

Geometry geometry(const std::string& fields) { return geometry_of(fields); }

TEST(Lengths, InOneUnitPlacesStay) {
  const Geometry spaced = in_one_unit(geometry(
      "spacings: 0.5 2 3\nunits: \"mm\" \"cm\" \"micron\"\naxis mins: 1 1 1\ncenters: node node node\n"));
  EXPECT_EQ(spaced.spacing, (std::array{0.5, 20.0, 0.003}));
  EXPECT_EQ(spaced.origin, (std::array{1.0, 10.0, 0.001}));
  EXPECT_EQ(spaced.units, (std::array<std::string, 3>{"mm", "mm", "mm"}));
  // Units of coordinates, not of axes.
  const Geometry turned =
      in_one_unit(geometry("space dimension: 3\nspace directions: (3,4000,0) (-4,3000,0) (0,0,7)\nspace "
                           "origin: (1,2000,3)\nspace units: \"mm\" \"um\" \"mm\"\n"));
  EXPECT_EQ(turned.directions, (std::array<std::array<double, 3>, 3>{{{3, 4, 0}, {-4, 3, 0}, {0, 0, 7}}}));
  EXPECT_EQ(turned.spacing, (std::array{5.0, 5.0, 7.0}));
  EXPECT_EQ(turned.origin, (std::array{1.0, 2.0, 3.0}));
}

TEST(Lengths, NothingChangesWhereNothingIsMixedOrKnown) {
  for (const char* fields : {"spacings: 0.1 0.2 0.3\nunits: \"um\" \"micron\" \"um\"\n",
                             "spacings: 1 2 3\nunits: \"mm\" \"mm\" \"s\"\n",
                             "spacings: 1 2 3\nunits: \"mm\" \"\" \"mm\"\n", "spacings: 1 2 3\n", ""}) {
    const Geometry before = geometry(fields), after = in_one_unit(before);
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_TRUE(after.spacing[axis] == before.spacing[axis] || std::isnan(before.spacing[axis])) << fields;
  }
  EXPECT_EQ(lost_by_mixed_units(geometry("spacings: 1 2 3\nunits: \"mm\" \"cm\" \"um\"\n")), "");
  EXPECT_NE(lost_by_mixed_units(geometry("spacings: 1 2 3\nunits: \"mm\" \"cm\" \"s\"\n")), "");
  // An axis without a spacing, such as that of a single slice, needs no unit.
  const Geometry slice = geometry("spacings: 1 2 nan\nunits: \"cm\" \"cm\" \"\"\n");
  EXPECT_EQ(lost_by_mixed_units(slice), "");
  EXPECT_EQ(in_unit(slice, "mm").spacing[0], 10);
}

}  // namespace
}  // namespace tagrid
