#include "compiler/dynarole/compile.h"

#include <gtest/gtest.h>

#include <cctype>
#include <cmath>
#include <fstream>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "test/compiler/dynarole/fake_host.h"
#include "test/support/source_dir.h"
#include "vm/image/disassembler.h"
#include "vm/image/verifier.h"

namespace morphbus::dynarole {
namespace {

std::string ReadFile(const std::string& path) {
  std::ifstream file(test::SourcePath(path));
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

CompileResult Compile(const std::string& text, Dump dump = Dump::kNone) {
  return CompileProgram("test.dyn", text, TestKeywords(), dump);
}

/// Compiles without any diagnostic and verifies.
class Compiled {
 public:
  explicit Compiled(const std::string& text) : result_(Compile(text)) {
    EXPECT_TRUE(result_.diagnostics.all().empty())
        << Render(result_.diagnostics, result_.sources, false);
    EXPECT_TRUE(result_.image.has_value());
    if (!result_.image) return;
    const vm::VerifyError error = vm::Verifier::Verify(
        result_.image->data(), static_cast<uint32_t>(result_.image->size()), program_.get());
    EXPECT_EQ(error.message, nullptr) << error.message;
  }
  [[nodiscard]] const vm::VerifiedProgram& program() const { return *program_; }

 private:
  CompileResult result_;
  std::unique_ptr<vm::VerifiedProgram> program_ = std::make_unique<vm::VerifiedProgram>();
};

// ---- The paper ----

// The code that the paper prints, as printed: in these files every line that does not end with
// kAdded is the paper's.
constexpr const char* kListings[] = {"fig3.dyn", "sec5_fig10.dyn"};
constexpr const char* kAdded = "// added";
constexpr const char* kQuadruped = "models/programs/quadruped.dyn";

std::string Listing(const std::string& name) {
  return ReadFile("test/compiler/dynarole/listings/" + name);
}

std::vector<std::string> LinesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

bool IsAdded(const std::string& line) { return line.ends_with(kAdded); }

TEST(PaperTest, ItsTextCompilesWithTheFieldsThatOnlyItsSubrolesDeclare) {
  const std::string text = Listing("sec5_fig10.dyn");
  // The base role uses them and declares neither: what is added stands in its subroles.
  const size_t base = text.find("abstract role LegUpperHalf");
  const size_t subrole = text.find("role FrontLeftUpperHalf", base);
  EXPECT_NE(text.substr(base, subrole - base).find("hip,raise_thigh_deg"), std::string::npos);
  EXPECT_EQ(text.substr(base, subrole - base).find(kAdded), std::string::npos);
  const Compiled quadruped(text);
  int concrete = 0;
  for (int i = 0; i < quadruped.program().num_roles(); ++i) {
    concrete += quadruped.program().role(i).abstract_role ? 0 : 1;
  }
  EXPECT_EQ(concrete, 9);
  EXPECT_EQ(Compiled(Listing("fig3.dyn")).program().num_roles(), 3);
  // What stands in Secs. III and IV alone, as statements of the lower halves.
  std::string more = text;
  more.insert(more.find("command move_foot()"),
              "command example() {\nself.jointRotateDegrees(knee,90);\n"
              "self.JOINT_1.SET_POSITION(90);\n}\n");
  const Compiled example(more);
}

TEST(PaperTest, ItsQuadrupedInvokesWhatTheOneThatShipsInvokes) {
  const Compiled printed(Listing("sec5_fig10.dyn")), shipped(ReadFile(kQuadruped));
  EXPECT_EQ(RunRole(printed.program(), "Junction"), RunRole(shipped.program(), "Junction"));
}

TEST(PaperTest, EveryLineThatWasAddedIsNeededAndListedInTheManual) {
  const std::string manual = ReadFile("docs/paper.md");
  int added = 0;
  for (const char* name : kListings) {
    const std::vector<std::string> lines = LinesOf(Listing(name));
    for (size_t without = 0; without < lines.size(); ++without) {
      if (!IsAdded(lines[without])) continue;
      ++added;
      std::string text;
      for (size_t i = 0; i < lines.size(); ++i) text += i == without ? "\n" : lines[i] + "\n";
      EXPECT_FALSE(Compile(text).image.has_value()) << name << " without " << lines[without];
      // As one line of the manual, without the mark.
      const size_t first = lines[without].find_first_not_of(' ');
      const size_t last = lines[without].find_last_not_of(' ', lines[without].rfind(kAdded) - 1);
      const std::string line = lines[without].substr(first, last - first + 1);
      EXPECT_NE(manual.find(line + "\n"), std::string::npos) << "docs/paper.md lacks " << line;
    }
  }
  EXPECT_EQ(added, 9);
}

TEST(PaperTest, QuadrupedHasItsRolesAndLabels) {
  const Compiled quadruped(ReadFile(kQuadruped));
  const vm::VerifiedProgram& program = quadruped.program();
  int concrete = 0;
  for (int i = 0; i < program.num_roles(); ++i) concrete += program.role(i).abstract_role ? 0 : 1;
  EXPECT_EQ(concrete, 9);
  // Slots of a role are those of its base, so its commands run under all four legs.
  const vm::RoleInfo& leg = program.role(4);
  EXPECT_EQ(std::string(leg.name.data, leg.name.size), "FrontLeftUpperHalf");
  EXPECT_EQ(leg.num_labels, 3);
  EXPECT_EQ(leg.num_requirements, 2);
  EXPECT_EQ(leg.num_commands, 1);
  EXPECT_TRUE(program.IsA(4, 1));
  EXPECT_FALSE(program.IsA(1, 4));
  EXPECT_FALSE(program.IsA(4, 8));
}

TEST(PaperTest, QuadrupedStepsAsFigure10Says) {
  const Compiled quadruped(ReadFile(kQuadruped));
  const std::vector<std::string> events = RunRole(quadruped.program(), "Junction");
  std::vector<std::string> invocations;
  int64_t slept_us = 0;
  for (const std::string& event : events) {
    if (event.rfind("sleep ", 0) == 0) slept_us += std::stoll(event.substr(6));
    if (event.rfind("invoke ", 0) == 0) invocations.push_back(event.substr(7));
  }
  EXPECT_EQ(slept_us, 7000000);  // 2 + 0.25 + 1 + 1.5 + 0.25 + 2 s.
  ASSERT_EQ(invocations.size(), 16u);
  EXPECT_EQ(invocations[0], "FrontLeftLowerHalf.from_straight_to_proj_forward()");
  EXPECT_EQ(invocations[4], "FrontRightUpperHalf.move_thigh()");
  EXPECT_EQ(invocations[11], "FrontLeftLowerHalf.move_foot()");
  EXPECT_EQ(invocations[15], "BackRightLowerHalf.from_proj_backward_to_straight()");
}

// ---- The manual ----

// What it shows first is the program that it says it is, but for comments. The program drives in
// test/e2e/programs_cars.py.
TEST(ManualTest, ItsFirstProgramIsThatOfTheCar) {
  const auto code = [](const std::string& text) {
    std::string kept;
    for (const std::string& line : LinesOf(text)) {
      std::string part = line.substr(0, line.find("//"));
      part.erase(part.find_last_not_of(' ') + 1);
      if (!part.empty()) kept += part + "\n";
    }
    return kept;
  };
  const std::string manual = ReadFile("docs/dynarole.md");
  const size_t begin = manual.find("```\n") + 4;
  const std::string shown = manual.substr(begin, manual.find("```", begin) - begin);
  EXPECT_EQ(code(shown), code(ReadFile("models/programs/car.dyn")));
}

// ---- Stages ----

TEST(DumpTest, StagesMatchTheirGoldenFiles) {
  const std::string text = ReadFile("test/compiler/dynarole/golden/small.dyn");
  const std::pair<Dump, const char*> stages[] = {
      {Dump::kTokens, "tokens"}, {Dump::kAst, "ast"}, {Dump::kCode, "code"}};
  for (const auto& [stage, name] : stages) {
    const CompileResult result = CompileProgram("small.dyn", text, TestKeywords(), stage);
    EXPECT_EQ(result.dump,
              ReadFile(std::string("test/compiler/dynarole/golden/small.") + name + ".txt"))
        << Render(result.diagnostics, result.sources, false);
    EXPECT_EQ(DumpFromName(name), stage);
  }
  EXPECT_FALSE(DumpFromName("nothing"));
}

TEST(DiagnosticsTest, AMessageShowsItsLineACaretTheWayOutAndWhereItComesFrom) {
  const std::string path = "test/malformed/dynarole/unset_field.dyn";
  const CompileResult result = Compile(ReadFile(path));
  EXPECT_EQ(Render(result.diagnostics, result.sources, false),
            "test.dyn:8:6: error: role 'Right' does not set the field 'side'\n"
            "  role Right extends Leg { lift = 5.5; }\n"
            "       ^~~~~\n"
            "  hint: give it a value: side = ...; or make the role abstract\n"
            "test.dyn:2:3: note: declared without a value here\n"
            "    side;\n"
            "    ^~~~\n");
}

// ---- Limits and hostile texts ----

TEST(LimitsTest, HugeTextsAreRefused) {
  const CompileResult result = Compile(std::string((size_t{1} << 20) + 1, ' '));
  EXPECT_TRUE(result.diagnostics.had_errors());
  EXPECT_FALSE(result.image);
}

TEST(LimitsTest, ProgramsTooLargeForAnImageAreRefused) {
  std::string text = "role A extends Module { x = 1; require self.connected == x;\n";
  for (int i = 0; i < 12; ++i) {
    text += "startup s" + std::to_string(i) + "() {\n";
    for (int k = 0; k < 500; ++k) text += "x = x * 3000 + x / 4000 - x * 5000;\n";
    text += "}\n";
  }
  const CompileResult result = Compile(text + "}");
  ASSERT_TRUE(result.diagnostics.had_errors());
  EXPECT_EQ(result.diagnostics.all()[0].message, "program is too large for an image");
}

TEST(LimitsTest, NoiseYieldsFewDiagnostics) {
  std::mt19937 random(3);
  std::string text;
  // Without zeros, of which one is enough to refuse a text.
  for (int i = 0; i < 100000; ++i) text += static_cast<char>(random() % 255 + 1);
  const CompileResult result = Compile(text);
  EXPECT_TRUE(result.diagnostics.had_errors());
  EXPECT_LT(result.diagnostics.all().size(), 300u);
}

// A function's calls may fan out as widely as roles allow; checking them must not.
TEST(LimitsTest, ManyWaysThroughCallsAreWalkedOnce) {
  std::string text = "abstract role Base extends Module { startup go() {";
  for (int i = 0; i < 3; ++i) text += " f" + std::to_string(i) + "(true);";
  text += " }\n";
  for (int role = 0; role < 60; ++role) {
    if (role > 0) text += "role R" + std::to_string(role) + " extends Base {\n";
    for (int i = 0; i < 15; ++i) {
      text += "function f" + std::to_string(i) + "(bool b) { if (b) self.sleepds(1);";
      for (int k = i / 3 * 3 + 3; k < 15; ++k) text += " f" + std::to_string(k) + "(b);";
      text += " }\n";
      if (role > 28 && i > 10) break;
    }
    text += "}\n";
  }
  const CompileResult result = Compile(text);
  EXPECT_FALSE(result.diagnostics.all().empty());
}

TEST(LimitsTest, OneEndlessLineIsReadInTime) {
  std::string text = "role A extends Module { startup go() { var x = 1; ";
  while (text.size() < 1000000) text += "y = x; x = y + z(w); ";
  const CompileResult result = Compile(text + "} }");
  EXPECT_TRUE(result.diagnostics.had_errors());
  EXPECT_LT(result.diagnostics.all().size(), 250u);
}

// Programs with tokens dropped, doubled, swapped: diagnosed or compiled to something verifiable.
TEST(MutationTest, DamagedProgramsNeverCrashTheCompiler) {
  std::mt19937 random(5);
  int compiled = 0;
  for (const char* path :
       {"models/programs/quadruped.dyn", "test/programs/functions.dyn", "test/programs/logic.dyn",
        "test/programs/control.dyn", "test/programs/structure.dyn", "test/programs/motion.dyn"}) {
    const std::string original = ReadFile(path);
    // Pieces: words, numbers, single signs, spaces.
    std::vector<std::string> pieces;
    for (const char c : original) {
      const bool word = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '$';
      const bool joins = !pieces.empty() && word &&
                         (std::isalnum(static_cast<unsigned char>(pieces.back()[0])) != 0 ||
                          pieces.back()[0] == '_' || pieces.back()[0] == '$');
      if (joins) {
        pieces.back() += c;
      } else {
        pieces.emplace_back(1, c);
      }
    }
    for (int round = 0; round < 250; ++round) {
      std::vector<std::string> damaged = pieces;
      const int changes = 1 + static_cast<int>(random() % 3);
      for (int k = 0; k < changes; ++k) {
        const size_t at = random() % damaged.size(), other = random() % damaged.size();
        switch (random() % 4) {
          case 0:
            damaged[at].clear();
            break;
          case 1:
            damaged[at] += " " + damaged[other];
            break;
          case 2:
            std::swap(damaged[at], damaged[other]);
            break;
          default:
            damaged[at] = damaged[other];
        }
      }
      std::string text;
      for (const std::string& piece : damaged) text += piece;
      const CompileResult result = Compile(text);
      EXPECT_EQ(result.image.has_value(), !result.diagnostics.had_errors());
      for (const source::Diagnostic& diagnostic : result.diagnostics.all()) {
        EXPECT_EQ(diagnostic.message.find("refuses"), std::string::npos)
            << diagnostic.message << "\n"
            << text;
      }
      Render(result.diagnostics, result.sources, true);
      if (result.image) ++compiled;
    }
  }
  EXPECT_GT(compiled, 100);
}

// ---- Arithmetic by two routes ----

/// A random expression as text and, evaluated here, its value.
struct Sample {
  std::string text;
  bool is_float = false;
  double value = 0;  ///< Exact for ints; a float otherwise.
  bool faults = false;
};

class Generator {
 public:
  explicit Generator(uint32_t seed) : random_(seed) {}

  Sample Expression(int depth) {
    if (depth == 0 || random_() % 5 == 0) return Leaf();
    const Sample a = Expression(depth - 1), b = Expression(depth - 1);
    if (random_() % 6 == 0) return Negate(a);
    return Combine(a, b, "+-*/%"[random_() % 5]);
  }

 private:
  Sample Leaf() {
    // Variables and literals alike, so that both folding and the interpreter compute.
    switch (random_() % 6) {
      case 0:
        return {"i", false, 7, false};
      case 1:
        return {"j", false, -3, false};
      case 2:
        return {"x", true, 2.5, false};
      case 3:
        return {"big", false, 2000000000, false};
      case 4: {
        const int value = static_cast<int>(random_() % 300);
        return {std::to_string(value), false, static_cast<double>(value), false};
      }
      default: {
        const int value = static_cast<int>(random_() % 40);
        const int thousandths = value % 8 * 125;
        std::string digits = std::to_string(thousandths);
        digits.insert(0, 3 - digits.size(), '0');
        return {std::to_string(value / 8) + "." + digits, true, value / 8.0, false};
      }
    }
  }

  Sample Negate(const Sample& a) {
    Sample result = a;
    result.text = "-(" + a.text + ")";
    result.value = -a.value;
    if (!a.is_float && -a.value > 2147483647.0) result.faults = true;
    return result;
  }

  static Sample Combine(const Sample& a, const Sample& b, char op) {
    Sample result;
    result.text = "(" + a.text + " " + op + " " + b.text + ")";
    result.is_float = a.is_float || b.is_float;
    result.faults = a.faults || b.faults;
    if (result.faults) return result;
    if (result.is_float) {
      const auto x = static_cast<float>(a.value), y = static_cast<float>(b.value);
      if ((op == '/' || op == '%') && y == 0) {
        result.faults = true;
        return result;
      }
      const float value = op == '+'   ? x + y
                          : op == '-' ? x - y
                          : op == '*' ? x * y
                          : op == '/' ? x / y
                                      : std::fmod(x, y);
      result.value = static_cast<double>(value);
      result.faults = !std::isfinite(value);
      return result;
    }
    const auto x = static_cast<int64_t>(a.value), y = static_cast<int64_t>(b.value);
    if ((op == '/' || op == '%') && y == 0) {
      result.faults = true;
      return result;
    }
    const int64_t value = op == '+'   ? x + y
                          : op == '-' ? x - y
                          : op == '*' ? x * y
                          : op == '/' ? x / y
                                      : x % y;
    result.value = static_cast<double>(value);
    result.faults = value > 2147483647 || value < -2147483648LL;
    return result;
  }

  std::mt19937 random_;
};

TEST(ArithmeticTest, RandomExpressionsAgreeWithTheHost) {
  Generator generator(99);
  int faults = 0;
  for (int round = 0; round < 400; ++round) {
    const Sample sample = generator.Expression(4);
    const std::string text =
        "role Test extends Module { startup go() { var i = 7; var j = -3; var x = 2.5; "
        "var big = 2000000000; if (i + j + x + big < 0) return; self.JOINT_1.SET_POSITION(" +
        sample.text + "); } }";
    const CompileResult result = Compile(text);
    ASSERT_TRUE(result.image) << Render(result.diagnostics, result.sources, false);
    const auto program = std::make_unique<vm::VerifiedProgram>();
    ASSERT_EQ(vm::Verifier::Verify(result.image->data(),
                                   static_cast<uint32_t>(result.image->size()), program.get())
                  .message,
              nullptr);
    const std::vector<std::string> events = RunRole(*program, "Test");
    ASSERT_EQ(events.size(), 1u) << text;
    if (sample.faults) {
      ++faults;
      EXPECT_NE(events[0].find(" in line 1"), std::string::npos) << events[0] << "\n" << text;
      continue;
    }
    ASSERT_EQ(events[0].rfind("position 0 ", 0), 0u) << events[0] << "\n" << text;
    EXPECT_EQ(std::stof(events[0].substr(11)), static_cast<float>(sample.value)) << text;
  }
  EXPECT_GT(faults, 10);
  EXPECT_LT(faults, 300);
}

// ---- Types that are found, not written ----

std::string Signatures(const std::string& text) {
  const CompileResult result = Compile(text);
  EXPECT_TRUE(result.image) << Render(result.diagnostics, result.sources, false);
  if (!result.image) return "";
  const std::string code =
      vm::DisassembleImage(result.image->data(), static_cast<uint32_t>(result.image->size()));
  std::string signatures;
  std::istringstream lines(code);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("function ", 0) == 0 && line.find("go(") == std::string::npos) {
      signatures += line.substr(line.find('.') + 1, line.find("  ;") - line.find('.') - 1) + "\n";
    }
  }
  return signatures;
}

TEST(InferenceTest, BodiesDecideBeforeCalls) {
  EXPECT_EQ(Signatures("role A extends Module { startup go() { f(1); }"
                       " function f(n) { self.sleepds(n); } }"),
            "f(float) -> void\n");
}

TEST(InferenceTest, CallsDecideWhereBodiesDoNot) {
  EXPECT_EQ(Signatures("role A extends Module { startup go() { self.sleepds(f(1)); }"
                       " function f(n) { return n + n; } }"),
            "f(int) -> int\n");
  EXPECT_EQ(Signatures("role A extends Module { startup go() { self.sleepds(f(1) + f(0.5)); }"
                       " function f(n) { return n + n; } }"),
            "f(float) -> float\n");
}

TEST(InferenceTest, NumbersBesideAParameterAreTheLastResort) {
  EXPECT_EQ(Signatures("role A extends Module { command c(n) { if (n > 2) self.sleepds(1); } }"),
            "c(int) -> void\n");
}

TEST(InferenceTest, TypesTravelThroughChainsOfCalls) {
  EXPECT_EQ(Signatures("role A extends Module {"
                       " startup go() { self.jointRotateDegrees(pick(true), 3); }"
                       " function pick(first) { if (first) return one(); return self.JOINT_2; }"
                       " function one() { return self.joints($ANY, 1); }"
                       " command c(d, r, v) { g(d, r, v); }"
                       " function g(a, b, c) {"
                       "   if (self.connected(a, b) == 1) self.sleepcs(2 * (c - 1)); } }"),
            "pick(bool) -> joint\none() -> joint\nc(direction, role, float) -> void\n"
            "g(direction, role, float) -> void\n");
}

TEST(InferenceTest, AnnotationsWin) {
  EXPECT_EQ(Signatures("role A extends Module { command c(float n, role r, axis a) {"
                       " if (n > 2) self.sleepds(1); } }"),
            "c(float, role, axis) -> void\n");
}

}  // namespace
}  // namespace morphbus::dynarole
