#include "io/text/foreign_numbers.h"

#include <gtest/gtest.h>

namespace tagrid {
namespace {

TEST(ForeignNumbers, AreReadOrSaid) {
  EXPECT_TRUE(foreign_numbers(std::nullopt, 3).is_absent);
  EXPECT_EQ(remark_on(foreign_numbers(std::nullopt, 3), "spacing", "it is unknown"), "");
  const ForeignNumbers good = foreign_numbers(" 1 2.5  -3 ", 3);
  EXPECT_TRUE(good.are_numbers());
  EXPECT_EQ(good.values(), (std::vector<double>{1, 2.5, -3}));
  EXPECT_EQ(remark_on(good, "spacing", "it is unknown"), "");
  const ForeignNumbers commas = foreign_numbers("0,5 1 2,25", 3);
  EXPECT_EQ(commas.values(), (std::vector<double>{0.5, 1, 2.25}));
  EXPECT_EQ(remark_on(commas, "spacing", ""),
            "spacing \"0,5 1 2,25\" has decimal commas, which are read as points");
  EXPECT_EQ(remark_on(foreign_numbers("1 2", 3), "spacing", "it is unknown"),
            "spacing \"1 2\" must be 3 numbers; it is unknown");
  EXPECT_EQ(remark_on(foreign_numbers("1 inf 3", 3), "spacing", "it is unknown"),
            "spacing \"1 inf 3\": \"inf\" is not a number; it is unknown");
  EXPECT_EQ(remark_on(foreign_numbers(" ", 3), "spacing", "it is unknown"),
            "spacing is empty; it is unknown");
  for (const char* text : {"1 2", "1 inf 3", "", "0.5,0.5,1"})
    EXPECT_FALSE(foreign_numbers(text, 3).are_numbers()) << text;
}

}  // namespace
}  // namespace tagrid
