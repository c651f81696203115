// Faults as sentences: every kind names what it concerns and says what was asked and measured.

#include "vm/image/fault_text.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "test/support/compiled.h"
#include "test/support/toy_model.h"
#include "test/support/vm_robot.h"
#include "vm/image/kinematics_encoder.h"
#include "vm/image/kinematics_verifier.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {
namespace {

/// A program and the kinematics of a toy module type, verified.
class FaultTextTest : public ::testing::Test {
 protected:
  FaultTextTest()
      : program_bytes_(test::ProgramFrom(R"(
role Knee extends Module {
  startup bend() { self.jointRotateDegrees(self.TURN, 10); }
  command kick() { self.SLIDE.SET_POSITION(1); }
}
role Foot extends Module { }
)",
                                         model_)) {
    EXPECT_EQ(Verifier::Verify(program_bytes_.data(), Size(program_bytes_), &program_).message,
              nullptr);
    hinge_ = Kinematics(0, &hinge_bytes_);
    rail_ = Kinematics(1, &rail_bytes_);
    kick_ = program_.role(0).commands[0];
  }

  static uint32_t Size(const std::vector<uint8_t>& bytes) {
    return static_cast<uint32_t>(bytes.size());
  }
  std::unique_ptr<VerifiedKinematics> Kinematics(int type, std::vector<uint8_t>* bytes) {
    std::string error;
    *bytes = EncodeKinematics(test::TablesOf(model_, type), &error);
    auto kinematics = std::make_unique<VerifiedKinematics>();
    EXPECT_EQ(VerifyKinematics(bytes->data(), Size(*bytes), kinematics.get()).message, nullptr);
    return kinematics;
  }
  [[nodiscard]] std::string OfHinge(const Fault& fault) const {
    return FaultSentence(fault, {&program_, hinge_.get()});
  }
  [[nodiscard]] std::string OfRail(const Fault& fault) const {
    return FaultSentence(fault, {&program_, rail_.get()});
  }

  const model::Model model_ = test::ToyModel();
  std::vector<uint8_t> program_bytes_, hinge_bytes_, rail_bytes_;
  VerifiedProgram program_;
  std::unique_ptr<VerifiedKinematics> hinge_, rail_;
  int16_t kick_ = -1;
};

Fault Make(FaultCode code, float asked = 0, float measured = 0, float limit = 0) {
  Fault fault;
  fault.code = code;
  fault.asked = asked;
  fault.measured = measured;
  fault.limit = limit;
  return fault;
}

TEST_F(FaultTextTest, FaultsOfValuesSayWhatWasWrongWithThem) {
  EXPECT_EQ(OfHinge(Make(FaultCode::kIntegerOverflow)),
            "integer overflow: the result does not fit into 32 bits");
  EXPECT_EQ(OfHinge(Make(FaultCode::kDivisionByZero)), "division by zero");
  EXPECT_EQ(OfHinge(Make(FaultCode::kNotFinite)), "result is not a finite number");
  EXPECT_EQ(OfHinge(Make(FaultCode::kUnresolved, 0, 3)),
            "exactly one joint or link is wanted, and 3 fit");
  Fault missing = Make(FaultCode::kMissingKeyword);
  missing.keyword = 1;
  EXPECT_EQ(OfHinge(missing), "module type Hinge has no SLIDE");
  EXPECT_EQ(OfHinge(Make(FaultCode::kBudget, 0, 0, 20000)),
            "the instruction budget of 20000 is used up");
}

TEST_F(FaultTextTest, FaultsOfJointsNameTheJointItsLinksAndBothDirections) {
  Fault fault = Make(FaultCode::kLinkNotOnJoint);
  fault.joint = 2;
  fault.link = 0;
  EXPECT_EQ(OfRail(fault), "joint spin does not touch link base");
  fault = Make(FaultCode::kAxisNotAligned, 0, 90, 75);
  fault.joint = 0;
  fault.link = 1;
  fault.asked_axis = Axis::kNorthSouth;
  fault.direction_R = {0, -0.6F, -0.8F};
  EXPECT_EQ(OfHinge(fault),
            "joint turn turns link two about a direction 90.0° from $NORTH, 126.9° from $UP, "
            "143.1° from $EAST; $NORTH_SOUTH (0.0° from $NORTH, 90.0° from $UP, 90.0° from $EAST) "
            "was asked for, which is 90.0° off, either way, and may be 75° off at most");
  for (const FaultCode code : {FaultCode::kNotContinuous, FaultCode::kNotPrismatic,
                               FaultCode::kNotRotary, FaultCode::kFixedJoint}) {
    fault = Make(code);
    fault.joint = 0;
    EXPECT_EQ(OfHinge(fault).rfind("joint turn is ", 0), 0u) << OfHinge(fault);
  }
  fault = Make(FaultCode::kNotContinuous);
  fault.joint = 0;
  EXPECT_EQ(OfHinge(fault), "joint turn is revolute and cannot turn endlessly");
}

