#include "compiler/base/role_colors.h"

#include <gtest/gtest.h>

#include <set>

namespace morphbus {
namespace {

TEST(ContrastTest, IsThatOfTheGuidelines) {
  EXPECT_DOUBLE_EQ(Contrast({0, 0, 0}, {1, 1, 1}), 21.0);
  EXPECT_DOUBLE_EQ(Contrast({1, 1, 1}, {1, 1, 1}), 1.0);
  // #767676 is the lightest grey on which white is readable.
  const double grey = 0x76 / 255.0;
  EXPECT_NEAR(Contrast({1, 1, 1}, {grey, grey, grey}), 4.54, 0.005);
}

TEST(RoleColorsTest, TextOnEveryColorCanBeRead) {
  for (int i = 0; i < 3 * kPaletteSize; ++i) {
    const Color color = PaletteColor(i);
    EXPECT_GE(Contrast(color, TextColorOn(color)), 4.5) << i;
  }
  const Color none = RoleColors().Of("");
  EXPECT_GE(Contrast(none, TextColorOn(none)), 4.5);
}

TEST(RoleColorsTest, RolesOfAProgramHaveUnlikeColors) {
  std::vector<std::string> roles;
  for (int i = 0; i < 3 * kPaletteSize; ++i) roles.push_back("Role" + std::to_string(i));
  RoleColors colors;
  colors.Add(roles);
  std::set<std::string> seen = {CssColor(colors.Of(""))};
  for (const std::string& role : roles) {
    EXPECT_TRUE(seen.insert(CssColor(colors.Of(role))).second) << role;
  }
}

TEST(RoleColorsTest, TheFirstProgramThatNamesARoleDecides) {
  RoleColors colors;
  colors.Add({"Hub", "Leg"});
  colors.Add({"Leg", "Foot"});
  EXPECT_EQ(colors.Of("Hub"), PaletteColor(0));
  EXPECT_EQ(colors.Of("Leg"), PaletteColor(1));
  EXPECT_EQ(colors.Of("Foot"), PaletteColor(1));  // as where its program is alone
}

TEST(RoleColorsTest, AnUnknownRoleHasTheSameColorWhateverElseIsKnown) {
  RoleColors some;
  some.Add({"Hub"});
  EXPECT_EQ(some.Of("Stranger"), RoleColors().Of("Stranger"));
  EXPECT_NE(some.Of("Stranger"), some.Of(""));
}

TEST(CssColorTest, IsHexadecimal) {
  EXPECT_EQ(CssColor({1, 0, 0.5}), "#ff0080");
  EXPECT_EQ(CssColor(PaletteColor(0)), "#4d78a8");
}

}  // namespace
}  // namespace morphbus
