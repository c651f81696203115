#pragma once
// What holds of every run that ends as it should, for the tests of whole runs.

#include <gtest/gtest.h>

#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "test/bridge/fake_run.h"

namespace morphbus::bridge {

/// The ticks from 0 up to another.
inline std::vector<int64_t> Upto(int64_t end) {
  std::vector<int64_t> ticks(static_cast<size_t>(end));
  std::iota(ticks.begin(), ticks.end(), 0);
  return ticks;
}

/// That a run ended well, with every tick computed once by every module and the whole of it logged.
inline void ExpectWhole(FakeRun* run) {
  EXPECT_TRUE(run->sim->outcome().ok) << run->sim->outcome().error;
  EXPECT_EQ(run->sim->outcome().ticks, run->options.ticks);
  EXPECT_EQ(run->robot.ticks, run->options.ticks);
  EXPECT_EQ(run->robot.actuations, run->options.ticks * run->options.modules);
  for (const FakeRun::Module& module : run->modules) {
    EXPECT_EQ(module.controller->computed, Upto(run->options.ticks)) << "each tick once, in order";
    EXPECT_EQ(module.controller->missing_messages, 0);
    EXPECT_EQ(module.participant->error(), "");
    EXPECT_EQ(module.participant->ledger().bad, 0);
  }
  if (run->log == nullptr) return;
  EXPECT_TRUE(run->log->complete()) << run->log->error();
  EXPECT_EQ(run->log->run_hash(), run->sim->outcome().run_hash);
  EXPECT_EQ(run->sim->outcome().recorded_hash, run->sim->outcome().run_hash);
  EXPECT_EQ(run->logged_bad, 0);
}

/// The hash of a run that must end well.
inline std::string HashOf(const FakeRunOptions& options) {
  FakeRun run(options);
  EXPECT_TRUE(run.Run());
  ExpectWhole(&run);
  return run.sim->outcome().run_hash;
}

}  // namespace morphbus::bridge