TEST_F(FaultTextTest, AmountsHaveTheUnitOfTheJointsKind) {
  Fault fault = Make(FaultCode::kTargetClamped, 90.02F, 0, 90);
  fault.joint = 0;
  EXPECT_EQ(OfHinge(fault), "joint turn was asked for 90.02° and can go to 90° only: clamped");
  fault.joint = 1;
  EXPECT_EQ(OfRail(fault), "joint slide was asked for 90.02 mm and can go to 90 mm only: clamped");
  fault = Make(FaultCode::kSpeedClamped, -100000, 0, -180);
  fault.joint = 2;
  EXPECT_EQ(OfRail(fault),
            "joint spin was asked for -100000°/s and can turn at -180°/s only: clamped");
  fault = Make(FaultCode::kStalled, 36, -0.001F, 2);
  fault.joint = 0;
  EXPECT_EQ(OfHinge(fault),
            "joint turn stalled at 0°: 36° was asked for, and within 2° of it counts as arrived");
  fault = Make(FaultCode::kTurnStalled, 90, 1.25F, 9);
  fault.joint = 2;
  EXPECT_EQ(OfRail(fault),
            "joint spin stalled at 1.25°/s: 90°/s was asked for, and below 9°/s counts as stalled");
}

TEST_F(FaultTextTest, FaultsOfConnectorsNameTheConnectorAndItsState) {
  Fault fault = Make(FaultCode::kNoSuchValue, 3, 0, 2);
  fault.connector = 1;
  fault.keyword = 1;
  EXPECT_EQ(OfRail(fault), "SLIDE of connector d1 has the values 0 to 1, and 3 was asked for");
  fault.limit = 0;
  EXPECT_EQ(OfRail(fault), "connector d1 has no SLIDE");
  fault = Make(FaultCode::kTooManyConnectorCommands, 0, 0, 24);
  fault.connector = 1;
  EXPECT_EQ(OfRail(fault),
            "24 connector commands are given in this tick already; connector d1 gets none");
}

TEST_F(FaultTextTest, FaultsOfRolesNameBothRivals) {
  Fault fault = Make(FaultCode::kAmbiguousRole);
  fault.role = 1;
  fault.rival_role = 0;
  EXPECT_EQ(OfHinge(fault),
            "role Foot and role Knee both fit this module and neither extends the other; it plays "
            "role Foot");
  fault = Make(FaultCode::kRoleFlicker, 0, 5, 8);
  EXPECT_EQ(OfHinge(fault),
            "the role changed more than 8 times in 5 s; the module is frozen without a role");
  fault.role = 0;
  EXPECT_EQ(OfHinge(fault),
            "the role changed more than 8 times in 5 s; the module is frozen in role Knee");
  EXPECT_EQ(OfHinge(Make(FaultCode::kStalePose, 0, 11, 10)),
            "the pose is stale: nothing newer came from the root for 11 ticks");
}

TEST_F(FaultTextTest, FaultsOfInvocationsNameTheCommandAndTheCapacity) {
  Fault fault = Make(FaultCode::kQueueOverflow, 0, 0, 8);
  fault.function = kick_;
  EXPECT_EQ(OfHinge(fault), "8 invocations wait for Knee.kick already; one more is dropped");
  fault.code = FaultCode::kBadInvocation;
  EXPECT_EQ(OfHinge(fault), "an invocation of Knee.kick is refused: its arguments do not fit");
  EXPECT_EQ(OfHinge(Make(FaultCode::kBadInvocation)),
            "an invocation is refused: the program has no such command");
  EXPECT_EQ(OfHinge(Make(FaultCode::kInvocationNotSent, 0, 0, 16)),
            "16 invocations are under way already; one more is not sent");
  fault = Make(FaultCode::kInvocationGivenUp, 0, 50, 32);
  fault.function = kick_;
  EXPECT_EQ(OfHinge(fault),
            "an invocation of Knee.kick is given up: all 32 places are full and the neighbours "
            "took none for 50 ticks");
  EXPECT_EQ(OfHinge(Make(FaultCode::kTooManyOrigins, 0, 0, 64)),
            "64 modules have invoked commands; those of one more are ignored");
}

