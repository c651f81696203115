// Loads a model and prints where the links of a robot are: print_poses FILE.m3l ROBOT [JOINT=VALUE
// ...]
#include <morphbus/m3l/m3l.h>

#include <cstdio>
#include <cstdlib>
#include <string>

int main(int argc, char** argv) try {
  if (argc < 3) {
    std::fprintf(stderr, "usage: print_poses FILE.m3l ROBOT [m1.joint_1=0.3 ...]\n");
    return 2;
  }
  const morphbus::Model model = morphbus::CompileM3l(argv[1]);
  const morphbus::Robot robot = model.robot(argv[2]);

  // Joints that are not named stay as the robot starts.
  std::vector<double> joint_values = robot.StartValues();
  for (int i = 3; i < argc; ++i) {
    const std::string setting = argv[i];
    const size_t equals = setting.find('=');
    if (equals == std::string::npos) throw morphbus::Failure(setting + ": expected JOINT=VALUE");
    joint_values[robot.FindJoint(setting.substr(0, equals))] = std::atof(argv[i] + equals + 1);
  }

  const morphbus::LinkPoses poses = robot.ForwardKinematics(joint_values);
  for (size_t i = 0; i < poses.X_RL.size(); ++i) {
    const auto& [p, q] = poses.X_RL[i];
    std::printf("%-24s %9.5f %9.5f %9.5f m   %7.4f %7.4f %7.4f %7.4f\n",
                robot.links()[i].name.c_str(), p[0], p[1], p[2], q[0], q[1], q[2], q[3]);
  }
} catch (const morphbus::Failure& failure) {
  // Errors in a model come with their lines, as the command line prints them.
  std::fprintf(stderr, "%s\n", failure.what());
  return 2;
}
