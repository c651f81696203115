// Bytes that nobody would write: compiling ends, without a crash, whatever it says.

#include <fstream>
#include <random>
#include <sstream>

#include "compiler/m3l/compile.h"
#include "test/compiler/m3l/survive.h"
#include "test/support/diagnostics_test.h"
#include "test/support/source_dir.h"

namespace morphbus::m3l {
namespace {

std::string Model() {
  std::ifstream file(test::SourcePath("models/mtran.m3l"));
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

TEST(HostileTest, RandomBytes) {
  std::mt19937 random(1);
  for (int round = 0; round < 200; ++round) {
    std::string text;
    for (int i = 0; i < 500; ++i) text += static_cast<char>(random() & 0xFFU);
    Survive(text);
  }
}

TEST(HostileTest, MutatedModels) {
  const std::string model = Model();
  const std::string bits[] = {"(",   ")",         "[",     "]",  ",",
                              ":",   "=",         ".",     "\"", "point",
                              "and", "not ",      "1e308", "-",  std::string(1, '\0'),
                              "/*",  "module A:", "0"};
  std::mt19937 random(2);
  for (int round = 0; round < 300; ++round) {
    std::string text = model;
    const int edits = 1 + static_cast<int>(random() % 4);
    for (int i = 0; i < edits; ++i) {
      const size_t at = random() % text.size();
      switch (random() % 3) {
        case 0:
          text.erase(at, 1 + random() % 30);
          break;
        case 1:
          text.insert(at, bits[random() % std::size(bits)]);
          break;
        default:
          text[at] = static_cast<char>(random() & 0xFFU);
      }
    }
    Survive(text);
  }
}

TEST(HostileTest, TruncatedModels) {
  const std::string model = Model();
  for (size_t length = 0; length < model.size(); length += 41) Survive(model.substr(0, length));
}

TEST(HostileTest, ManyTokens) { SurviveTokens(100'000); }

TEST(HostileTest, ManyErrorsAreCutOff) {
  const std::string text = Repeated("robot r: modules=(X m)\n", 50'000);
  const CompileOutput output = CompileText("hostile.m3l", text);
  EXPECT_LE(output.diagnostics.all().size(), 300U);
}

TEST(HostileTest, DeepNesting) {
  Survive("robot r: x=" + Repeated("(", 900'000));
  Survive("robot r: x=" + Repeated("f(", 400'000));
  Survive("robot r: x=" + Repeated("m.(axis: origin=", 200'000));
  Survive("module A:\npoint p: " + Repeated("(point q: ", 250'000));
}

TEST(HostileTest, ManyModulesInOnePlace) {
  // A chain that is curled up lies in four places, again and again.
  std::string modules = "MTRAN m0", connections, joints;
  for (int i = 0; i < 300; ++i) {
    const std::string name = "m" + std::to_string(i);
    if (i > 0) modules += ", MTRAN " + name;
    if (i > 0) {
      connections += (i > 1 ? ",(m" : "(m") + std::to_string(i - 1) + ".c2," + name + ".c5)";
    }
    const bool even = i % 2 == 0;
    joints += (i > 0 ? "," : "") + name + (even ? ".joint_1=pi/2," : ".joint_1=-pi/2,") + name +
              (even ? ".joint_2=-pi/2" : ".joint_2=pi/2");
  }
  const std::string text = Model() + "robot r: modules=(" + modules + "), connections=(" +
                           connections + "), joints=(" + joints + ")\n";
  const CompileOutput output = CompileText("hostile.m3l", text);
  EXPECT_TRUE(output.model.has_value());
  EXPECT_EQ(output.diagnostics.all().size(), 20U);
}

/// Each of many connectors misspells a key that many comparisons name.
TEST(HostileTest, ManySlipsOfKeys) {
  std::string text = "module A:\n";
  std::string names;
  for (int i = 0; i < 60; ++i) {
    const std::string n = std::to_string(i);
    text += "point c" + n + ": (point _1: coords=(" + n + ",1,0)) (point _2: coords=(" + n +
            ",0,1)) coords=(" + n + ",0,0), connector, gende" + n + "r=\"x\"\n";
    names += (i > 0 ? ",c" : "c") + n;
  }
  text += "point last: (point _1: coords=(0,1,1)) coords=(0,0,1), connector, gender=\"x\"\n";
  text += "link l: mass=1, grouping=(" + names + ",last)\n";
  text += "connection C: members=(A a, A b), conditions=(a.point p coincident b.point q";
  for (int k = 0; k < 60; ++k) text += " and p.gender==\"x\"";
  const CompileOutput output = CompileText("hostile.m3l", text + ")\n");
  int warnings = 0;
  for (const source::Diagnostic& d : output.diagnostics.all()) {
    if (d.severity == source::Severity::kWarning && d.hint == "did you mean 'gender'?") ++warnings;
  }
  EXPECT_EQ(warnings, 20);
}

}  // namespace
}  // namespace morphbus::m3l
