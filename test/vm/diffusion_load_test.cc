// Many invocations at once over bad links: each is executed exactly once on each module that it
// addresses, and in the order in which its origin issued it.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <vector>

#include "test/support/compiled.h"
#include "test/support/toy_model.h"
#include "test/support/vm_robot.h"

namespace morphbus::vm {
namespace {

using test::VmRobot;
using test::VmRobotOptions;

/// Who executes a command prints its number. Modules at the ends of the robot play another role
/// than those within.
constexpr char kMarking[] = R"(
abstract role Any extends Module {
  command mark(int n) { print("executes", n); }
}
role End extends Any { require (sizeof(self.connected) == 1); }
role Inner extends Any { require (sizeof(self.connected) > 1); }
)";

constexpr int kModules = 30;
constexpr int kInvocations = 1000;

TEST(DiffusionLoadTest, AThousandInvocationsAreExecutedOnceEachOnThirtyModulesOverBadLinks) {
  VmRobotOptions options;
  // A message is lost, or an older one comes in its place: late, again, and out of order.
  options.loss = 0.3;
  options.late = 0.3;
  options.grace_ticks = 30;
  const model::Model model = test::ToyModel();
  const model::Robot robot = test::RandomRobot(model, kModules, 8, 3);
  VmRobot vms(model, robot, test::ProgramFrom(kMarking, model), options);
  vms.Tick(300);
  std::map<std::string, int> players;
  for (int m = 0; m < kModules; ++m) ++players[vms.RoleOf(m)];
  ASSERT_EQ(players[""], 0);
  ASSERT_GT(players["End"], 2);
  ASSERT_GT(players["Inner"], 2);

  // What each module executed, in its order, as the prints of its ticks tell.
  std::vector<std::vector<int>> executed(kModules), expected(kModules);
  const auto tick = [&] {
    vms.Tick();
    for (int m = 0; m < kModules; ++m) {
      const StatusReport& status = vms.output(m).status;
      EXPECT_EQ(status.prints_dropped, 0);
      for (int i = 0; i < status.num_prints; ++i) {
        executed[static_cast<size_t>(m)].push_back(status.prints[i].values[0].AsInt());
      }
    }
  };
  // By any module, addressed to all, to the ends or to those within.
  std::mt19937_64 random(5);
  std::vector<int> origins;
  for (int n = 0; n < kInvocations; ++n) {
    const char* roles[] = {"Any", "End", "Inner"};
    const char* addressed = roles[random() % 3];
    const int origin = static_cast<int>(random() % kModules);
    InvokeRequest request;
    request.program_hash = vms.program().hash();
    request.role = static_cast<uint16_t>(vms.RoleNamed(addressed));
    request.num_arguments = 1;
    request.arguments[0] = Cell::Int(n);
    vms.Request(origin, request);
    origins.push_back(origin);
    for (int m = 0; m < kModules; ++m) {
      if (addressed != roles[0] && vms.RoleOf(m) != addressed) continue;
      expected[static_cast<size_t>(m)].push_back(n);
    }
    for (int wait = static_cast<int>(random() % 8); wait >= 0; --wait) tick();
  }
  for (int i = 0; i < 400; ++i) tick();

  for (int m = 0; m < kModules; ++m) {
    std::vector<int>& order = executed[static_cast<size_t>(m)];
    // Of one origin in the order of issue; of several in any.
    std::map<int, int> last;
    for (const int n : order) {
      const int origin = origins[static_cast<size_t>(n)];
      EXPECT_TRUE(!last.contains(origin) || last[origin] < n) << "module " << m;
      last[origin] = n;
    }
    std::sort(order.begin(), order.end());
    EXPECT_EQ(order, expected[static_cast<size_t>(m)]) << "module " << m;
    EXPECT_EQ(vms.state(m).diffusion.num_kept, 0) << "module " << m;
  }
  EXPECT_TRUE(vms.faults().empty());
}

}  // namespace
}  // namespace morphbus::vm
