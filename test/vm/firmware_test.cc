// Two modules' firmware joined by lines of bytes, good ones and bad ones, against the robot of VMs
// that hands whole messages from module to module.

#include "vm/port/firmware.h"
#include "vm/image/kinematics_verifier.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "compiler/model/forward_kinematics.h"
#include "test/support/compiled.h"
#include "test/support/toy_model.h"
#include "test/support/vm_robot.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {
namespace {

constexpr int64_t kTickUs = 20000;
/// A neighbour that is silent for so many ticks is taken to be gone.
constexpr int kGoneTicks = 25;

/// The follower needs the leader's pose, its role, the root's clock and a shared field.
constexpr char kProgram[] = R"(
role Leader extends Module {
  require self.C5.CONNECTED && !self.C0.CONNECTED;
  shared angle = 0.0;
  behavior wave() {
    angle = 30 * sin(90 * self.time);
    self.jointSetDegreesNonBlocking(self.TURN, angle);
    self.sleepcs(2);
  }
}
role Follower extends Module {
  require self.C0.CONNECTED && !self.C5.CONNECTED;
  behavior follow() {
    if (self.connected($ANY, $Leader) == 1)
      self.jointSetDegreesNonBlocking(self.TURN, self.time - self.connected($ANY, $Leader).angle);
    self.sleepcs(2);
  }
}
)";

/// How often a byte on its way is damaged, lost, or has one of noise before it.
struct Noise {
  double damaged = 0, lost = 0, added = 0;
};

/// A module of the toy type Hinge. Its connector `docked` is joined to that of another by a line.
class Bench final : public Hardware {
 public:
  Bench(int docked, const ConnectorReading& sensed, Noise noise)
      : docked_(docked), sensed_(sensed), noise_(noise) {}

  int Receive(int connector, uint8_t* bytes, int capacity) override {
    if (endless) return std::fill_n(bytes, capacity, uint8_t{0xa5}), capacity;
    if (connector != docked_) return 0;
    int count = 0;
    for (; count < capacity && !line.empty(); ++count, line.pop_front())
      bytes[count] = line.front();
    return count;
  }
  void Send(int connector, const uint8_t* bytes, int size) override {
    if (connector != docked_ || mate == nullptr) return;
    std::uniform_real_distribution<double> chance(0, 1);
    for (int i = 0; i < size; ++i) {
      uint8_t byte = bytes[i];
      if (chance(random_) < noise_.added) mate->line.push_back(static_cast<uint8_t>(random_()));
      if (chance(random_) < noise_.lost) continue;
      if (chance(random_) < noise_.damaged) byte ^= static_cast<uint8_t>(1u << (random_() % 8));
      mate->line.push_back(byte);
    }
  }
  /// Who is there, the mate says; how it is docked there, this bench knows.
  ConnectorReading ReadConnector(int connector, const LinkedNeighbour& there) override {
    if (connector != docked_ || !there.heard || there.silent_ticks > kGoneTicks) return {};
    ConnectorReading reading = sensed_;
    reading.mate_module = there.module;
    reading.mate_connector = there.connector;
    EXPECT_EQ(reading, sensed_);
    return reading;
  }
  void ReadJoint(int joint, double* position, double* velocity) override {
    EXPECT_EQ(joint, 0);
    *position = q;
    *velocity = 0;
  }
  void DriveJoint(int /*joint*/, const JointCommand& command) override {
    driven = command;
    const double step = command.speed * kTickUs * 1e-6;
    if (command.mode == ActuatorMode::kPosition) q += std::clamp(command.target - q, -step, step);
  }

  Bench* mate = nullptr;
  std::deque<uint8_t> line;  ///< What has come and is not yet taken.
  bool endless = false;      ///< There is always more noise.
  double q = 0;
  JointCommand driven;

 private:
  const int docked_;
  const ConnectorReading sensed_;
  const Noise noise_;
  std::mt19937_64 random_{7};
};

class FirmwareTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string error;
    kinematics_bytes_ = EncodeKinematics(test::TablesOf(model_, 0), &error);
    ASSERT_EQ(VerifyKinematics(kinematics_bytes_.data(),
                               static_cast<uint32_t>(kinematics_bytes_.size()), &kinematics_)
                  .message,
              nullptr);
    ASSERT_EQ(
        Verifier::Verify(image_.data(), static_cast<uint32_t>(image_.size()), &program_).message,
        nullptr);
    host_.Tick();
  }

  /// Module m of the chain of two, c5 to c0; where it is docked is what the host's sensor said.
  void Start(int m, Noise noise = {}, uint16_t grace_ticks = 0) {
    const int docked = m == 0 ? 5 : 0;
    const ConnectorReading& sensed = host_.state(m).neighbours[docked].sensor;
    ASSERT_TRUE(sensed.docked);
    bench_[m] = std::make_unique<Bench>(docked, sensed, noise);
    bench_[m]->q = model::StartValues(robot_)[static_cast<size_t>(m)][0];
    VmConfig config;
    config.module_id = static_cast<uint16_t>(m + 1);
    config.grace_ticks = grace_ticks;
    config.is_root = m == robot_.root_module;
    if (config.is_root) {
      config.root_link = static_cast<uint8_t>(robot_.root_link);
      const auto rest = model::ForwardKinematics(model_, robot_, model::StartValues(robot_));
      config.X_RL_root =
          test::ToFloat(rest.X_RL[static_cast<size_t>(m)][static_cast<size_t>(robot_.root_link)]);
    }
    firmware_[m] =
        std::make_unique<Firmware>(config, kinematics_, program_, &state_[m], bench_[m].get());
    time_us_[m] = 0;
    Join();
  }
  void Join() {
    for (const int m : {0, 1}) {
      if (bench_[m] != nullptr) bench_[m]->mate = bench_[1 - m].get();
    }
  }
  void Greet() {
    for (const auto& firmware : firmware_) firmware->Greet();
  }
  /// Both hear what was said before, then compute.
  void Tick(int count = 1) {
    for (int i = 0; i < count; ++i) {
      for (const auto& firmware : firmware_) {
        if (firmware != nullptr) firmware->Listen();
      }
      for (const int m : {0, 1}) {
        if (firmware_[m] == nullptr) continue;
        firmware_[m]->Tick(time_us_[m]);
        time_us_[m] += kTickUs;
      }
    }
  }
  [[nodiscard]] std::string RoleOf(int m) const {
    const int role = firmware_[m]->output().status.role;
    if (role < 0) return "";
    return {program_.role(role).name.data, program_.role(role).name.size};
  }

  const model::Model model_ = test::ToyModel();
  const model::Robot robot_ = test::ChainRobot(model_, 2);
  const std::vector<uint8_t> image_ = test::ProgramFrom(kProgram, model_);
  std::vector<uint8_t> kinematics_bytes_;
  VerifiedKinematics kinematics_;
  VerifiedProgram program_;
  test::VmRobot host_{model_, robot_, image_};
  std::unique_ptr<Bench> bench_[2];
  VmState state_[2];
  std::unique_ptr<Firmware> firmware_[2];
  int64_t time_us_[2] = {};
};

TEST_F(FirmwareTest, DoesInEveryTickWhatTheHostDoes) {
  Start(0);
  Start(1);
  Greet();
  // The host is at its tick 0.
  for (int i = 0; i < 200; ++i) {
    Tick();
    for (const int m : {0, 1}) {
      ASSERT_EQ(firmware_[m]->tick(), host_.tick());
      ASSERT_EQ(RoleOf(m), host_.RoleOf(m)) << i;
      const JointCommand& expected = host_.output(m).joints[0];
      ASSERT_EQ(bench_[m]->driven.mode, expected.mode) << i;
      ASSERT_EQ(bench_[m]->driven.target, expected.target) << i;
      ASSERT_EQ(bench_[m]->driven.speed, expected.speed) << i;
    }
    host_.Tick();
  }
  EXPECT_EQ(RoleOf(0), "Leader");
  EXPECT_EQ(RoleOf(1), "Follower");
  EXPECT_NE(bench_[1]->driven.target, 0);
}

