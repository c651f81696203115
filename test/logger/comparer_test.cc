#include "logger/compare/comparer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "logger/log/facts_text.h"
#include "logger/show/report.h"
#include "test/logger/temp_log.h"

namespace morphbus::logger {
namespace {

using test::SyntheticOptions;

constexpr double kDegree = std::numbers::pi / 180.0;

RunLog Load(const std::string& path) {
  Result<RunLog> log = LoadRunLog(path);
  EXPECT_TRUE(log.has_value()) << (log ? "" : log.error().message);
  return log ? std::move(*log) : RunLog{};
}

Comparison CompareLoaded(const std::string& a, const std::string& b) {
  return Compare(Load(a), Load(b));
}

Comparison CompareTo(const SyntheticOptions& other) {
  const TempLog a;
  const TempLog b(other);
  return CompareLoaded(a.path(), b.path());
}

SyntheticOptions Two() {
  SyntheticOptions options;
  options.robot = "two";
  options.run = "congruent";
  return options;
}

const Item& First(const Comparison& comparison) {
  static const Item none;
  EXPECT_TRUE(comparison.first.has_value());
  return comparison.first ? comparison.items[*comparison.first] : none;
}

TEST(MatcherTest, ModulesMatchByRoleWhateverTheirNames) {
  const TempLog a;
  const TempLog b(Two());
  const RunLog log_a = Load(a.path());
  const RunLog log_b = Load(b.path());
  const Matching matching = Match(log_a, log_b, 2'000'000);
  ASSERT_EQ(matching.pairs.size(), 3u);
  EXPECT_TRUE(matching.unmatched.empty());
  const std::map<std::string, std::pair<std::string, std::string>> expected = {
      {"Root", {"m1", "k3"}}, {"Middle", {"m2", "k1"}}, {"Tip", {"m3", "k2"}}};
  for (const ModulePair& pair : matching.pairs) {
    EXPECT_EQ(log_a.modules[pair.a].name, expected.at(pair.role).first);
    EXPECT_EQ(log_b.modules[pair.b].name, expected.at(pair.role).second);
    EXPECT_LT(pair.distance_m, 1e-6);
    EXPECT_EQ(pair.taken_a_us, 100'000);
  }
}

TEST(MatcherTest, LinksOfAModuleMountedBackToFrontMatchByLabelAndPlace) {
  const TempLog a;
  const TempLog b(Two());
  const RunLog log_a = Load(a.path());
  const RunLog log_b = Load(b.path());
  for (const ModulePair& pair : Match(log_a, log_b, 2'000'000).pairs) {
    const bool reversed = pair.role == "Middle";
    ASSERT_EQ(pair.links.size(), 3u);
    EXPECT_EQ(pair.links[0].label, "");
    for (const LinkPair& link : pair.links) {
      EXPECT_EQ(link.link_b, reversed ? 1 - link.link_a : link.link_a) << pair.role << link.label;
    }
    ASSERT_EQ(pair.joints.size(), 1u);
    EXPECT_TRUE(pair.joints[0].labelled);
    EXPECT_TRUE(pair.joints[0].convention);
    EXPECT_EQ(pair.joints[0].sign_b, pair.role == "Tip" ? -1 : 1);
  }
}

TEST(MatcherTest, SeveralHoldersOfOneRoleMatchByWhereTheyAre) {
  const auto all_alike = [](const std::string&, status_t* status) {
    if (!status->role_name.empty()) status->role_name = "Segment";
  };
  SyntheticOptions one;
  one.on_status = all_alike;
  SyntheticOptions two = Two();
  two.on_status = all_alike;
  const TempLog a(one);
  const TempLog b(two);
  const RunLog log_a = Load(a.path());
  const RunLog log_b = Load(b.path());
  const Matching matching = Match(log_a, log_b, 2'000'000);
  ASSERT_EQ(matching.pairs.size(), 3u);
  const std::map<std::string, std::string> expected = {{"m1", "k3"}, {"m2", "k1"}, {"m3", "k2"}};
  for (const ModulePair& pair : matching.pairs) {
    EXPECT_EQ(expected.at(log_a.modules[pair.a].name), log_b.modules[pair.b].name);
  }
  EXPECT_EQ(Compare(log_a, log_b).verdict, Verdict::kEquivalent);
}

TEST(ComparerTest, LogIsEquivalentToItself) {
  const TempLog log;
  const Comparison comparison = CompareLoaded(log.path(), log.path());
  EXPECT_EQ(comparison.verdict, Verdict::kEquivalent) << comparison.reason;
  EXPECT_EQ(comparison.max_position_m, 0.0);
  EXPECT_EQ(comparison.max_rotation_rad, 0.0);
  EXPECT_FALSE(comparison.first.has_value());
  EXPECT_EQ(comparison.compared_until_us, 1'980'000);
}

TEST(ComparerTest, CongruentRobotsWithOtherNamesAndMountingsAreEquivalent) {
  const Comparison comparison = CompareTo(Two());
  EXPECT_EQ(comparison.verdict, Verdict::kEquivalent) << ComparisonText(comparison, true);
  EXPECT_LT(comparison.max_position_m, 1e-6);
  EXPECT_LT(comparison.max_rotation_rad, 1e-5);
  for (const Item& item : comparison.items) {
    EXPECT_GT(item.samples, 0) << item.role << " " << QuantityName(item.quantity);
    EXPECT_EQ(item.missing, 0);
  }
}

TEST(ComparerTest, EveryQuantityIsComparedForEveryRole) {
  const TempLog log;
  const Comparison comparison = CompareLoaded(log.path(), log.path());
  std::map<std::string, std::map<Quantity, int>> count;
  for (const Item& item : comparison.items) ++count[item.role][item.quantity];
  for (const char* role : {"Root", "Middle", "Tip"}) {
    EXPECT_EQ(count[role][Quantity::kRole], 1);
    EXPECT_EQ(count[role][Quantity::kPropagatedPosition], 3);
    EXPECT_EQ(count[role][Quantity::kSimulatedRotation], 3);
    EXPECT_EQ(count[role][Quantity::kJointAngle], 1);
    EXPECT_EQ(count[role][Quantity::kCommand], 1);
  }
  EXPECT_EQ(count["(root body)"][Quantity::kSimulatedPosition], 1);
}

/// One angle in one SENSORS message, one degree off; END vouches for it or not.
void ExpectAlteredAngleIsNamed(bool stale_end) {
  SyntheticOptions options = Two();
  options.stale_end = stale_end;
  options.on_sensors = [](sensors_t* sensors) {
    if (sensors->header.tick == 61) sensors->modules[1].joint_position_si[0] += kDegree;  // k2
  };
  const Comparison comparison = CompareTo(options);
  EXPECT_EQ(comparison.verdict, Verdict::kDifferent) << ComparisonText(comparison, true);
  const Item& first = First(comparison);
  EXPECT_EQ(first.role, "Tip");
  EXPECT_EQ(first.label, "bend");
  EXPECT_EQ(first.quantity, Quantity::kJointAngle);
  EXPECT_EQ(first.first_over_us, 61 * 20'000);
  EXPECT_NEAR(first.first_over, kDegree, 1e-9);
  EXPECT_NEAR(comparison.max_rotation_rad, kDegree, 1e-9);
  EXPECT_EQ(comparison.notes.empty(), !stale_end);
}

TEST(ComparerTest, OneAngleAlteredByOneDegreeIsNamedByRoleQuantityAndTime) {
  ExpectAlteredAngleIsNamed(false);
}

TEST(ComparerTest, AlteredAngleIsNamedEvenWhereEndNoLongerVouches) {
  ExpectAlteredAngleIsNamed(true);
}

TEST(ComparerTest, AlteredCommandIsNamed) {
  SyntheticOptions options;
  options.on_actuator = [](const std::string& module, actuator_t* actuator) {
    if (module == "m2" && actuator->header.tick == 30) actuator->joints[0].target_si -= kDegree;
  };
  const Comparison comparison = CompareTo(options);
  EXPECT_EQ(comparison.verdict, Verdict::kDifferent);
  EXPECT_EQ(First(comparison).role, "Middle");
  EXPECT_EQ(First(comparison).quantity, Quantity::kCommand);
  EXPECT_EQ(First(comparison).first_over_us, 600'000);
}

TEST(ComparerTest, CommandOfAnotherModeIsNamed) {
  SyntheticOptions options;
  options.on_actuator = [](const std::string& module, actuator_t* actuator) {
    if (module != "m2" || actuator->header.tick != 30) return;
    actuator->joints[0].mode = joint_command_t::MODE_HOLD;
    actuator->joints[0].target_si = 0;
    actuator->joints[0].speed_si = 0;
  };
  EXPECT_EQ(First(CompareTo(options)).quantity, Quantity::kCommand);
}

TEST(ComparerTest, AlteredPropagatedPoseIsNamedWithItsLink) {
  SyntheticOptions options;
  options.on_transform = [](const std::string& module, transform_t* transform) {
    if (module == "m3" && transform->header.tick == 70) {
      transform->link_poses[1].position_m[1] += 0.0005f;
    }
  };
  const Comparison comparison = CompareTo(options);
  EXPECT_EQ(First(comparison).role, "Tip");
  EXPECT_EQ(First(comparison).label, "far");
  EXPECT_EQ(First(comparison).quantity, Quantity::kPropagatedPosition);
  EXPECT_NEAR(First(comparison).first_over, 5e-4, 1e-6);
}

TEST(ComparerTest, SimulatedDifferencesBelowToleranceAreEquivalentAndAboveAreNot) {
  for (const double shift : {0.0008, 0.0013}) {
    SyntheticOptions options;
    options.on_world = [shift](world_t* world) {
      if (world->header.tick < 50) return;
      for (body_pose_t& body : world->bodies) body.position_m[0] += shift;
    };
    const Comparison comparison = CompareTo(options);
    EXPECT_NEAR(comparison.max_position_m, shift, 1e-9);
    if (shift < 0.001) {
      EXPECT_EQ(comparison.verdict, Verdict::kEquivalent);
    } else {
      EXPECT_EQ(comparison.verdict, Verdict::kDifferent);
      EXPECT_EQ(First(comparison).quantity, Quantity::kSimulatedPosition);
      EXPECT_EQ(First(comparison).first_over_us, 1'000'000);
    }
  }
}

TEST(ComparerTest, LinksAreFoundInTheWorldAfterAConnectionOpened) {
  // From tick 50 on m3's base is a body of its own, though it stays where it was.
  SyntheticOptions options;
  options.on_sensors = [](sensors_t* sensors) {
    if (sensors->header.tick < 50) return;
    sensors->modules[1].docked.clear();
    sensors->modules[1].num_docked = 0;
  };
  options.on_world = [](world_t* world) {
    if (world->header.tick < 50) return;
    const auto arm =
        std::find_if(world->bodies.begin(), world->bodies.end(),
                     [](const body_pose_t& b) { return b.module_id == 1 && b.link == 1; });
    ASSERT_NE(arm, world->bodies.end());
    body_pose_t base = *arm;
    base.module_id = 2;
    base.link = 0;
    const double* w = arm->orientation_wxyz;
    Eigen::Map<Eigen::Vector3d>(base.position_m) +=
        Eigen::Quaterniond(w[0], w[1], w[2], w[3]) * Eigen::Vector3d(0.1, 0, 0);
    world->bodies.insert(arm + 1, base);
    ++world->num_bodies;
  };
  const TempLog a;
  const TempLog b(options);
  const Comparison comparison = CompareLoaded(a.path(), b.path());
  EXPECT_EQ(First(comparison).quantity, Quantity::kDocking) << ComparisonText(comparison, true);
  EXPECT_EQ(First(comparison).first_over_us, 1'000'000);
  EXPECT_LT(comparison.max_position_m, 1e-9);
  CompareOptions without_sensors;
  without_sensors.without = {"sensors"};
  EXPECT_EQ(Compare(Load(a.path()), Load(b.path()), without_sensors).verdict, Verdict::kEquivalent);
}

TEST(ComparerTest, WhereARobotStandsInTheWorldIsNoDifference) {
  SyntheticOptions options;
  options.on_world = [](world_t* world) {
    for (body_pose_t& body : world->bodies) {
      body.position_m[0] += 3.0;
      body.position_m[1] += 0.02;
    }
  };
  EXPECT_EQ(CompareTo(options).verdict, Verdict::kEquivalent);
}

TEST(ComparerTest, ShiftedMotionIsDifferentFromItsFirstTickOn) {
  SyntheticOptions options;
  options.role_tick = 9;
  const Comparison comparison = CompareTo(options);
  EXPECT_EQ(comparison.verdict, Verdict::kDifferent);
  EXPECT_EQ(First(comparison).quantity, Quantity::kRole);
  EXPECT_EQ(First(comparison).first_over_us, 100'000);
  EXPECT_NEAR(First(comparison).first_over, 0.08, 1e-9);
}

TEST(ComparerTest, RoleThatNobodyPlaysIsDifferent) {
  SyntheticOptions options;
  options.tip_role = "Tail";
  const Comparison comparison = CompareTo(options);
  EXPECT_EQ(comparison.verdict, Verdict::kDifferent);
  EXPECT_EQ(comparison.matching.unmatched.size(), 2u);
  EXPECT_EQ(First(comparison).quantity, Quantity::kRole);
}

TEST(ComparerTest, LabelThatOnlyOneResolvedIsDifferent) {
  SyntheticOptions options;
  options.on_status = [](const std::string& module, status_t* status) {
    if (module != "m2" || status->labels.empty()) return;
    status->labels.pop_back();
    status->num_labels = 2;
  };
  const Comparison comparison = CompareTo(options);
  EXPECT_EQ(comparison.verdict, Verdict::kDifferent);
  EXPECT_EQ(First(comparison).label, "far");
  EXPECT_NE(First(comparison).detail.find("B did not resolve"), std::string::npos);
}

TEST(ComparerTest, LongerRunIsDifferentInDurationOnly) {
  SyntheticOptions options;
  options.ticks = 120;
  const Comparison comparison = CompareTo(options);
  EXPECT_EQ(comparison.verdict, Verdict::kDifferent);
  EXPECT_EQ(First(comparison).quantity, Quantity::kDuration);
  EXPECT_NEAR(First(comparison).max, 0.4, 1e-9);
  EXPECT_LT(comparison.max_rotation_rad, 1e-6);
}

TEST(ComparerTest, CutLogIsNeverEquivalent) {
  SyntheticOptions options;
  options.end = false;
  const Comparison comparison = CompareTo(options);
  EXPECT_EQ(comparison.verdict, Verdict::kUnusable);
  ASSERT_EQ(comparison.notes.size(), 1u);
  EXPECT_NE(comparison.notes[0].find("no END"), std::string::npos);
}

TEST(ComparerTest, DamagedLogIsComparedUpToTheDamageAndNeverEquivalent) {
  std::vector<uint8_t> bytes = test::EncodeLog(test::SyntheticEvents({}));
  bytes[bytes.size() / 2] ^= 0x20;
  const TempLog a;
  const TempLog b(bytes);
  const Comparison comparison = CompareLoaded(a.path(), b.path());
  EXPECT_EQ(comparison.verdict, Verdict::kUnusable);
  EXPECT_LT(comparison.compared_until_us, 1'200'000);
  EXPECT_GT(comparison.compared_until_us, 700'000);
  EXPECT_FALSE(comparison.notes.empty());
}

TEST(ComparerTest, DifferenceBeforeTheDamageIsStillADifference) {
  SyntheticOptions options;
  options.on_sensors = [](sensors_t* sensors) {
    if (sensors->header.tick == 20) sensors->modules[0].joint_position_si[0] += kDegree;
  };
  std::vector<uint8_t> bytes = test::EncodeLog(test::SyntheticEvents(options));
  bytes[bytes.size() * 3 / 4] ^= 0x20;
  const TempLog a;
  const TempLog b(bytes);
  const Comparison comparison = CompareLoaded(a.path(), b.path());
  EXPECT_EQ(comparison.verdict, Verdict::kDifferent);
  EXPECT_EQ(First(comparison).role, "Root");
}

TEST(ComparerTest, ContentThatEndDoesNotVouchForIsUnusableWithoutADifference) {
  // Below every tolerance, yet not what was published.
  SyntheticOptions options;
  options.stale_end = true;
  options.on_actuator = [](const std::string&, actuator_t* m) { m->joints[0].target_si += 1e-9; };
  const Comparison comparison = CompareTo(options);
  EXPECT_EQ(comparison.verdict, Verdict::kUnusable);
}

TEST(ComparerTest, LogWithoutDescriptionIsUnusableAndSaysSo) {
  SyntheticOptions options;
  options.description = false;
  const Comparison comparison = CompareTo(options);
  EXPECT_EQ(comparison.verdict, Verdict::kUnusable);
  EXPECT_NE(comparison.reason.find("description"), std::string::npos);
}

TEST(ComparerTest, JointsWithoutConventionCompareByWhereTheirAxesLie) {
  const auto no_signs = [](const std::string&, status_t* status) {
    for (int8_t& sign : status->joint_sign) sign = 0;
  };
  SyntheticOptions one;
  one.on_status = no_signs;
  SyntheticOptions two = Two();
  two.on_status = no_signs;
  const TempLog a(one);
  const TempLog b(two);
  EXPECT_EQ(CompareLoaded(a.path(), b.path()).verdict, Verdict::kEquivalent);
}

TEST(ComparerTest, FlippedConventionIsDifferent) {
  SyntheticOptions options = Two();
  options.on_status = [](const std::string& module, status_t* status) {
    if (module == "k2") status->joint_sign[0] = static_cast<int8_t>(-status->joint_sign[0]);
  };
  const Comparison comparison = CompareTo(options);
  EXPECT_EQ(comparison.verdict, Verdict::kDifferent);
  EXPECT_EQ(First(comparison).role, "Tip");
  EXPECT_EQ(First(comparison).label, "bend");
}

TEST(ComparerTest, JsonKeepsItsKeys) {
  SyntheticOptions options = Two();
  options.on_sensors = [](sensors_t* sensors) {
    if (sensors->header.tick == 61) sensors->modules[1].joint_position_si[0] += kDegree;
  };
  const nlohmann::json json = ComparisonJson(CompareTo(options));
  EXPECT_EQ(json["verdict"], "different");
  EXPECT_EQ(json["first_divergence"]["role"], "Tip");
  EXPECT_EQ(json["first_divergence"]["quantity"], "joint angle");
  EXPECT_NEAR(json["first_divergence"]["time"].get<double>(), 1.22, 1e-9);
  EXPECT_TRUE(json["max_position_m"].is_number());
  EXPECT_TRUE(json["max_rotation_rad"].is_number());
  EXPECT_EQ(json["roles"]["Tip"]["modules"][0]["a"], "m3");
  EXPECT_EQ(json["roles"]["Tip"]["modules"][0]["b"], "k2");
  EXPECT_TRUE(json["roles"]["Root"]["first_over"].is_null());
  const TempLog same;
  EXPECT_TRUE(
      ComparisonJson(CompareLoaded(same.path(), same.path()))["first_divergence"].is_null());
}

TEST(ComparerTest, NoTextOfALogSteersTheTerminal) {
  // Names, faults and channels of a log are bytes from elsewhere: here they would clear the screen.
  const std::string clear = "\x1b[2J\n\xff";
  SyntheticOptions options;
  options.tip_role = "Tip" + clear;
  options.on_status = [&](const std::string&, status_t* status) {
    fault_t fault{};
    fault.ended_task = fault.task_function = -1;
    status->faults = {fault};
    status->num_faults = 1;
  };
  std::vector<test::SyntheticEvent> events = test::SyntheticEvents(options);
  events.insert(events.end() - 1, {1, "synth" + clear + "/m1/STATUS", {1, 2}});
  events.insert(events.end() - 1, {1, "synth/m1/STATUS", {1, 2}});
  const TempLog a;
  const TempLog b(test::EncodeLog(events));
  const RunLog log = Load(b.path());
  EXPECT_FALSE(log.facts.faults.empty());
  const Comparison comparison = Compare(Load(a.path()), log);
  for (const std::string& text :
       {FactsText(log.facts, true), VerifyText(log.facts), ComparisonText(comparison, true)}) {
    EXPECT_FALSE(text.empty());
    EXPECT_TRUE(std::all_of(text.begin(), text.end(), [](char c) {
      return c == '\n' || (c >= 0x20 && c < 0x7f);
    })) << text;
  }
  EXPECT_NE(ComparisonText(comparison, true).find("Tip\\x1b[2J\\n\\xff"), std::string::npos);
}

TEST(ReportTest, PageIsSelfContainedAndEscapesNames) {
  SyntheticOptions options = Two();
  options.tip_role = "Tip<script>";
  const TempLog a;
  const TempLog b(options);
  const RunLog log_a = Load(a.path());
  const RunLog log_b = Load(b.path());
  std::string html = ReportHtml(log_a, log_b, Compare(log_a, log_b));
  // Pictures are in the page itself, as data whose letters may spell anything.
  const std::string data = "src='data:image/png;base64,";
  int pictures = 0;
  for (size_t at = html.find(data); at != std::string::npos; at = html.find(data)) {
    html.erase(at, html.find('\'', at + data.size()) + 1 - at);
    ++pictures;
  }
  EXPECT_GE(pictures, 2);
  EXPECT_EQ(html.find("<script"), std::string::npos);
  EXPECT_EQ(html.find("http"), std::string::npos);
  EXPECT_EQ(html.find("src="), std::string::npos);
  EXPECT_EQ(html.find("nan"), std::string::npos);
  EXPECT_NE(html.find("Tip&lt;script&gt;"), std::string::npos);
  EXPECT_NE(html.find("<svg"), std::string::npos);
  EXPECT_NE(html.find("class='banner different'"), std::string::npos);
}

TEST(ReportTest, LogsWithoutDescriptionStillMakeAPage) {
  SyntheticOptions options;
  options.description = false;
  const TempLog a(options);
  const RunLog log = Load(a.path());
  const std::string html = ReportHtml(log, log, Compare(log, log));
  EXPECT_NE(html.find("class='banner unusable'"), std::string::npos);
}

}  // namespace
}  // namespace morphbus::logger
