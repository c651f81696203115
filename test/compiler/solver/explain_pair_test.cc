#include "compiler/solver/explain_pair.h"

#include <gtest/gtest.h>

#include <cmath>

#include "test/compiler/solver/known_modules.h"

namespace morphbus::solver {
namespace {

using test::And;
using test::Coincident;
using test::Not;

/// The condition's parts with spans that tell them apart: part i lies at [10 i, 10 i + 5).
Condition Numbered(Condition condition) {
  for (size_t i = 0; i < condition.children.size(); ++i) {
    condition.children[i].span = {0, 10 * i, 10 * i + 5};
  }
  return condition;
}

PairExplanation Explain(const model::ModuleType& type, Condition condition, const char* a,
                        const char* b) {
  return ExplainPair(test::SelfConnection(std::move(condition)), {type}, *type.FindConnector(a),
                     *type.FindConnector(b));
}

TEST(ExplainPair, ShowsTheFourKeptAndTheFourInsideOfMtran) {
  const PairExplanation explanation = Explain(
      test::Mtran(), And({test::AllPointsCoincide(4), test::OppositeGenders(true)}), "c6", "c3");
  EXPECT_TRUE(explanation.complete);
  EXPECT_TRUE(explanation.failures.empty());
  ASSERT_EQ(explanation.candidates.size(), 8U);
  for (size_t i = 0; i < 8; ++i) {
    const ExplainedCandidate& candidate = explanation.candidates[i];
    EXPECT_TRUE(candidate.failures.empty());
    EXPECT_EQ(candidate.kept(), i < 4);
    if (i < 4) continue;
    // The blocks are 2 wide and lie in the same place.
    ASSERT_FALSE(candidate.overlaps.empty());
    EXPECT_NE(candidate.overlaps[0].link_a, 2) << "the bars are thin";
    EXPECT_GT(candidate.overlaps[0].depth_m, 0.9);
  }
}

TEST(ExplainPair, NamesTheAttributesThatRuleAPairOut) {
  const Condition condition =
      Numbered(And({Coincident(""), test::Compare(Side::kA, "gender", std::string("male")),
                    test::Compare(Side::kB, "gender", std::string("female"))}));
  const PairExplanation explanation = Explain(test::Mtran(), condition, "c4", "c1");
  EXPECT_TRUE(explanation.candidates.empty());
  ASSERT_EQ(explanation.failures.size(), 2U);
  EXPECT_EQ(explanation.failures[0].span.begin, 10U);
  EXPECT_EQ(explanation.failures[0].measured, "c4.gender is \"female\"");
  EXPECT_EQ(explanation.failures[1].span.begin, 20U);
  EXPECT_EQ(explanation.failures[1].measured, "c1.gender is \"male\"");
}

TEST(ExplainPair, GivesBothAlternativesOfAnOr) {
  const PairExplanation explanation = Explain(
      test::Mtran(), And({test::AllPointsCoincide(4), test::OppositeGenders(true)}), "c1", "c2");
  ASSERT_EQ(explanation.failures.size(), 2U);
  EXPECT_EQ(explanation.failures[0].measured, "c2.gender is \"male\"");
  EXPECT_EQ(explanation.failures[1].measured, "c1.gender is \"male\"");
}

TEST(ExplainPair, MeasuresTheConditionsThatAMotionBreaks) {
  // Three points fix the motion; that _4 must stay off the partner's _4 rules out one turn.
  Condition fourth = Coincident("_4");
  fourth.q.kind = PointRef::Kind::kSubpoint;
  fourth.q.subpoint = "_4";
  const Condition condition =
      Numbered(And({Coincident(""), Coincident("_1"), Coincident("_2"), fourth}));
  const PairExplanation explanation = Explain(test::Molecube(), condition, "c1", "c2");
  size_t kept = 0;
  for (const ExplainedCandidate& candidate : explanation.candidates) {
    kept += candidate.kept() ? 1 : 0;
    for (const Failure& failure : candidate.failures) {
      EXPECT_EQ(failure.span.begin, 30U);
      EXPECT_NE(failure.measured.find("a.c1._4 is "), std::string::npos) << failure.measured;
      EXPECT_NE(failure.measured.find(" m from b.c2._4"), std::string::npos) << failure.measured;
    }
  }
  EXPECT_EQ(kept, 1U);
  // The literal itself is the first correspondence tried, so that no turn is left to fail it ...
  const Condition negated = And({test::AllPointsCoincide(4), Not(fourth)});
  // ... but its negation is only checked.
  size_t failed = 0;
  for (const ExplainedCandidate& candidate :
       Explain(test::Molecube(), negated, "c1", "c2").candidates) {
    if (candidate.failures.empty()) continue;
    ++failed;
    EXPECT_EQ(candidate.failures[0].measured, "this holds, but must not");
  }
  EXPECT_EQ(failed, 2U) << "one of the four turns, outside and inside";
}

TEST(ExplainPair, SaysWhereNoPartnerFits) {
  model::ModuleType type = test::Molecube();
  for (Eigen::Vector3d& p : type.connectors[1].subpoints) {
    p = type.connectors[1].p_MoCo_M + 0.5 * (p - type.connectors[1].p_MoCo_M);
  }
  const PairExplanation explanation = Explain(type, test::AllPointsCoincide(4), "c1", "c2");
  EXPECT_TRUE(explanation.candidates.empty());
  ASSERT_TRUE(explanation.dead_end.has_value());
  EXPECT_NE(explanation.dead_end->measured.find("a's is 0.5 m away, b's 0.25 m"), std::string::npos)
      << explanation.dead_end->measured;
}

}  // namespace
}  // namespace morphbus::solver
