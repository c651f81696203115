// Who may take part in a run, and whose place a process may take.

#include "bridge/lockstep/sim/run_members.h"

#include <gtest/gtest.h>

#include "bridge/wire/arithmetic_hash.h"
#include "bridge/wire/codec.h"

namespace morphbus::bridge {
namespace {

using Welcome = RunMembers::Welcome;

constexpr uint64_t kModelHash = 11, kProgramHash = 22, kKinematicsHash = 33;
constexpr int64_t kLater = 1'000'000;

RunMembers TwoModulesAndALogger(bool realtime = false) {
  const ExpectedMembers expected = {
      kModelHash,
      kProgramHash,
      {{"m1", 0, "FAKE", kKinematicsHash}, {"m2", 1, "FAKE", kKinematicsHash}}};
  return RunMembers(expected, true, realtime);
}

/// What a process says that fits.
morphbus::hello_t Hello(const std::string& process, int64_t claim, int32_t incarnation = 1) {
  morphbus::hello_t hello;
  hello.header.model_hash = kModelHash;
  hello.header.program_hash = kProgramHash;
  hello.process = process;
  hello.pid = 7;
  hello.claim = claim;
  hello.incarnation = incarnation;
  hello.type_name = "FAKE";
  hello.kinematics_hash = kKinematicsHash;
  hello.wire_hash = static_cast<int64_t>(WireHash());
  hello.arithmetic_hash = static_cast<int64_t>(ArithmeticHash());
  return hello;
}

TEST(RunMembers, TheFirstOfANameThatFitsIsBelieved) {
  RunMembers members = TwoModulesAndALogger();
  std::string why;
  EXPECT_EQ(members.OnHello(Hello("m2", 5), {}, 0, &why), Welcome::kJoins);
  EXPECT_EQ(members.OnHello(Hello("m2", 5), {}, 0, &why), Welcome::kKnown);
  EXPECT_EQ(members.OnHello(Hello("m2", 6), {}, 0, &why), Welcome::kUnfit);
  EXPECT_EQ(why, "a second process (pid 7) claims to be m2");
  // Once the run has begun, that is no harm to it.
  EXPECT_EQ(members.OnHello(Hello("m2", 6), {.started = true}, 0, &why), Welcome::kTurnedAway);
  EXPECT_EQ(members.turned_away(), std::vector<std::string>{why});
}

TEST(RunMembers, WhoDoesNotFitIsNamedWithBothValues) {
  RunMembers members = TwoModulesAndALogger();
  std::string why;
  const auto misfit = [&](const std::string& process, auto spoil) {
    morphbus::hello_t hello = Hello(process, 5);
    spoil(&hello);
    EXPECT_EQ(members.OnHello(hello, {}, 0, &why), Welcome::kUnfit);
    return why.substr(0, why.find(" ("));
  };
  EXPECT_EQ(misfit("m1", [](auto* hello) { hello->wire_hash = 1; }),
            "m1 has another build of the wire types");
  EXPECT_EQ(misfit("LOG", [](auto* hello) { hello->header.model_hash = 1; }),
            "LOG has another model");
  EXPECT_EQ(misfit("m1", [](auto* hello) { hello->type_name = "ATRON"; }),
            "m1 is a module of type ATRON, but the robot has a FAKE there");
  EXPECT_EQ(misfit("m1", [](auto* hello) { hello->kinematics_hash = 1; }),
            "m1 has another kinematics image");
  EXPECT_EQ(misfit("m1", [](auto* hello) { hello->header.program_hash = 1; }),
            "m1 has another program");
  EXPECT_NE(why.find("0000000000000016"), std::string::npos) << why;
  // A logger runs no program.
  morphbus::hello_t logger = Hello("LOG", 5);
  logger.header.program_hash = 0;
  EXPECT_EQ(members.OnHello(logger, {}, 0, &why), Welcome::kJoins);
}

TEST(RunMembers, TheHundredthAttemptOfAStrangerIsListedOnceAndOfManySixteen) {
  RunMembers members = TwoModulesAndALogger();
  std::string why;
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(members.OnHello(Hello("m77", i), {}, 0, &why), Welcome::kTurnedAway);
  }
  EXPECT_EQ(members.turned_away(), std::vector<std::string>{"'m77' is not part of this run"});
  for (int i = 0; i < 100; ++i) {
    members.OnHello(Hello("x" + std::to_string(i), i), {}, 0, &why);
  }
  EXPECT_EQ(members.turned_away().size(), 16u);
}

TEST(RunMembers, ALaterIncarnationTakesThePlaceOfAModuleThatIsSilent) {
  RunMembers members = TwoModulesAndALogger();
  std::string why;
  EXPECT_EQ(members.OnHello(Hello("m1", 5), {}, 0, &why), Welcome::kJoins);
  members.Published(0, 12, 3);
  members.Published(0, 11, 4);
  members.Heard(0, kLater);
  const morphbus::hello_t next = Hello("m1", 6, 2);
  const RunMembers::Standing silent = {.started = true};
  const auto refused = [&](const morphbus::hello_t& hello, const RunMembers::Standing& standing,
                           int64_t now_us) {
    EXPECT_EQ(members.OnHello(hello, standing, now_us, &why), Welcome::kTurnedAway);
    return why;
  };
  const std::string claims = "a process (pid 7) claims to be incarnation 2 of m1, ";
  EXPECT_EQ(refused(next, silent, kLater + 50'000), claims + "which answers");
  EXPECT_EQ(refused(next, {.started = true, .answered = true}, 2 * kLater),
            claims + "which answers");
  EXPECT_EQ(refused(next, {.started = true, .lost = true}, 2 * kLater),
            claims + "which the run goes on without");
  EXPECT_EQ(refused(next, {.started = true, .ending = true}, 2 * kLater),
            claims + "but the run is over");
  EXPECT_TRUE(members.unvouched().empty());
  EXPECT_EQ(members.OnHello(next, silent, 2 * kLater, &why), Welcome::kReplaces);
  EXPECT_FALSE(members.unvouched().empty()) << "its predecessor had published something";
  const morphbus::admit_t admission = members.AdmissionOf(0, 11);
  EXPECT_EQ(admission.module_name, "m1");
  EXPECT_EQ(admission.claim, 6);
  EXPECT_EQ(admission.last_tick, 11);
  EXPECT_EQ(admission.actuator_count, 12);
  EXPECT_EQ(admission.status_count, 4);
  // The one that it replaced has no place any more, and the logger cannot begin anew.
  EXPECT_EQ(refused(Hello("m1", 5), silent, 3 * kLater),
            "a second process (pid 7) claims to be m1");
  EXPECT_EQ(members.OnHello(Hello("LOG", 1), {}, 0, &why), Welcome::kJoins);
  EXPECT_EQ(refused(Hello("LOG", 2, 2), silent, 3 * kLater),
            "a process (pid 7) claims to be incarnation 2 of LOG, which cannot begin anew");
}

TEST(RunMembers, InRealTimeSilenceAloneTellsThatAModuleIsDead) {
  RunMembers members = TwoModulesAndALogger(true);
  std::string why;
  EXPECT_EQ(members.OnHello(Hello("m1", 5), {}, 0, &why), Welcome::kJoins);
  EXPECT_EQ(members.BeginIncarnation(0), 2u);
  const RunMembers::Standing answered = {.started = true, .answered = true};
  EXPECT_EQ(members.OnHello(Hello("m1", 6, 3), answered, 50'000, &why), Welcome::kTurnedAway);
  EXPECT_EQ(members.OnHello(Hello("m1", 6, 3), answered, kLater, &why), Welcome::kReplaces);
  EXPECT_TRUE(members.unvouched().empty()) << "its predecessor had published nothing";
}

}  // namespace
}  // namespace morphbus::bridge
