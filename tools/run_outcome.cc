#include "tools/run_outcome.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "compiler/model/forward_kinematics.h"
#include "compiler/model/kinematic_graph.h"
#include "logger/run_log.h"
#include "tools/walk_figures.h"

namespace morphbus::tools {
namespace {

using BodyTable = std::vector<std::vector<int>>;  ///< body[module][link].

/// A body, and in it a frame of which `X_RP` says how it lies at the start.
TrackedBody Follow(const RunPlan& plan, const BodyTable& body_of, int body,
                   const model::Pose& X_RP) {
  const model::Robot& robot = plan.robot();
  const model::KinematicState start =
      model::ForwardKinematics(plan.model, robot, model::StartValues(robot));
  for (size_t m = 0; m < body_of.size(); ++m) {
    for (size_t l = 0; l < body_of[m].size(); ++l) {
      // WORLD names a body by its first link.
      if (body_of[m][l] == body) {
        return {{static_cast<int>(m), static_cast<int>(l)}, start.X_RL[m][l].inverse() * X_RP};
      }
    }
  }
  return {};
}

/// The root's body, and in it the robot frame.
TrackedBody RootBody(const RunPlan& plan) {
  const model::Robot& robot = plan.robot();
  const int module = robot.FindModule(plan.description.root_module()).value_or(robot.root_module);
  const int link = RootPoseOf(plan, module).link;
  const BodyTable body_of = model::BodiesOf(plan.model, robot);
  return Follow(plan, body_of, body_of[static_cast<size_t>(module)][static_cast<size_t>(link)],
                model::Pose::Identity());
}

/// The heaviest body, the trunk of whatever walks, at its centre of mass: how a robot walks does
/// not depend on which module is root.
TrackedBody Trunk(const RunPlan& plan) {
  const model::Robot& robot = plan.robot();
  const BodyTable body_of = model::BodiesOf(plan.model, robot);
  const model::KinematicState start =
      model::ForwardKinematics(plan.model, robot, model::StartValues(robot));
  std::map<int, double> mass;
  std::map<int, Eigen::Vector3d> moment_R;  // kg m
  for (size_t m = 0; m < body_of.size(); ++m) {
    const model::ModuleType& type = plan.model.TypeOf(robot, static_cast<int>(m));
    for (size_t l = 0; l < body_of[m].size(); ++l) {
      const double kg = type.links[l].mass_kg;
      mass[body_of[m][l]] += kg;
      moment_R.try_emplace(body_of[m][l], Eigen::Vector3d::Zero()).first->second +=
          kg * start.X_RL[m][l].translation();
    }
  }
  const auto trunk = std::max_element(
      mass.begin(), mass.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (trunk == mass.end()) return {};
  model::Pose X_RP = model::Pose::Identity();
  if (trunk->second > 0.0) X_RP.translation() = moment_R.at(trunk->first) / trunk->second;
  return Follow(plan, body_of, trunk->first, X_RP);
}

Json Displacement(const RunPlan& plan, const logger::RunLog& log) {
  const std::optional<Eigen::Vector3d> displacement = MeasureDisplacement(log, RootBody(plan));
  return displacement ? VectorJson(*displacement) : Json(nullptr);
}

Json Roles(const logger::RunLog& log) {
  Json roles = Json::object();
  for (const logger::ModuleSeries& module : log.modules) {
    const bool known = !module.status.empty() && !module.status.back().status.role_name.empty();
    roles[module.name] = known ? Json(module.status.back().status.role_name) : Json(nullptr);
  }
  return roles;
}

Json Faults(const logger::RunLog& log, const std::string& program) {
  Json faults = Json::array();
  for (const logger::FaultFact& fault : log.facts.faults) {
    faults.push_back(FaultJson(fault, program));
  }
  return faults;
}

Json Walk(const RunPlan& plan, const logger::RunLog& log) {
  const std::optional<WalkFigures> figures = MeasureWalk(log, Trunk(plan));
  if (!figures) return nullptr;
  return {{"cycle_s", figures->cycle_s},
          {"cycle_north_m", figures->cycle_north_m},
          {"cycle_turn_rad", figures->cycle_turn_rad},
          {"turn_rad", figures->turn_rad},
          {"max_tilt_rad", figures->max_tilt_rad},
          {"min_height_m", figures->min_height_m}};
}

}  // namespace

Json FaultJson(const logger::FaultFact& fault, const std::string& program) {
  const bool placed = fault.line > 0;
  return {{"module", fault.module},
          {"time", static_cast<double>(fault.time_us) * 1e-6},
          {"role", fault.role},
          {"fault", fault.text},
          {"function", fault.function.empty() ? Json(nullptr) : Json(fault.function)},
          {"file", placed ? Json(program) : Json(nullptr)},
          {"line", placed ? Json(fault.line) : Json(nullptr)}};
}

std::string FaultText(const Json& fault) {
  std::string place;
  if (!fault["line"].is_null()) {
    place = fmt::format("{}:{}: ", fault["file"].get<std::string>(), fault["line"].get<int>());
  }
  std::string function;
  if (!fault["function"].is_null()) {
    function = fmt::format(" ({})", fault["function"].get<std::string>());
  }
  return fmt::format("{:8.2f} s  {:<6} {}{}{}", fault["time"].get<double>(),
                     fault["module"].get<std::string>(), place, fault["fault"].get<std::string>(),
                     function);
}

Json SummaryJson(const RunPlan& plan, const RunOutcome& outcome) {
  int64_t lost = 0;
  int64_t resent = 0;
  Json processes = Json::object();
  for (const auto& [process, health] : outcome.health) {
    lost += health.lost + health.discarded;
    resent += health.resent;
    processes[process] = {{"received", health.received},
                          {"lost", health.lost},
                          {"discarded", health.discarded},
                          {"resent", health.resent},
                          {"asked", health.asked},
                          {"bad", health.bad},
                          {"queue_overflows", health.queue_overflows}};
  }
  Json summary = {
      {"run", outcome.run},
      {"hash", outcome.hash},
      {"seconds", static_cast<double>(outcome.ticks) * plan.description.tick_us() * 1e-6},
      {"wall_seconds", outcome.wall_seconds},
      {"ticks", outcome.ticks},
      {"messages", outcome.messages},
      {"lost", lost},
      {"resent", resent},
      {"roles", Json::object()},
      {"displacement", nullptr},
      {"faults", Json::array()},
      {"walk", nullptr},
      {"program_hash", fmt::format("{:016x}", plan.description.program_hash())},
      {"world_hash", plan.description.world_hash()},
      {"missed_deadlines", outcome.missed_deadlines},
      {"processes", processes},
      {"log", outcome.log},
      {"ended", outcome.reason},
      {"error", outcome.error.empty() ? Json(nullptr) : Json(outcome.error)}};
  const auto log = outcome.log.empty() ? Result<logger::RunLog>(Fail("no log"))
                                       : logger::LoadRunLog(outcome.log, {outcome.run, true});
  if (log) {
    summary["roles"] = Roles(*log);
    summary["displacement"] = Displacement(plan, *log);
    summary["walk"] = Walk(plan, *log);
    summary["faults"] = Faults(*log, plan.description.program_file());
  }
  return summary;
}

namespace {

std::string WalkText(const Json& walk) {
  constexpr double kDegrees = 180.0 / EIGEN_PI;
  if (walk.is_null() || walk["cycle_north_m"].empty()) return "";
  std::string cycles;
  for (const Json& north : walk["cycle_north_m"]) {
    cycles += fmt::format("{}{:.0f}", cycles.empty() ? "" : " ", north.get<double>() * 1000.0);
  }
  return fmt::format(
      "  cycle of {:.2f} s, mm north in each: {}; turned {:+.1f} degrees, tilted {:.1f} at most\n",
      walk["cycle_s"].get<double>(), cycles, walk["turn_rad"].get<double>() * kDegrees,
      walk["max_tilt_rad"].get<double>() * kDegrees);
}

}  // namespace

std::string SummaryText(const Json& s, const RunOutcome& outcome) {
  const double seconds = s["seconds"].get<double>();
  std::string text = fmt::format(
      "run {}: {:.2f} s in {:.2f} s of wall time ({:.1f} x real time), {} ticks, {} messages\n",
      outcome.run, seconds, outcome.wall_seconds,
      outcome.wall_seconds > 0 ? seconds / outcome.wall_seconds : 0.0, outcome.ticks,
      outcome.messages);
  text +=
      fmt::format("  hash {}   program {}   world {}\n", outcome.hash.empty() ? "-" : outcome.hash,
                  s["program_hash"].get<std::string>(), s["world_hash"].get<std::string>());
  for (const auto& [module, role] : s["roles"].items()) {
    text +=
        fmt::format("  {:<8} {}\n", module, role.is_null() ? "(no role)" : role.get<std::string>());
  }
  if (s["displacement"].is_array()) {
    const Json& d = s["displacement"];
    text += fmt::format("  moved {:+.3f} m north, {:+.3f} m up, {:+.3f} m east\n",
                        d[0].get<double>(), d[1].get<double>(), d[2].get<double>());
  }
  text += WalkText(s["walk"]);
  if (s["lost"].get<int64_t>() > 0) {
    text += fmt::format("  {} messages lost, {} sent again\n", s["lost"].get<int64_t>(),
                        s["resent"].get<int64_t>());
    for (const auto& [process, ledger] : s["processes"].items()) {
      text += fmt::format(
          "    {:<8} {:>7} received {:>7} lost {:>7} thrown away {:>6} asked {:>6} sent again\n",
          process, ledger["received"].get<int64_t>(), ledger["lost"].get<int64_t>(),
          ledger["discarded"].get<int64_t>(), ledger["asked"].get<int64_t>(),
          ledger["resent"].get<int64_t>());
    }
  }
  if (outcome.missed_deadlines > 0) {
    text += fmt::format("  {} deadlines missed\n", outcome.missed_deadlines);
  }
  const Json& faults = s["faults"];
  text += faults.empty() ? "  no faults\n" : fmt::format("  {}\n", Plural(faults.size(), "fault"));
  for (size_t i = 0; i < std::min<size_t>(faults.size(), 10); ++i) {
    text += fmt::format("    {}\n", FaultText(faults[i]));
  }
  if (faults.size() > 10)
    text += fmt::format("    and {} more (morphbus info)\n", faults.size() - 10);
  if (!outcome.reason.empty()) text += fmt::format("  ended: {}\n", outcome.reason);
  if (!outcome.log.empty()) text += fmt::format("  log {}\n", outcome.log);
  return text;
}

}  // namespace morphbus::tools
