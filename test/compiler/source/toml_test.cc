#include "compiler/source/toml.h"

#include <gtest/gtest.h>

namespace morphbus::source {
namespace {

/// The messages of a text; "read" if there is nothing wrong with it.
std::string Said(const std::string& text) {
  SourceSet sources;
  Diagnostics diagnostics;
  const bool read = ParseToml(sources, sources.AddText("t.toml", text), &diagnostics).has_value();
  return read ? "read" : diagnostics.all().front().message;
}

std::string Repeated(int times, const std::string& text) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

constexpr const char* kTooDeep = "more tables in tables than can be read";

TEST(TomlTest, TablesInTablesHaveAnEnd) {
  EXPECT_EQ(Said("a" + Repeated(400, ".a") + " = 1\n"), "read");
  EXPECT_EQ(Said("a" + Repeated(600, ".a") + " = 1\n"), kTooDeep);
  // Each key has few parts, and each line too; it is the whole that is deep.
  const std::string key = "a" + Repeated(30, ".a") + " = [\n{";
  EXPECT_EQ(Said(Repeated(100, key)), kTooDeep);
  EXPECT_EQ(Said("x = " + Repeated(100000, "[")), kTooDeep);
}

TEST(TomlTest, WhatIsLongIsNotDeep) {
  EXPECT_EQ(Said("a = [" + Repeated(2000, "0.5, ") + "]\n"), "read");
  EXPECT_EQ(Said(Repeated(2000, "[[run]]\na.b = 1.5\n")), "read");
  EXPECT_EQ(Said("a = [" + Repeated(2000, "{b = 1, c = [2.5]},\n") + "]\n"), "read");
}

TEST(TomlTest, PointsAndBracketsInTextsAndCommentsAreNone) {
  const std::string many = Repeated(600, "[{.");
  EXPECT_EQ(Said("# " + many + "\na = \"\\\"" + many + "\"\nb = '" + many + "\\'\n"), "read");
  EXPECT_EQ(Said("a = \"\"\"\n\\\"\"" + many + "\n\"\"\"\"\"\nb = '''\n'" + many + "''''\n"),
            "read");
  // What stands behind a text counts again, and one without an end is no way around.
  EXPECT_EQ(Said("a = '''x''''\nb = " + Repeated(600, "[")), kTooDeep);
  EXPECT_NE(Said("a = \"x\nb = " + Repeated(600, "[")), "read");
}

}  // namespace
}  // namespace morphbus::source
