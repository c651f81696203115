#include "compiler/base/disjoint_sets.h"

#include <gtest/gtest.h>

namespace morphbus {
namespace {

TEST(DisjointSetsTest, NumbersAreApartUntilTheirSetsAreUnited) {
  DisjointSets sets(6);
  EXPECT_NE(sets.Find(0), sets.Find(1));
  EXPECT_TRUE(sets.Unite(0, 1));
  EXPECT_TRUE(sets.Unite(2, 3));
  EXPECT_NE(sets.Find(0), sets.Find(3));
  EXPECT_TRUE(sets.Unite(1, 2));
  EXPECT_EQ(sets.Find(0), sets.Find(3));
  EXPECT_NE(sets.Find(4), sets.Find(5));
}

TEST(DisjointSetsTest, UnitingASetWithItselfIsToldAndChangesNothing) {
  DisjointSets sets(3);
  EXPECT_TRUE(sets.Unite(0, 1));
  EXPECT_FALSE(sets.Unite(1, 0));
  EXPECT_FALSE(sets.Unite(2, 2));
  EXPECT_NE(sets.Find(0), sets.Find(2));
}

}  // namespace
}  // namespace morphbus
