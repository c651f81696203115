// Who extends whom and who calls whom, on programs whose code is not looked at: the facts of their
// functions are made up.

#include "vm/image/call_checker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "test/vm/image_builder.h"
#include "vm/image/opcodes.h"
#include "vm/image/role_tree.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {
namespace {

/// Roles, each with its parent (-1: none), which have a method of their own in each of two slots:
/// functions 2 i and 2 i + 1 are those of role i.
class CallCheckerTest : public testing::Test {
 protected:
  void Make(const std::vector<int>& parents) {
    TestImage image;
    image.functions.assign(2 * parents.size(), TestFunction{});
    image.roles.assign(parents.size(), TestRole{});
    for (size_t i = 0; i < parents.size(); ++i) {
      TestRole& role = image.roles[i];
      role.parent = parents[i];
      role.depth = parents[i] < 0 ? 0 : image.roles[static_cast<size_t>(parents[i])].depth + 1;
      role.methods = {static_cast<int>(2 * i), static_cast<int>(2 * i + 1)};
      for (size_t f = 2 * i; f < 2 * i + 2; ++f) {
        image.functions[f].role = static_cast<int>(i);
        image.functions[f].code = Op(Opcode::kReturn);
      }
    }
    bytes_ = image.Build();
    ASSERT_EQ(Verifier::Verify(bytes_.data(), static_cast<uint32_t>(bytes_.size()), program_.get())
                  .message,
              nullptr);
    tree_.Plant(*program_);
    facts_.assign(2 * parents.size(), CodeFacts{});
  }

  /// "" if nothing is wrong with the calls that the facts tell of.
  std::string Check() {
    FirstError error;
    const auto calls = std::make_unique<CallChecker>(*program_, tree_, facts_.data(), &error);
    const bool good = calls->CheckCalls() && calls->CheckEffects();
    EXPECT_EQ(good, error.error().message == nullptr);
    return good ? "" : error.error().message;
  }

  std::vector<uint8_t> bytes_;
  std::unique_ptr<VerifiedProgram> program_ = std::make_unique<VerifiedProgram>();
  RoleTree tree_;
  std::vector<CodeFacts> facts_;
};

TEST_F(CallCheckerTest, TheTreeHasEachRoleBelowThoseThatItExtends) {
  Make({-1, 0, 0, 1, -1});
  for (int role = 0; role < 5; ++role) {
    for (int above = 0; above < 5; ++above) {
      EXPECT_EQ(tree_.IsA(role, above), program_->IsA(role, above)) << role << " " << above;
    }
    std::vector<int> children;
    for (int i = tree_.FirstChild(role); i >= 0; i = tree_.NextSibling(i)) children.push_back(i);
    std::sort(children.begin(), children.end());
    std::vector<int> expected;
    for (int i = 0; i < 5; ++i) {
      if (program_->role(i).parent == role) expected.push_back(i);
    }
    EXPECT_EQ(children, expected) << role;
  }
}

TEST_F(CallCheckerTest, ASlotMayReachTheFunctionsOfAllSubroles) {
  Make({-1, 0, 0, 1});
  facts_[0].methods_called = 0b10;
  EXPECT_EQ(Check(), "");
  // Only what the last role has in the slot closes a circle.
  facts_[7].methods_called = 0b01;
  facts_[6].methods_called = 0b10;
  EXPECT_EQ(Check(), "functions call each other in a circle");
}

TEST_F(CallCheckerTest, ARoleBesideIsNotReached) {
  Make({-1, -1});
  facts_[0].methods_called = 0b10;
  facts_[3].methods_called = 0b01;
  EXPECT_EQ(Check(), "");
}

TEST_F(CallCheckerTest, CellsOfAllThatIsCalledAreCounted) {
  Make({-1, 0});
  facts_[0].methods_called = 0b10;
  facts_[0].max_stack = 10;
  facts_[3].max_stack = kStackCells - 10;
  EXPECT_EQ(Check(), "");
  ++facts_[3].max_stack;
  EXPECT_EQ(Check(), "task needs too many cells");
}

TEST_F(CallCheckerTest, DepthIsBounded) {
  // Each role's method calls the one that it replaces.
  for (const int depth : {kMaxCallDepth, kMaxCallDepth + 1}) {
    std::vector<int> parents;
    for (int i = 0; i < depth; ++i) parents.push_back(i - 1);
    Make(parents);
    for (int i = 1; i < depth; ++i) {
      facts_[static_cast<size_t>(2 * i)].super_called = static_cast<uint16_t>(2 * (i - 1) + 1);
    }
    EXPECT_EQ(Check(), depth == kMaxCallDepth ? "" : "calls nest too deep");
  }
}

TEST_F(CallCheckerTest, KeywordsOfWhatIsReplacedAreNeeded) {
  Make({-1, 0});
  facts_[0].keywords = 1;
  facts_[2].keywords = 2;
  facts_[2].super_called = 1;
  EXPECT_EQ(Check(), "");
  EXPECT_EQ(facts_[2].keywords, 3U);
  EXPECT_EQ(facts_[0].keywords, 1U);
}

}  // namespace
}  // namespace morphbus::vm
