// Prints the angles of a joint from a log, by what it is to the program: joint_angles LOG ROLE
// LABEL
#include <morphbus/observe/log.h>

#include <cstdio>

int main(int argc, char** argv) try {
  if (argc != 4) {
    std::fprintf(stderr, "usage: joint_angles LOG ROLE LABEL\n");
    return 2;
  }
  const morphbus::Log log = morphbus::Log::Open(argv[1]);
  for (const morphbus::JointSeries& joint : log.JointsLabelled(argv[2], argv[3])) {
    std::printf("# %s of run %s, %zu ticks\n", joint.joint.c_str(), log.run().c_str(),
                joint.time_s.size());
    for (size_t i = 0; i < joint.time_s.size(); ++i) {
      std::printf("%.2f s  %8.5f rad\n", joint.time_s[i], joint.position[i]);
    }
  }
} catch (const morphbus::Failure& failure) {
  std::fprintf(stderr, "%s\n", failure.what());
  return 2;
}
