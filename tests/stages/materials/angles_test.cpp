// The dihedral angles of meshes with materials: what a search finds at worst.
#include <gtest/gtest.h>

#include "tests/stages/materials/angle_search.h"

namespace tagrid {
namespace {

constexpr SnapRule rule = closest_vertices;
constexpr double half_way = rule.of_half_pyramids / 4.0, three_quarters = rule.if_all_are_snapped / 4.0,
                 quarter = rule.of_half_pyramids_if_all_are_snapped / 4.0, at_end = rule.at_end / 4.0;

struct Range {
  double smallest, largest;
};

// The search must not find worse angles than before; and if it finds better ones, the tables in documents are wrong.
void expect(const AngleRange& found, const Range& stated, const char* what) {
  EXPECT_NEAR(found.smallest, stated.smallest, 0.05) << what;
  EXPECT_NEAR(found.largest, stated.largest, 0.05) << what;
}

SearchedShape interior() { return {{{1, 1, 11}, {1, 1, 13}, {0, 0, 12}, {2, 0, 12}}, {1, 1, 1, 1}}; }

TEST(MaterialAngles, InteriorOfTwoMaterials) {
  expect(AngleSearch(interior()).run(2, false), {9.21, 161.66}, "");
}

TEST(MaterialAngles, MoreMaterialsAreNotWorse) {
  expect(AngleSearch(interior()).run(4, false), {9.21, 161.66}, "");
}

TEST(MaterialAngles, WhereAllCornersAreSnapped) {
  SearchedShape shape = interior();
  shape.if_all_are_snapped = three_quarters;
  expect(AngleSearch(shape).run(1, true), {15.67, 152.86}, "");
}

SearchedShape pyramid_at_end() {
  return {{{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {1, 1, 1}}, std::vector<double>(5, at_end), 1, true};
}

TEST(MaterialAngles, PyramidsAtTheEndOfTheLattice) {
  expect(AngleSearch(pyramid_at_end()).run(2, false, 4, 100), {9.77, 160.80}, "two materials");
  expect(AngleSearch(pyramid_at_end()).run(2, true, 4, 100), {15.88, 157.53}, "all snapped");
}

TEST(MaterialAngles, NextToTheEndOfTheLattice) {
  const SearchedShape two{
      {{-1, 1, 1}, {1, 1, 1}, {0, 0, 0}, {0, 2, 0}}, std::vector<double>(4, at_end), 1, true};
  expect(AngleSearch(two).run(2, false), {9.59, 158.10}, "two corners in the plane");
  const SearchedShape one{
      {{-1, 1, 1}, {1, 1, 1}, {0, 0, 0}, {0, 0, 2}}, {at_end, at_end, at_end, 1}, 1, true};
  expect(AngleSearch(one).run(2, false), {9.32, 160.53}, "one corner in the plane");
}

TEST(MaterialAngles, WhereTetrahedraBecomeCoarser) {
  SearchedShape half{{{0, 0, 10}, {2, 0, 10}, {2, 2, 10}, {1, 1, 11}}, std::vector<double>(4, half_way)};
  half.is_cut = false;
  expect(AngleSearch(half).run(1, false), {18.47, 157.04}, "half pyramid");
  half.if_all_are_snapped = quarter / half_way;
  expect(AngleSearch(half).run(1, true), {29.59, 142.50}, "half pyramid, all snapped");
  for (const std::vector<Index3>& corners :
       {std::vector<Index3>{{0, 0, 10}, {2, 0, 10}, {2, 2, 10}, {2, 2, 12}},
        std::vector<Index3>{{0, 0, 10}, {4, 0, 10}, {2, 2, 10}, {2, 2, 12}},
        std::vector<Index3>{{0, 0, 10}, {4, 0, 10}, {4, 4, 10}, {2, 2, 12}}}) {
    SearchedShape leaf{corners, std::vector<double>(4, half_way)};
    leaf.is_cut = false;
    AngleRange worst = AngleSearch(leaf).run(1, false);
    worst.add(AngleSearch(leaf).run(1, true));
    EXPECT_GT(worst.smallest, 24);
    EXPECT_LT(worst.largest, 143);
  }
}

// The same, in one table, for the rule that trades place for angle.
TEST(MaterialAngles, OfTheRuleForBestAngles) {
  const auto shape = [](std::vector<Index3> corners, std::vector<double> parts, double if_all,
                        bool ends = false) {
    SearchedShape s{std::move(corners), std::move(parts), if_all, ends};
    s.rule = best_angles;
    return s;
  };
  const double way = best_angles.way / 4.0, all = best_angles.if_all_are_snapped / 4.0,
               end = best_angles.at_end / 4.0, half = best_angles.of_half_pyramids / 4.0;
  const SearchedShape inside = shape(interior().corners, std::vector<double>(4, way), all / way);
  expect(AngleSearch(inside).run(2, false), {15.04, 152.19}, "two materials");
  expect(AngleSearch(inside).run(4, false), {15.04, 152.19}, "four materials");
  expect(AngleSearch(inside).run(1, true), {24.53, 138.73}, "all snapped");
  const SearchedShape pyramid = shape(pyramid_at_end().corners, std::vector<double>(5, end), 1, true);
  expect(AngleSearch(pyramid).run(2, false, 4, 100), {12.69, 155.68}, "at the end");
  expect(AngleSearch(pyramid).run(2, true, 4, 100), {24.37, 151.52}, "at the end, all snapped");
  const SearchedShape two =
      shape({{-1, 1, 1}, {1, 1, 1}, {0, 0, 0}, {0, 2, 0}}, std::vector<double>(4, end), 1, true);
  expect(AngleSearch(two).run(2, false), {15.04, 149.53}, "two corners in the end");
  const SearchedShape one =
      shape({{-1, 1, 1}, {1, 1, 1}, {0, 0, 0}, {0, 0, 2}}, {end, end, end, way}, 1, true);
  expect(AngleSearch(one).run(2, false), {15.04, 149.61}, "one corner in the end");
  for (const std::vector<Index3>& corners :
       {std::vector<Index3>{{0, 0, 10}, {2, 0, 10}, {2, 2, 10}, {1, 1, 11}},
        std::vector<Index3>{{0, 0, 10}, {2, 0, 10}, {2, 2, 10}, {2, 2, 12}},
        std::vector<Index3>{{0, 0, 10}, {4, 0, 10}, {2, 2, 10}, {2, 2, 12}},
        std::vector<Index3>{{0, 0, 10}, {4, 0, 10}, {4, 4, 10}, {2, 2, 12}}}) {
    SearchedShape coarser = shape(corners, std::vector<double>(4, half), 1);
    coarser.is_cut = false;
    AngleRange worst = AngleSearch(coarser).run(1, false);
    worst.add(AngleSearch(coarser).run(1, true));
    EXPECT_GT(worst.smallest, 27);
    EXPECT_LT(worst.largest, 147);
  }
}

}  // namespace
}  // namespace tagrid
