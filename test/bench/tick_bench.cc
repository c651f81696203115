// What one VM's control tick costs, and one verification of an image.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "compiler/m3l/compile.h"
#include "test/support/compiled.h"
#include "test/support/large_robots.h"
#include "test/support/vm_robot.h"
#include "vm/image/verifier.h"

namespace morphbus {
namespace {

/// Every module rocks a joint twice a second: tasks that sleep, wake and move in each tick.
constexpr const char* kRockers = R"(
role Rocker extends Module {
  require sizeof(self.connected) >= 1;
  behavior rock() {
    self.JOINT_1.SET_POSITION(15);
    self.sleepds(5);
    self.JOINT_1.SET_POSITION(-15);
    self.sleepds(5);
  }
})";

/// Runs the robot tick by tick once all roles are settled; the time reported is that of one
/// module's VM in one tick. Each has its neighbours' messages, and in between those of all others
/// have been computed, as on a bus.
void RunTicks(benchmark::State& state, const model::Model& model, const model::Robot& robot,
              const std::vector<uint8_t>& program) {
  // The root's pose needs as many ticks as its way is long.
  const auto has_role = [](test::VmRobot& vms, int m) { return !vms.RoleOf(m).empty(); };
  constexpr int kMostTicks = 3000;
  test::VmRobot vms(model, robot, program);
  vms.Tick();
  for (int m = 0; m < vms.size(); ++m) {
    while (!has_role(vms, m) && vms.tick() < kMostTicks) vms.Tick();
    if (!has_role(vms, m)) return state.SkipWithError("a module has no role");
  }
  for (auto _ : state) {
    const auto before = vms.vm_time();
    vms.Tick();
    state.SetIterationTime(std::chrono::duration<double>(vms.vm_time() - before).count() /
                           vms.size());
  }
}

/// The quadruped walking.
void Quadruped(benchmark::State& state) {
  const model::Model model = test::ModelFrom("models/mtran.m3l");
  RunTicks(state, model, *model.FindRobot("quadruped"),
           test::ProgramFrom(test::TextOf("models/programs/quadruped.dyn"), model));
}

/// A thousand modules that rock.
void Thousand(benchmark::State& state, test::LargeShape shape) {
  const model::Model model =
      *m3l::CompileText("large.m3l", test::LargeRobotText(shape, 1000)).model;
  RunTicks(state, model, *model.FindRobot("large"), test::ProgramFrom(kRockers, model));
}

/// A program of as many roles, each with functions that are alike, with loops and branches.
std::string ManyRoles(int roles) {
  constexpr int kFunctions = 10;
  std::string text;
  for (int r = 0; r < roles; ++r) {
    text += fmt::format("role Busy{} extends Module {{\n", r);
    std::string calls;
    for (int i = 0; i < kFunctions; ++i) {
      text += fmt::format(
          "  function f{}(int n) {{\n"
          "    var sum = 0;\n"
          "    for (var i = 0; i < n; i += 1) {{\n"
          "      if (i % 3 == 0) {{ sum += i; }} else {{ sum = sum - 1; }}\n"
          "      while (sum > 1000) {{ sum = sum / 2; }}\n"
          "    }}\n"
          "    return sum;\n"
          "  }}\n",
          i);
      calls += fmt::format(" f{}(9);", i);
    }
    text += "  startup go() {" + calls + " }\n}\n";
  }
  return text;
}

/// Time over the image's size in bytes.
void Verify(benchmark::State& state) {
  const model::Model model = test::ModelFrom("models/mtran.m3l");
  const std::vector<uint8_t> image =
      test::ProgramFrom(ManyRoles(static_cast<int>(state.range(0))), model);
  const auto program = std::make_unique<vm::VerifiedProgram>();
  for (auto _ : state) {
    const vm::VerifyError error =
        vm::Verifier::Verify(image.data(), static_cast<uint32_t>(image.size()), program.get());
    if (error.message != nullptr) return state.SkipWithError(error.message);
  }
  state.SetComplexityN(static_cast<int64_t>(image.size()));
  state.counters["bytes"] = static_cast<double>(image.size());
}

BENCHMARK(Quadruped)->UseManualTime()->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(Thousand, chain, test::LargeShape::kChain)
    ->UseManualTime()
    ->Iterations(200)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(Thousand, lattice, test::LargeShape::kLattice)
    ->UseManualTime()
    ->Iterations(100)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(Verify)->Arg(4)->Arg(12)->Arg(40)->Complexity()->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace morphbus

BENCHMARK_MAIN();
