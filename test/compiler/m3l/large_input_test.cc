// As hostile_test.cc, with much input: compiling ends, without a crash, whatever it says.

#include <gtest/gtest.h>

#include <string>

#include "test/compiler/m3l/survive.h"

namespace morphbus::m3l {
namespace {

TEST(LargeInput, AMillionTokens) { SurviveTokens(1'000'000); }

TEST(LargeInput, ManySubPointsAndConnectors) {
  std::string text = "module A:\n";
  std::string names;
  for (int i = 0; i < 50; ++i) {
    text += "point c" + std::to_string(i) + ": ";
    for (int k = 0; k < 12; ++k) {
      text += "(point _" + std::to_string(k) + ": coords=(" + std::to_string(i) + "+cos(" +
              std::to_string(k) + "),sin(" + std::to_string(k) + "),0)) ";
    }
    text += "coords=(" + std::to_string(i) + ",0,0), connector\n";
    names += (i ? ",c" : "c") + std::to_string(i);
  }
  text += "link l: mass=1, grouping=(" + names + ")\n";
  text += "connection C: members=(A a, A b), conditions=(a.point p coincident b.point q";
  for (int k = 0; k < 12; ++k) text += " and p._" + std::to_string(k) + " coincident q.point";
  Survive(text + ")\n");
}

}  // namespace
}  // namespace morphbus::m3l
