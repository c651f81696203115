#include "tools/monitor/run_outline.h"

#include <string>
#include <utility>
#include <vector>

namespace morphbus::tools {
namespace {

/// The names of a robot's modules, in its order.
std::vector<std::string> OutlinedModules(const model::Robot& robot) {
  std::vector<std::string> names;
  for (const model::ModuleInstance& module : robot.modules) names.push_back(module.name);
  return names;
}

}  // namespace

RunOutline::RunOutline(std::shared_ptr<const bridge::RunModel> run)
    : run_(std::move(run)), listener_(run_->run, run_->model_hash, OutlinedModules(*run_->robot)) {}

bool RunOutline::Decodes(const bridge::RunMessage& message) {
  const bridge::Topic topic = message.name.topic;
  return topic == bridge::Topic::kClock || topic == bridge::Topic::kStatus;
}

void RunOutline::OnChecked(const bridge::RunMessage& message) {
  // What is none of the robot's modules has no role, and would let this grow.
  if (message.module < 0) return;
  if (message.name.topic == bridge::Topic::kTransform) series_.TakeTransform(message, true);
}

void RunOutline::OnClock(const bridge::RunMessage& message, morphbus::sim_clock_t&& /*clock*/) {
  time_us_ = message.header.sim_time_us;
}

void RunOutline::OnStatus(const bridge::RunMessage& message, morphbus::status_t&& status) {
  if (message.module < 0) return;
  auto& known = series_.Module(message.name.process).status;
  const size_t before = known.size();
  series_.TakeStatus(message.name.process, message.header.sim_time_us, std::move(status), true);
  if (known.size() > before) ++version_;
}

logger::RunLog RunOutline::Log() const {
  logger::RunLog log;
  log.described = run_;
  log.model = std::shared_ptr<const model::Model>(run_, &run_->model);
  log.robot = run_->robot;
  log.ticks_us = {time_us_};
  log.tick_us = static_cast<int32_t>(run_->tick_us);
  // The collector gives away what it has, and shall go on.
  logger::SeriesCollector(series_).Finish(&log);
  log.ticks_us = {time_us_};
  return log;
}

}  // namespace morphbus::tools
