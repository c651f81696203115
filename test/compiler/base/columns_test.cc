#include "compiler/base/columns.h"

#include <gtest/gtest.h>

namespace morphbus {
namespace {

TEST(ColumnsTest, AColumnIsAsWideAsItsWidestCell) {
  EXPECT_EQ(Columns({{"module", "role"}, {"front_left_knee", "Leg"}, {"m2", "Foot"}}),
            "module           role\n"
            "front_left_knee  Leg\n"
            "m2               Foot\n");
}

TEST(ColumnsTest, LettersOfSeveralBytesCountOnce) {
  EXPECT_EQ(Columns({{"caf\xC3\xA9", "x"}, {"tea", "y"}}, "  "), "  caf\xC3\xA9  x\n  tea   y\n");
}

TEST(ColumnsTest, NothingFollowsTheLastCell) {
  EXPECT_EQ(Columns({{"a", "bb", ""}, {"a"}, {"a", "", "c"}}), "a  bb\na\na      c\n");
  EXPECT_EQ(Columns({}), "");
}

}  // namespace
}  // namespace morphbus
