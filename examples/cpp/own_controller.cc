// Drives one module of a running robot, beside the virtual machines of the others:
//
//   own_controller FILE.m3l PROG.dyn ROBOT RUN MODULE [KEY]
//
// The module's first joint swings by 30 degrees, once in two seconds; its other joints do what the
// program says. KEY is the run's key file; a run without a key (--open) needs none.
#include <morphbus/bus/module.h>
#include <morphbus/m3l/m3l.h>

#include <cmath>
#include <cstdio>

namespace {

class Swing : public morphbus::ModuleController {
 public:
  void Tick(const morphbus::ModuleTick& now, std::vector<morphbus::JointCommand>* joints) override {
    if (joints->empty()) return;
    constexpr double kAmplitude = 0.5236, kRate = 3.1416;  // rad, and rad/s of the phase
    joints->front() = {morphbus::JointCommand::Mode::kPosition,
                       kAmplitude * std::sin(kRate * now.time_s), kAmplitude * kRate};
    // What is printed now and then shows what the module knows.
    if (now.tick % 50 != 0) return;
    std::printf("%5.1f s  %s  joint at %6.3f rad\n", now.time_s,
                now.role.empty() ? "(no role)" : now.role.c_str(), now.position.front());
  }
};

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 6) {
    std::fprintf(stderr, "usage: own_controller FILE.m3l PROG.dyn ROBOT RUN MODULE [KEY]\n");
    return 2;
  }
  const morphbus::Model model = morphbus::CompileM3l(argv[1]);
  const morphbus::Program program = morphbus::CompileDynaRole(argv[2], model);
  morphbus::RunAddress address;
  address.run = argv[4];
  if (argc > 6) address.key_file = argv[6];
  Swing controller;
  const std::string why =
      morphbus::DriveModule(model.robot(argv[3]), program, argv[5], address, &controller);
  std::printf("the run is over: %s\n", why.c_str());
} catch (const morphbus::Failure& failure) {
  std::fprintf(stderr, "%s\n", failure.what());
  return 3;
}
