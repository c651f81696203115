// Reads a log through the public library and sums the angles and efforts of all joints, the peer of
// what log_python.py does through NumPy: log_series LOG
#include <morphbus/observe/log.h>

#include <cstdio>

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::fprintf(stderr, "usage: log_series LOG\n");
    return 2;
  }
  const morphbus::Log log = morphbus::Log::Open(argv[1]);
  double position = 0, effort = 0;
  for (const morphbus::Joint& joint : log.robot().joints()) {
    const morphbus::JointSeries series = log.JointNamed(joint.name);
    for (const double value : series.position) position += value;
    for (const double value : series.effort) effort += value;
  }
  std::printf("%.6f %.6f\n", position, effort);
} catch (const morphbus::Failure& failure) {
  std::fprintf(stderr, "%s\n", failure.what());
  return 2;
}
