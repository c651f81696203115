// A simulator of one's own in the place of Bullet:
//
//   own_simulator FILE.m3l PROG.dyn ROBOT RUN SECONDS [KEY]
//
// Its joints go where they are told, at the speed that they are told, and nothing weighs anything.
// The links are where forward kinematics has them, with the robot frame a quarter of a metre above
// the ground. The other members are those of any run (docs/cli.md, The parts of a run).
#include <morphbus/bus/simulator.h>
#include <morphbus/m3l/m3l.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

namespace {

class Puppet : public morphbus::Simulator {
 public:
  explicit Puppet(const morphbus::Robot& robot) : robot_(robot), q_(robot.StartValues()) {
    velocity_.resize(q_.size());
    commands_.resize(q_.size());
    first_.resize(robot.modules().size() + 1, static_cast<int>(q_.size()));
    for (int j = static_cast<int>(q_.size()) - 1; j >= 0; --j) first_[robot.joints()[j].module] = j;
    poses_ = robot.ForwardKinematics(q_);
  }

  morphbus::ModuleReading Sense(int module) override {
    const auto of = [&](const std::vector<double>& values) {
      return std::vector<double>(values.begin() + first_[module],
                                 values.begin() + first_[module + 1]);
    };
    // Nothing weighs anything, so no motor has to exert anything.
    return {of(q_), of(velocity_), std::vector<double>(of(q_).size(), 0.0), {}};
  }

  std::optional<morphbus::Pose> LinkPose(int link) override {
    morphbus::Pose X_WL = poses_.X_RL[link];
    X_WL.position[1] += 0.25;
    return X_WL;
  }

  void Command(int module, std::span<const morphbus::JointCommand> joints) override {
    std::copy(joints.begin(), joints.end(), commands_.begin() + first_[module]);
  }

  void Step(double seconds) override {
    for (size_t j = 0; j < q_.size(); ++j) {
      const morphbus::JointCommand& command = commands_[j];
      const double before = q_[j];
      switch (command.mode) {
        case morphbus::JointCommand::Mode::kHold:
          break;
        case morphbus::JointCommand::Mode::kPosition: {
          const double most = command.speed * seconds;
          q_[j] += std::clamp(command.target - q_[j], -most, most);
          break;
        }
        case morphbus::JointCommand::Mode::kVelocity:
          q_[j] += command.speed * seconds;
          break;
      }
      velocity_[j] = (q_[j] - before) / seconds;
    }
    poses_ = robot_.ForwardKinematics(q_);
  }

 private:
  morphbus::Robot robot_;
  std::vector<double> q_, velocity_;
  std::vector<morphbus::JointCommand> commands_;
  std::vector<int> first_;  // The place of each module's first joint.
  morphbus::LinkPoses poses_;
};

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 6) {
    std::fprintf(stderr, "usage: own_simulator FILE.m3l PROG.dyn ROBOT RUN SECONDS [KEY]\n");
    return 2;
  }
  const morphbus::Model model = morphbus::CompileM3l(argv[1]);
  const morphbus::Robot robot = model.robot(argv[3]);
  const morphbus::Program program = morphbus::CompileDynaRole(argv[2], model);
  morphbus::RunAddress address;
  address.run = argv[4];
  if (argc > 6) address.key_file = argv[6];
  morphbus::SimulationOptions options;
  options.seconds = std::atof(argv[5]);
  Puppet puppet(robot);
  const morphbus::SimulationResult result =
      morphbus::Simulate(robot, program, address, &puppet, options);
  std::printf("%lld ticks, hash %s, %s\n", static_cast<long long>(result.ticks),
              result.hash.c_str(), result.reason.c_str());
} catch (const morphbus::Failure& failure) {
  std::fprintf(stderr, "%s\n", failure.what());
  return 3;
}
