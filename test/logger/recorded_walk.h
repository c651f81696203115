#pragma once
// A run of the quadruped, recorded once: tests alter its log, or compare others with it.

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "logger/log/run_log.h"

namespace morphbus::logger {

constexpr int64_t kWalkTicks = 150;  ///< Of the recorded run, 3 s: the legs move by then.

/// Reads a log; the test fails if it cannot be read.
RunLog Load(const std::string& path);

/// Records such a run of another robot, or with losses; returns the path of the log, which the
/// caller removes.
std::string Record(const std::string& robot, double loss);

/// The run that all tests alter, and what is read from it.
class Walk : public ::testing::Environment {
 public:
  void SetUp() override;
  void TearDown() override;

  std::string path;
  std::unique_ptr<RunLog> log;
};

extern Walk* walk;

}  // namespace morphbus::logger
