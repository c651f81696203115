// How many steps the verifiers take. The compiler has each basic block of their sources call a
// function of this file, which counts (-fsanitize-coverage=trace-pc, test/vm/CMakeLists.txt); so
// every turn of every loop counts, whatever the machine is and whatever else runs on it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "test/vm/image_builder.h"
#include "vm/image/kinematics_encoder.h"
#include "vm/image/kinematics_verifier.h"
#include "vm/image/verifier.h"
#include "vm/limits.h"

namespace {
int64_t blocks_entered = 0;
}
extern "C" void __sanitizer_cov_trace_pc() { ++blocks_entered; }

namespace morphbus::vm {
namespace {

const Code kLeave = Op(Opcode::kReturn);
const Code kPushPop = Op(Opcode::kPushInt8, {1}) + Op(Opcode::kPop);

int64_t StepsOf(const std::vector<uint8_t>& image) {
  const auto program = std::make_unique<VerifiedProgram>();
  blocks_entered = 0;
  const VerifyError error =
      Verifier::Verify(image.data(), static_cast<uint32_t>(image.size()), program.get());
  const int64_t steps = blocks_entered;
  EXPECT_EQ(error.message, nullptr) << error.message;
  return steps;
}

/// One step more or less in the smallest image shall not decide.
constexpr double kMargin = 1.1;

/// That steps a byte do not grow with the image, whose sizes double up to the largest. The smallest
/// is large enough that what every image costs is little of it.
template <class Steps>
void ExpectLinear(const std::string& what, std::vector<int> sizes,
                  const std::function<std::vector<uint8_t>(int)>& build, Steps steps_of,
                  double margin = kMargin) {
  double first = 0;
  for (const int size : sizes) {
    const std::vector<uint8_t> image = build(size);
    const double steps = static_cast<double>(steps_of(image));
    const double each = steps / static_cast<double>(image.size());
    std::printf("%s %d: %zu bytes, %.0f steps, %.1f a byte\n", what.c_str(), size, image.size(),
                steps, each);
    ASSERT_GT(steps, image.size()) << "each byte is looked at";
    if (first == 0) first = each;
    EXPECT_LE(each, first * margin) << what << " of " << size;
  }
}

TEST(VerifierStepsTest, StraightCode) {
  ExpectLinear(
      "straight code", {1000, 4000, 16000},
      [](int n) {
        Code code;
        for (int i = 0; i < n; ++i) code = std::move(code) + kPushPop;
        return TestImage(code + kLeave).Build();
      },
      StepsOf);
}

TEST(VerifierStepsTest, FunctionsUpToTheirLimit) {
  ExpectLinear(
      "functions", {64, 128, 256, kMaxFunctions},
      [](int n) {
        TestImage image;
        image.functions.assign(static_cast<size_t>(n), TestFunction{});
        for (TestFunction& function : image.functions) {
          function.locals.assign(8, ValueType::kInt);
          function.code = kPushPop + kPushPop + kLeave;
        }
        return image.Build();
      },
      StepsOf);
}

TEST(VerifierStepsTest, JumpsAreFoundByHalving) {
  // The one step that is not linear: from 256 joins to 3072 a search takes four turns more, of what
  // all else that a jump costs. There are at most 2^16 joins.
  ExpectLinear(
      "jumps", {256, 1024, 3072},
      [](int n) {
        TestImage image(Code{});
        image.constants = {{ValueType::kBool, 1}};
        TestFunction& function = image.functions[0];
        for (int i = 0; i < n; ++i) {
          // Each over a few instructions; a join has a state of its own.
          const int target = static_cast<int>(function.code.size()) + 9;
          function.code = std::move(function.code) + Op16(Opcode::kPushConst, 0) +
                          Op16(Opcode::kJumpIfFalse, target) + kPushPop;
          function.joins.push_back({target, 0, {}});
        }
        function.code = std::move(function.code) + kLeave;
        return image.Build();
      },
      StepsOf, 1.25);
}

/// A chain of roles, each of which replaces all members that it inherits. The members of the first
/// half of the slots call all of the second half, which may be those of any role further down.
TestImage Chain(int roles, int slots) {
  TestImage image;
  image.functions.clear();
  image.roles.assign(static_cast<size_t>(roles), TestRole{});
  for (int r = 0; r < roles; ++r) {
    TestRole& role = image.roles[static_cast<size_t>(r)];
    role.parent = r - 1;
    role.depth = r;
    for (int slot = 0; slot < slots; ++slot) {
      TestFunction function;
      function.role = r;
      for (int callee = slots / 2; slot < slots / 2 && callee < slots; ++callee) {
        function.code = std::move(function.code) + Op(Opcode::kCall, {callee});
      }
      function.code = std::move(function.code) + kLeave;
      role.methods.push_back(static_cast<int>(image.functions.size()));
      image.functions.push_back(function);
    }
  }
  return image;
}

TEST(VerifierStepsTest, DeepHierarchiesWhoseMembersAreReplacedEverywhere) {
  ExpectLinear(
      "chain of roles", {8, 16, 32}, [](int n) { return Chain(n, 16).Build(); }, StepsOf);
  ExpectLinear(
      "long chain of roles", {8, 16, 32, kMaxRoles}, [](int n) { return Chain(n, 8).Build(); },
      StepsOf);
}

TEST(VerifierStepsTest, ManyRolesBelowOne) {
  // All replace one member, and those of the first role call it from many functions.
  ExpectLinear(
      "fan of roles", {16, 32, kMaxRoles},
      [](int n) {
        TestImage image;
        image.roles.assign(static_cast<size_t>(n), TestRole{});
        image.functions.clear();
        for (int r = 0; r < n; ++r) {
          TestRole& role = image.roles[static_cast<size_t>(r)];
          role.parent = r == 0 ? -1 : 0;
          role.depth = r == 0 ? 0 : 1;
          role.methods = {static_cast<int>(image.functions.size())};
          TestFunction function;
          function.role = r;
          function.code = kLeave;
          image.functions.push_back(function);
          for (int k = 0; k < 7; ++k) {
            TestFunction caller;
            // Most of them stand in the role that has all the others below it.
            caller.role = 0;
            caller.code = Op(Opcode::kCall, {0}) + kLeave;
            image.functions.push_back(caller);
          }
        }
        return image.Build();
      },
      StepsOf);
}

TEST(VerifierStepsTest, PrintsOfTheLongestText) {
  // Each goes through its text, of 255 bytes at most, anew.
  ExpectLinear(
      "prints", {4000, 8000, 16000},
      [](int n) {
        Code code;
        for (int i = 0; i < n; ++i) code = std::move(code) + Op16(Opcode::kPrint, 0);
        TestImage image(code + kLeave);
        image.keywords = {{KeywordKind::kJoint, std::string(255, 'x')}};
        image.constants = {{ValueType::kText, 255u << 16}};
        return image.Build();
      },
      StepsOf);
}

TEST(VerifierStepsTest, KinematicsImages) {
  const auto steps_of = [](const std::vector<uint8_t>& image) {
    const auto kinematics = std::make_unique<VerifiedKinematics>();
    blocks_entered = 0;
    const VerifyError error =
        VerifyKinematics(image.data(), static_cast<uint32_t>(image.size()), kinematics.get());
    const int64_t steps = blocks_entered;
    EXPECT_EQ(error.message, nullptr) << error.message;
    return steps;
  };
  ExpectLinear(
      "connections", {100, 400, 1600},
      [](int n) {
        KinematicsTables tables;
        tables.type_name = "Type";
        for (int i = 0; i < kMaxLinks; ++i) tables.links.push_back("link" + std::to_string(i));
        for (int i = 0; i + 1 < kMaxLinks; ++i) {
          // All held together, the last of them first, so that grouping takes its longest.
          KinematicsTables::Joint joint;
          joint.name = "joint" + std::to_string(i);
          joint.kind = JointKind::kFixed;
          joint.link_a = kMaxLinks - 2 - i;
          joint.link_b = kMaxLinks - 1 - i;
          joint.axis = {0, 0, 1};
          joint.speed = 1;
          tables.joints.push_back(joint);
        }
        for (int i = 0; i < kMaxConnectors; ++i) {
          tables.connectors.push_back({"connector" + std::to_string(i), 0, {}});
        }
        for (int i = 0; i < n; ++i) {
          KinConnection connection;
          connection.connector = static_cast<uint8_t>(i % kMaxConnectors);
          connection.number = static_cast<uint16_t>(i + 1);
          connection.X_MN.q = {1, 0, 0, 0};
          tables.connections.push_back(connection);
        }
        std::string error;
        std::vector<uint8_t> image = EncodeKinematics(tables, &error);
        EXPECT_EQ(error, "");
        return image;
      },
      steps_of);
}

}  // namespace
}  // namespace morphbus::vm
