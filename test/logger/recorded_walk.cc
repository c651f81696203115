#include "test/logger/recorded_walk.h"
#include "logger/log/facts_text.h"

#include <cstdio>

#include "test/logger/temp_log.h"
#include "test/support/source_dir.h"
#include "tools/launch/inproc_run.h"
#include "tools/plan/run_plan.h"

namespace morphbus::logger {

RunLog Load(const std::string& path) {
  Result<RunLog> log = LoadRunLog(path);
  EXPECT_TRUE(log.has_value()) << (log ? "" : log.error().message);
  return log ? std::move(*log) : RunLog{};
}

std::string Record(const std::string& robot, double loss) {
  tools::RunOptions options;
  options.model_file = test::SourcePath("models/mtran.m3l");
  options.program_file = test::SourcePath("models/programs/quadruped.dyn");
  options.robot = robot;
  options.seconds = static_cast<double>(kWalkTicks) * 0.02;
  options.loss = loss;
  options.inproc = true;
  std::optional<tools::RunPlan> plan = tools::PlanRun(options);
  EXPECT_TRUE(plan.has_value());
  plan->description.set_run("doctored");
  const TempFile file;
  const tools::RunOutcome outcome =
      tools::RunInProcess(*plan, file.path(), bridge::RunKey(bridge::RunKey::Bytes{1}));
  EXPECT_EQ(outcome.error, "");
  const std::string kept = file.path() + ".kept";
  std::rename(file.path().c_str(), kept.c_str());
  return kept;
}

void Walk::SetUp() {
  path = Record("quadruped", 0.0);
  log = std::make_unique<RunLog>(Load(path));
  ASSERT_TRUE(log->facts.whole()) << VerifyText(log->facts);
}

void Walk::TearDown() { std::remove(path.c_str()); }

Walk* walk = dynamic_cast<Walk*>(::testing::AddGlobalTestEnvironment(new Walk));

}  // namespace morphbus::logger
