// Runs, comparisons, pictures and virtual machines of the libraries for other people's programs.

#include <gtest/gtest.h>
#include <morphbus/compare/compare.h>
#include <morphbus/m3l/m3l.h>
#include <morphbus/run/batch.h>
#include <morphbus/view/view.h>
#include <morphbus/vm/virtual_machine.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "test/logger/recorded_walk.h"
#include "test/logger/temp_log.h"
#include "test/support/source_dir.h"

namespace morphbus {
namespace {

/// What `call` throws, as text; empty if it throws nothing.
template <class Call>
std::string WhyThrown(const Call& call) {
  try {
    call();
  } catch (const Failure& failure) {
    return failure.what();
  }
  return "";
}

class RunLibrary : public ::testing::Test {
 protected:
  const Model model = CompileM3l(test::SourcePath("models/mtran.m3l"));
  const Robot robot = model.robot("quadruped");
  const Program program = CompileDynaRole(test::SourcePath("models/programs/quadruped.dyn"), model);

  /// A run of two seconds, in steps of so many ticks; its hash.
  std::string HashInSteps(int64_t ticks, const RunOptions& more = {}) const {
    RunOptions options = more;
    options.seconds = 2;
    morphbus::Run run(robot, program, options);
    while (!run.over()) run.Step(ticks);
    const RunResult& result = run.Close();
    EXPECT_EQ(result.error, "");
    EXPECT_EQ(result.ticks, 100);
    EXPECT_EQ(result.reason, "finished");
    return result.hash;
  }
};

TEST_F(RunLibrary, TheStepsOfARunDoNotChangeIt) {
  const std::string whole = HashInSteps(1000);
  EXPECT_EQ(whole.size(), 32U);
  EXPECT_EQ(HashInSteps(1), whole);
  EXPECT_EQ(HashInSteps(7), whole);
  // So does a run in another thread, beside this one.
  std::string beside;
  std::thread other([&] { beside = HashInSteps(3); });
  EXPECT_EQ(HashInSteps(50), whole);
  other.join();
  EXPECT_EQ(beside, whole);
  RunOptions noisy;
  noisy.loss = 0.2;
  EXPECT_EQ(HashInSteps(10, noisy), whole) << "what is lost is sent again";
}

TEST_F(RunLibrary, ABatchHasTheSameRunsForAnyNumberOfThreads) {
  // Three robots, of which two are alike, and two programs.
  const Program careful =
      CompileDynaRole(test::SourcePath("models/programs/quadruped_careful.dyn"), model);
  const auto hashes = [&](int threads) {
    std::vector<morphbus::Run> runs;
    runs.emplace_back(robot, program, RunOptions{.seconds = 1});
    runs.emplace_back(model.robot("equivalent_quadruped"), program, RunOptions{.seconds = 2});
    runs.emplace_back(robot, careful, RunOptions{.seconds = 1.5});
    runs.emplace_back(robot, program, RunOptions{.seconds = 1});
    std::vector<morphbus::Run*> all;
    for (morphbus::Run& run : runs) all.push_back(&run);
    Batch batch(std::move(all), threads);
    while (!batch.over()) batch.Step(10);
    std::vector<std::string> found;
    for (const RunResult& result : batch.Close()) found.push_back(result.hash);
    return found;
  };
  const std::vector<std::string> alone = hashes(1);
  EXPECT_EQ(alone[0], alone[3]);
  EXPECT_NE(alone[0], alone[2]);
  EXPECT_EQ(hashes(3), alone);
  EXPECT_EQ(hashes(0), alone);
  morphbus::Run one(robot, program);
  Batch batch({&one});
  EXPECT_EQ(WhyThrown([&] { batch.Step(-1); }), "a run does not go back");
}

TEST_F(RunLibrary, HasTheHashOfTheCommandLine) {
  // The recorded walk was planned and run by the parts of `morphbus run`.
  RunOptions options;
  options.seconds = static_cast<double>(logger::kWalkTicks) * 0.02;
  options.name = logger::walk->log->facts.run;
  morphbus::Run run(robot, program, options);
  run.Step(logger::kWalkTicks);
  EXPECT_EQ(run.Close().hash, logger::walk->log->facts.run_hash);
}

TEST_F(RunLibrary, GoesOnInAnotherThreadThanItBeganIn) {
  std::unique_ptr<morphbus::Run> run;
  std::thread([&] { run = std::make_unique<morphbus::Run>(robot, program); }).join();
  run->Step(50);
  morphbus::Run whole(robot, program);
  whole.Step(50);
  EXPECT_EQ(run->Close().hash, whole.Close().hash);
}

TEST_F(RunLibrary, TheLastObservationIsOfOneMoment) {
  morphbus::Run short_run(robot, program, {.seconds = 1});
  short_run.Step(INT64_MAX);
  ASSERT_TRUE(short_run.over());
  morphbus::Run longer(robot, program);
  longer.Step(short_run.Observe().tick);
  EXPECT_EQ(short_run.Observe().position, longer.Observe().position);
  EXPECT_EQ(short_run.Observe().X_WL, longer.Observe().X_WL);
}

TEST_F(RunLibrary, ShowsWhatTheRobotDoes) {
  morphbus::Run run(robot, program);
  const Observation start = run.Observe();
  EXPECT_EQ(start.tick, 0);
  ASSERT_EQ(start.position.size(), robot.joints().size());
  ASSERT_EQ(start.X_WL.size(), robot.links().size());
  EXPECT_EQ(start.roles[0], "");
  run.Step(100);
  const Observation later = run.Observe();
  EXPECT_EQ(later.tick, 100);
  EXPECT_DOUBLE_EQ(later.time_s, 2.0);
  EXPECT_NE(later.roles[0], "");
  EXPECT_NE(later.position, start.position);
  const RunResult result = run.Close();
  EXPECT_EQ(result.reason, "closed");
  EXPECT_EQ(run.Close().hash, result.hash);
  EXPECT_EQ(nlohmann::json::parse(run.SummaryJson())["ticks"], result.ticks);
  EXPECT_EQ(WhyThrown([&] { run.Step(); }), "the run is closed");
}

TEST_F(RunLibrary, DrivesJointsUntilTheyAreReleased) {
  morphbus::Run run(robot, program, {.still = true});
  const int joint = robot.FindJoint("m1.joint_1");
  run.Drive(joint, 0.4, 1.0);
  run.Step(60);
  EXPECT_NEAR(run.Observe().position[joint], 0.4, 1e-6);
  run.Release(joint);
  run.Step(200);
  EXPECT_GT(std::abs(run.Observe().position[joint] - 0.4), 1e-3);
  EXPECT_NE(WhyThrown([&] { run.Drive(joint, 4); }), "");
  EXPECT_NE(WhyThrown([&] { run.Drive(99, 0); }), "");
  EXPECT_NE(WhyThrown([&] { run.Drive(joint, NAN); }), "");
  EXPECT_NE(WhyThrown([&] { run.Drive(joint, 0.1, INFINITY); }), "");
  run.Close();
  EXPECT_NE(WhyThrown([&] { run.Drive(joint, 0.1); }), "");
}

TEST_F(RunLibrary, TakesCommandsAndSaysWhyItRefusesOthers) {
  const logger::TempFile file;
  morphbus::Run run(robot, program, {.log = file.path()});
  run.Step(10);
  run.Command("lose m1");
  run.Step(10);
  EXPECT_NE(WhyThrown([&] { run.Command("dance"); }), "");
  for (const char* refused : {"pause", "kill m2", "restart m2", "deploy x.dyn"}) {
    EXPECT_NE(WhyThrown([&] { run.Command(refused); }), "") << refused;
  }
  const std::string refused = WhyThrown([&] {
    run.Command("push m11 up 5");
    run.Step(2);
  });
  EXPECT_NE(refused.find("m11"), std::string::npos) << refused;
  const RunResult& result = run.Close();
  EXPECT_EQ(result.error, "");
  EXPECT_NE(Log::Open(file.path()).InfoJson().find("lose m1"), std::string::npos);
}

TEST_F(RunLibrary, SetsParametersBeforeAndWhileItRuns) {
  const Program tuned =
      CompileDynaRole(test::SourcePath("models/programs/quadruped_tuned.dyn"), model);
  const Parameter parameter = tuned.Parameters().front();
  const auto value = static_cast<int>((parameter.least + parameter.most) / 2);
  RunOptions options;
  options.settings = {{parameter.name, std::to_string(value)}};
  morphbus::Run run(robot, tuned, options);
  run.Step(5);
  run.Set(parameter.name, parameter.least);
  run.Step(5);
  EXPECT_NE(WhyThrown([&] {
              run.Set(parameter.name, parameter.most + 1);
              run.Step(2);
            }),
            "");
  options.settings = {{"no_such", "1"}};
  EXPECT_NE(WhyThrown([&] { morphbus::Run wrong(robot, tuned, options); }).find("no_such"),
            std::string::npos);
}

TEST_F(RunLibrary, RunsVariantsAndWritesLogs) {
  const Robot variant = robot.Variants(1).front();
  const logger::TempFile file;
  morphbus::Run run(variant, program, {.seconds = 1, .log = file.path()});
  run.Step(1000);
  EXPECT_TRUE(run.over());
  EXPECT_EQ(run.Close().error, "");
  const Log log = Log::Open(file.path());
  EXPECT_EQ(log.hash(), run.Close().hash);
  EXPECT_EQ(log.robot().name(), variant.name());
}

TEST_F(RunLibrary, RefusesOptionsThatMakeNoSense) {
  EXPECT_NE(
      WhyThrown([&] { morphbus::Run run(robot, program, {.seconds = -1}); }).find("--seconds"),
      std::string::npos);
  EXPECT_NE(WhyThrown([&] { morphbus::Run run(robot, program, {.log = "/dev/null/x.log"}); }), "");
  EXPECT_NE(WhyThrown([&] { morphbus::Run run(robot, program, {.world = "/nowhere.sdf"}); }), "");
}

TEST(CompareLibrary, FindsARunLikeItselfAndUnlikeAnother) {
  const Log a = Log::Open(logger::walk->path);
  const Comparison same = CompareLogs(a, a);
  EXPECT_EQ(same.verdict, Verdict::kEquivalent) << same.text;
  EXPECT_EQ(same.first, -1);
  const std::string other = logger::Record("equivalent_quadruped", 0);
  const Log b = Log::Open(other);
  const Comparison congruent = CompareLogs(a, b);
  EXPECT_EQ(congruent.verdict, Verdict::kEquivalent) << congruent.text;
  EXPECT_FALSE(congruent.items.empty());
  EXPECT_EQ(nlohmann::json::parse(congruent.json)["verdict"], "equivalent");
  // A joint that goes another way is found.
  const logger::TempFile file;
  const Robot robot = a.robot();
  const Program program =
      CompileDynaRole(test::SourcePath("models/programs/quadruped.dyn"), robot.model());
  morphbus::Run run(robot, program, {.seconds = 3, .log = file.path()});
  run.Step(100);
  run.Drive(robot.FindJoint("m1.joint_1"), 0.3);
  run.Step(50);
  run.Close();
  const Comparison other_way = CompareLogs(a, Log::Open(file.path()));
  EXPECT_EQ(other_way.verdict, Verdict::kDifferent) << other_way.reason;
  ASSERT_GE(other_way.first, 0);
  EXPECT_TRUE(other_way.items[other_way.first].Differs());
  EXPECT_EQ(other_way.items[other_way.first].module_a, "m1");
  EXPECT_NE(WhyThrown([&] {
              (void)CompareLogs(a, b, {.tolerances = {{"angel_rad", "0"}}});
            }).find("did you mean 'angle_rad'"),
            std::string::npos);
  EXPECT_NE(ReportHtml(a, b).find("<html"), std::string::npos);
  std::remove(other.c_str());
}

TEST(BatchLibrary, RefusesNoRunAndOneRunTwice) {
  EXPECT_NE(WhyThrown([] { Batch batch({nullptr}); }), "");
  const Model model = CompileM3l(test::SourcePath("models/mtran.m3l"));
  morphbus::Run run(model.robot("quadruped"),
                    CompileDynaRole(test::SourcePath("models/programs/quadruped.dyn"), model));
  EXPECT_NE(WhyThrown([&] { Batch batch({&run, &run}); }), "");
  EXPECT_NE(WhyThrown([&] { Batch batch({&run}, -1); }), "");
}

TEST(ViewLibrary, DrawsModelsAndLogs) {
  const Robot robot = CompileM3l(test::SourcePath("models/mtran.m3l")).robot("quadruped");
  const std::string svg = DrawRobot(robot, {}, {View::kSide, View::kTop});
  EXPECT_NE(svg.find("<svg"), std::string::npos);
  std::vector<double> bent = robot.StartValues();
  bent[robot.FindJoint("m1.joint_1")] += 0.5;
  EXPECT_NE(DrawRobot(robot, bent, {View::kSide, View::kTop}), svg);
  EXPECT_EQ(DrawRobot(robot, {}, {View::kSide}, PictureFormat::kPng).substr(1, 3), "PNG");
  EXPECT_NE(WhyThrown([&] { (void)DrawRobot(robot, {}, {}); }), "");
  bent.front() = INFINITY;
  EXPECT_NE(WhyThrown([&] { (void)DrawRobot(robot, bent, {View::kSide}); }), "");
  const Log log = Log::Open(logger::walk->path);
  EXPECT_NE(DrawMoment(log, 1, {View::kSide}).find("<svg"), std::string::npos);
  EXPECT_NE(DrawStrip(log, 3, {}, {View::kSide}).find("<svg"), std::string::npos);
  EXPECT_EQ(DrawVideo(log, 5, {0, 0.4}, {View::kSide}).substr(0, 4), "RIFF");
  EXPECT_NE(ReportHtml(log).find("<html"), std::string::npos);
  EXPECT_NE(WhyThrown([&] { (void)DrawMoment(log, 99, {View::kSide}); }).find("the log ends at"),
            std::string::npos);
  EXPECT_NE(WhyThrown([&] { (void)DrawMoment(log, NAN, {View::kSide}); }), "");
  EXPECT_NE(WhyThrown([&] { (void)DrawStrip(log, 0, {}, {View::kSide}); }), "");
  EXPECT_NE(WhyThrown([&] { (void)DrawVideo(log, 5, {3, 1}, {View::kSide}); }), "");
}

/// All modules of a robot, whose messages are carried from one tick to the next.
class Machines {
 public:
  Machines(const Robot& robot, const Program& program) {
    for (int m = 0; m < static_cast<int>(robot.modules().size()); ++m) {
      machines_.emplace_back(robot, program, m);
      inputs_.push_back(machines_.back().InputAtRest());
    }
  }