TEST_F(FaultTextTest, FaultsOfCapacitiesSayHowMuchThereIs) {
  Fault fault = Make(FaultCode::kTooManyTasks, 0, 0, 12);
  fault.function = 0;
  EXPECT_EQ(OfHinge(fault),
            "12 tasks run already; Knee.bend does not start while the role is held");
  EXPECT_EQ(OfHinge(Make(FaultCode::kTooManyNeighbours, 0, 14, 12)),
            "14 connectors are docked; neighbours are told of 12 only");
  fault = Make(FaultCode::kTooManyBodyJoints, 0, 0, 64);
  fault.link = 1;
  EXPECT_EQ(OfHinge(fault),
            "more than 64 joints touch the body of link two; the others are not counted");
}

TEST_F(FaultTextTest, AFaultThatEndsATaskSaysWhatBecomesOfIt) {
  Fault fault = Make(FaultCode::kDivisionByZero);
  fault.function = fault.task_function = kick_;
  const auto ended = [&](TaskKind kind) {
    fault.ended_task = static_cast<int8_t>(kind);
    return OfHinge(fault);
  };
  EXPECT_EQ(ended(TaskKind::kStartup),
            "division by zero; the startup has ended, and nothing else of the role starts while it "
            "is held");
  EXPECT_EQ(ended(TaskKind::kBehavior),
            "division by zero; the behavior has ended and does not start again while the role is "
            "held");
  EXPECT_EQ(ended(TaskKind::kCommand),
            "division by zero; the command has ended; the next invocation starts it anew");
  EXPECT_EQ(ended(TaskKind::kHandler),
            "division by zero; the handler has ended; the next event starts it anew");
  // In a function that the task has called the task has a name of its own.
  fault.function = program_.role(0).startups[0];
  EXPECT_EQ(ended(TaskKind::kHandler),
            "division by zero; the handler Knee.kick has ended; the next event starts it anew");
  EXPECT_EQ(FaultTask(fault, &program_), "Knee.kick");
  EXPECT_EQ(FaultTask(fault, nullptr), "function " + std::to_string(kick_));
  // What has ended no task says nothing of any.
  EXPECT_EQ(OfHinge(Make(FaultCode::kDivisionByZero)), "division by zero");
}

TEST_F(FaultTextTest, EveryCodeHasASentenceWithImagesWithoutThemAndWithIndicesOfOthers) {
  for (int code = 0; code < kNumFaultCodes; ++code) {
    Fault fault = Make(static_cast<FaultCode>(code), 1, 2, 3);
    EXPECT_STRNE(FaultName(fault.code), "unknown fault");
    for (const int16_t index : {int16_t{-1}, int16_t{0}, int16_t{100}}) {
      fault.role = fault.rival_role = fault.function = fault.keyword = index;
      fault.joint = fault.link = fault.connector = static_cast<int8_t>(index);
      const std::string bare = FaultSentence(fault, {});
      EXPECT_FALSE(bare.empty()) << code;
      EXPECT_FALSE(OfHinge(fault).empty()) << code;
      // The bare sentence says the joint's number where the other says its name.
      if (bare.find("joint 0") != std::string::npos) {
        EXPECT_NE(OfHinge(fault).find("joint turn"), std::string::npos) << bare;
      }
    }
  }
}

TEST_F(FaultTextTest, ALineHasThePlaceTheSentenceAndTheFunction) {
  Fault fault = Make(FaultCode::kDivisionByZero);
  fault.function = kick_;
  EXPECT_EQ(FaultLine("leg.dyn", 4, "division by zero", FaultFunction(fault, &program_)),
            "leg.dyn:4: division by zero (in Knee.kick)");
  EXPECT_EQ(FaultLine("", 4, "division by zero", FaultFunction(fault, nullptr)),
            "line 4: division by zero (in function " + std::to_string(kick_) + ")");
  EXPECT_EQ(FaultLine("leg.dyn", 0, "division by zero", ""), "division by zero");
}

TEST(TaskKindName, AKindOfANewerVersionHasAName) {
  EXPECT_STREQ(TaskKindName(TaskKind::kBehavior), "behavior");
  EXPECT_STREQ(TaskKindName(static_cast<TaskKind>(100)), "task");
  EXPECT_STREQ(TaskKindName(static_cast<TaskKind>(255)), "task");
}

}  // namespace
}  // namespace morphbus::vm