TEST_F(FirmwareTest, TakesTheSameRolesOverABadLine) {
  const Noise noise{.damaged = 0.0005, .lost = 0.0005, .added = 0.0005};
  Start(0, noise, 3);
  Start(1, noise, 3);
  host_.Tick(100);
  Tick(100);
  double lowest = 0, highest = 0;
  for (int i = 0; i < 400; ++i) {
    Tick();
    for (const int m : {0, 1}) {
      ASSERT_EQ(RoleOf(m), host_.RoleOf(m)) << i;
      ASSERT_EQ(firmware_[m]->output().status.num_faults, 0) << i;
    }
    lowest = std::min(lowest, bench_[1]->driven.target);
    highest = std::max(highest, bench_[1]->driven.target);
  }
  // The shared field still comes, an angle of up to 30 degrees (and the time, as 8 degrees).
  EXPECT_LT(lowest, -0.3);
  EXPECT_GT(highest, 0.3);
}

TEST_F(FirmwareTest, OneThatBeginsLaterLeapsToTheTicksOfItsMate) {
  Start(0);
  Tick(1000);
  EXPECT_EQ(RoleOf(0), "");
  Start(1);
  Tick(100);
  EXPECT_EQ(RoleOf(0), "Leader");
  EXPECT_EQ(RoleOf(1), "Follower");
  // What was said in a tick is heard in the next.
  EXPECT_EQ(firmware_[0]->tick(), 1099);
  EXPECT_EQ(firmware_[1]->tick(), 1098);
  EXPECT_EQ(firmware_[1]->lag(), 0);
}

TEST_F(FirmwareTest, ATickThatNobodyCanReachIsNotBelieved) {
  Start(0);
  Start(1);
  Tick(10);
  NeighbourMessage message;
  message.sender = 1;
  message.incarnation = 1;
  message.tick = int64_t{1} << 40;
  std::vector<uint8_t> frame(kMaxFrameBytes);
  uint8_t* body = frame.data() + kFrameHeadBytes;
  body[0] = 1;
  body[2] = 5;
  const int packet_size = WritePacket(message, body + 3);
  frame.resize(static_cast<size_t>(WriteFrame(frame.data(), 3 + packet_size)));
  bench_[1]->line.insert(bench_[1]->line.end(), frame.begin(), frame.end());
  Tick(10);
  EXPECT_EQ(firmware_[1]->tick(), 19);
}

TEST_F(FirmwareTest, TheLagKeepsClocksTogetherThatDriftApart) {
  Start(0, {}, 3);
  Start(1, {}, 3);
  // The next tick of each, by a clock on the wall. Module 1 counts too slowly by half a percent.
  int64_t next_us[2] = {0, 5000};
  while (firmware_[0]->tick() < 3000) {
    const int m = next_us[0] < next_us[1] ? 0 : 1;
    firmware_[m]->Listen();
    firmware_[m]->Tick(next_us[m]);
    next_us[m] += m == 0 ? kTickUs : kTickUs * 1005 / 1000;
    if (firmware_[m]->lag() > 0) next_us[m] -= kTickUs / 100;
    ASSERT_LE(std::abs(firmware_[0]->tick() - firmware_[1]->tick()), 2);
  }
  EXPECT_EQ(RoleOf(0), "Leader");
  EXPECT_EQ(RoleOf(1), "Follower");
}

TEST_F(FirmwareTest, AMateThatFallsSilentIsGone) {
  Start(0);
  Start(1);
  Tick(100);
  ASSERT_EQ(RoleOf(1), "Follower");
  bench_[0]->mate = nullptr;
  Tick(kGoneTicks + 40);
  EXPECT_EQ(firmware_[1]->neighbour(0).silent_ticks, kGoneTicks + 40);
  EXPECT_EQ(RoleOf(1), "");
  // The other way is as good as before, so the leader still hears its mate.
  EXPECT_EQ(RoleOf(0), "Leader");
  Join();
  Tick(100);
  EXPECT_EQ(RoleOf(1), "Follower");
}

TEST_F(FirmwareTest, ALinkThatNeverFallsSilentHoldsNothingUp) {
  Bench hardware(0, {}, {});
  hardware.endless = true;
  Firmware firmware({}, kinematics_, program_, &state_[0], &hardware);
  firmware.Listen();
  firmware.Tick(0);
  EXPECT_FALSE(firmware.neighbour(0).heard);
}

}  // namespace
}  // namespace morphbus::vm