  void Tick() {
    std::vector<VmOutput> now;
    for (size_t m = 0; m < machines_.size(); ++m) {
      inputs_[m].tick = tick_;
      inputs_[m].time_s = 0.02 * static_cast<double>(tick_);
      for (ConnectorInput& connector : inputs_[m].connectors) {
        if (connector.docked && !said.empty()) {
          connector.message = said[connector.mate_module].message;
        }
      }
      now.push_back(machines_[m].Tick(inputs_[m]));
    }
    said = std::move(now);
    ++tick_;
  }

  std::vector<VirtualMachine>& machines() { return machines_; }
  std::vector<VmInput>& inputs() { return inputs_; }
  std::vector<VmOutput> said;

 private:
  std::vector<VirtualMachine> machines_;
  std::vector<VmInput> inputs_;
  int64_t tick_ = 0;
};

TEST(VmLibrary, ModulesFindTheirRolesByWhatTheyHear) {
  const Model model = CompileM3l(test::SourcePath("models/mtran.m3l"));
  const Robot robot = model.robot("quadruped");
  const Program program = CompileDynaRole(test::SourcePath("models/programs/quadruped.dyn"), model);
  Machines machines(robot, program);
  for (int i = 0; i < 60; ++i) machines.Tick();
  // Each of the legs' halves has one role, and knows where it is.
  std::set<std::string> roles;
  const LinkPoses poses = robot.ForwardKinematics(robot.StartValues());
  for (size_t m = 0; m < machines.said.size(); ++m) {
    const VmOutput& said = machines.said[m];
    roles.insert(said.role);
    ASSERT_TRUE(said.has_pose);
    ASSERT_EQ(said.X_RL.size(), 3U);
    for (int l = 0; l < 3; ++l) {
      for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(said.X_RL[l].position[i], poses.X_RL[3 * m + l].position[i], 1e-5);
      }
    }
  }
  EXPECT_EQ(roles.count(""), 0U);
  EXPECT_EQ(roles.count("FrontLeftUpperHalf"), 1U);
  // A state that was saved goes on alike.
  VirtualMachine again(robot, program, 0);
  again.Load(machines.machines()[0].Save());
  const VmInput input = machines.inputs()[0];
  EXPECT_EQ(again.Tick(input).message, machines.machines()[0].Tick(input).message);
  // Nor that of another module, nor one that was altered.
  const std::string state = machines.machines()[0].Save();
  EXPECT_NE(WhyThrown([&] { machines.machines()[1].Load(state); }), "");
  std::string altered = state;
  altered[altered.size() / 2] ^= 1;
  EXPECT_NE(WhyThrown([&] { again.Load(altered); }), "");
  EXPECT_NE(WhyThrown([&] { again.Load("nonsense"); }), "");
}

TEST(VmLibrary, RefusesInputsOfOtherSizesAndDamagedMessages) {
  const Model model = CompileM3l(test::SourcePath("models/mtran.m3l"));
  const Robot robot = model.robot("quadruped");
  const Program program = CompileDynaRole(test::SourcePath("models/programs/quadruped.dyn"), model);
  EXPECT_NE(WhyThrown([&] { VirtualMachine machine(robot, program, 9); }), "");
  VirtualMachine machine(robot, program, 0);
  VmInput input = machine.InputAtRest();
  input.position.pop_back();
  EXPECT_EQ(WhyThrown([&] { machine.Tick(input); }),
            "a module with 2 joints gets 1 values for them");
  input = machine.InputAtRest();
  input.position[0] = NAN;
  EXPECT_NE(WhyThrown([&] { machine.Tick(input); }), "");
  input = machine.InputAtRest();
  input.time_s = INFINITY;
  EXPECT_NE(WhyThrown([&] { machine.Tick(input); }), "");
  input = machine.InputAtRest();
  input.connectors[0].mate_module = 1 << 16;
  EXPECT_NE(WhyThrown([&] { machine.Tick(input); }), "");
  input = machine.InputAtRest();
  input.connectors.pop_back();
  EXPECT_NE(WhyThrown([&] { machine.Tick(input); }), "");
  input = machine.InputAtRest();
  std::string message = machine.Tick(input).message;
  message[message.size() / 2] ^= 1;
  input.connectors[0].message = message;
  EXPECT_NE(WhyThrown([&] { machine.Tick(input); }).find("a neighbour's message"),
            std::string::npos);
}

}  // namespace
}  // namespace morphbus
