#include "tools/launch/run_outcome.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "compiler/base/text.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/model/kinematic_graph.h"
#include "logger/log/run_log.h"
#include "tools/base/messages.h"
#include "tools/base/model_io.h"
#include "tools/base/program.h"
#include "tools/launch/static_roles.h"
#include "tools/launch/walk_figures.h"

namespace morphbus::tools {
namespace {

using BodyTable = std::vector<std::vector<int>>;  ///< body[module][link].

/// A body, and in it a frame of which `X_RP` says how it lies at the start.
TrackedBody Follow(const RunPlan& plan, const BodyTable& body_of, int body,
                   const model::Pose& X_RP) {
  const model::Robot& robot = plan.robot();
  const model::KinematicState start =
      model::ForwardKinematics(plan.model, robot, model::StartValues(robot));
  // The first link of the body, in order of modules and links.
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
  // A description always names a root module; the robot's own stands in where it is unknown.
  const int module = robot.FindModule(plan.description.root_module()).value_or(robot.root_module);
  const int link = RootPoseOf(plan, module).link;
  const BodyTable body_of = model::BodiesOf(plan.model, robot);
  return Follow(plan, body_of, body_of[module][link], model::Pose::Identity());
}

/// The heaviest body, the trunk of whatever walks, at its centre of mass: how a robot walks does
/// not depend on which module is root.
TrackedBody Trunk(const RunPlan& plan) {
  const model::Robot& robot = plan.robot();
  const BodyTable body_of = model::BodiesOf(plan.model, robot);
  const model::KinematicState start =
      model::ForwardKinematics(plan.model, robot, model::StartValues(robot));
  // Mass and first moment of every body, in the robot frame at the start values.
  std::map<int, double> mass;
  std::map<int, Eigen::Vector3d> moment_R;  // kg m
  for (size_t m = 0; m < body_of.size(); ++m) {
    const model::ModuleType& type = plan.model.TypeOf(robot, static_cast<int>(m));
    for (size_t l = 0; l < body_of[m].size(); ++l) {
      // The first moment of a link is its mass times its position.
      const double kg = type.links[l].mass_kg;
      mass[body_of[m][l]] += kg;
      moment_R.try_emplace(body_of[m][l], Eigen::Vector3d::Zero()).first->second +=
          kg * start.X_RL[m][l].translation();
    }
  }
  // A body without mass has no centre: its first link's frame is followed then.
  const auto trunk = std::max_element(
      mass.begin(), mass.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (trunk == mass.end()) return {};
  model::Pose X_RP = model::Pose::Identity();
  if (trunk->second > 0.0) X_RP.translation() = moment_R.at(trunk->first) / trunk->second;
  return Follow(plan, body_of, trunk->first, X_RP);
}

/// RunSummary::problems, for the roles that modules have when the run ends.
std::vector<std::string> RoleProblems(
    const RunPlan& plan, const std::vector<std::pair<std::string, std::string>>& roles) {
  // Most runs end here: every module has its role.
  std::map<std::string, std::string> role_of(roles.begin(), roles.end());
  const bool all = std::none_of(roles.begin(), roles.end(),
                                [](const auto& entry) { return entry.second.empty(); });
  if (all || !HasRoles(plan)) return {};
  // Why a module has no role is found by ticking the robot at rest, as `morphbus roles` does.
  const Result<StaticRoles> at_rest = SettleRoles(plan);
  if (!at_rest) return {at_rest.error().message};
  std::vector<std::string> problems;
  for (const StaticRole& module : at_rest->modules) {
    // A module that has a role has no problem, whatever it was at rest.
    if (!role_of[module.module].empty()) continue;
    // It lost its role on the way, or the run was too short.
    if (!module.role.empty()) {
      problems.push_back(
          fmt::format("{}: has no role when the run ends; at the start values it fits {}",
                      module.module, module.role));
    }
    problems.insert(problems.end(), module.problems.begin(), module.problems.end());
  }
  return problems;
}

/// The plan with the program that a module ran last, where one was deployed while the robot ran.
RunPlan PlanAtEnd(const RunPlan& plan, const logger::RunLog& log) {
  RunPlan end = plan;
  for (const logger::ModuleSeries& module : log.modules) {
    if (module.status.empty()) continue;
    const auto hash = static_cast<uint64_t>(module.status.back().status.header.program_hash);
    const auto image = log.deployed.find(hash);
    if (image == log.deployed.end()) continue;
    end.description.set_program_image(image->second);
    end.description.set_program_hash(hash);
    // Only the name of its source is known, without a folder.
    const auto program = VerifyProgram(image->second);
    if (program) end.description.set_program_file(ToString((*program)->source_name()));
  }
  return end;
}

/// How far the robot went and turned, as JSON; null without poses.
Json WalkJson(const std::optional<WalkFigures>& figures) {
  if (!figures) return nullptr;
  return {{"cycle_s", figures->cycle_s},
          {"cycle_north_m", figures->cycle_north_m},
          {"cycle_turn_rad", figures->cycle_turn_rad},
          {"turn_rad", figures->turn_rad},
          {"max_tilt_rad", figures->max_tilt_rad},
          {"min_height_m", figures->min_height_m}};
}

/// The same on one line for people; empty if nothing repeats.
std::string WalkText(const std::optional<WalkFigures>& figures) {
  constexpr double kDegrees = 180.0 / EIGEN_PI;
  if (!figures || figures->cycle_north_m.empty()) return "";
  // Each cycle's way north is shown in millimetres.
  std::string cycles;
  for (const double north : figures->cycle_north_m) {
    cycles += fmt::format("{}{:.0f}", cycles.empty() ? "" : " ", north * 1000.0);
  }
  return fmt::format(
      "  cycle of {:.2f} s, mm north in each: {}; turned {:+.1f} degrees, tilted {:.1f} at most\n",
      figures->cycle_s, cycles, figures->turn_rad * kDegrees, figures->max_tilt_rad * kDegrees);
}

/// What went missing, by process; empty if nothing did.
std::string LossText(const RunSummary& s) {
  if (s.lost == 0) return "";
  std::string text =
      fmt::format("  {} lost, {} sent again\n", Counted(s.lost, "message"), s.resent);
  // A line a process shows where messages went missing.
  for (const auto& [process, ledger] : s.facts.health) {
    text += fmt::format(
        "    {:<8} {:>7} received {:>7} lost {:>7} thrown away {:>6} asked {:>6} sent again\n",
        process, ledger.received, ledger.lost, ledger.discarded, ledger.asked, ledger.resent);
  }
  return text;
}

/// The first faults of the log, a line each, and how many there are.
std::string FaultsText(const RunSummary& s) {
  constexpr size_t kShown = 10;
  if (s.facts.num_faults == 0) return "  no faults\n";
  std::string text = fmt::format("  {}\n", Counted(s.facts.num_faults, "fault"));
  const size_t shown = std::min(s.facts.faults.size(), kShown);
  for (size_t i = 0; i < shown; ++i) text += fmt::format("    {}\n", FaultText(s.facts.faults[i]));
  const int64_t more = s.facts.num_faults - static_cast<int64_t>(shown);
  if (more > 0) text += fmt::format("    and {} more (morphbus info)\n", more);
  return text;
}

}  // namespace

Json FaultJson(const logger::FaultFact& fault) {
  // Line 0 stands for a fault without a place in the source.
  const bool placed = fault.fault.line > 0 && !fault.file.empty();
  return {{"module", fault.module},
          {"time", Seconds(fault.time_us)},
          {"role", fault.role},
          {"fault", fault.text},
          {"function", fault.function.empty() ? Json(nullptr) : Json(fault.function)},
          {"file", placed ? Json(fault.file) : Json(nullptr)},
          {"line", placed ? Json(fault.fault.line) : Json(nullptr)}};
}

std::string FaultText(const logger::FaultFact& fault) {
  return EscapeControl(
      fmt::format("{:8.2f} s  {:<6} {}", Seconds(fault.time_us), fault.module, fault.Line()));
}

RunSummary Summarize(const RunPlan& plan, RunOutcome outcome) {
  RunSummary s;
  s.outcome = std::move(outcome);
  // The hashes are known even if the run left no log.
  s.program_hash = plan.description.program_hash();
  s.world_hash = plan.description.world_hash();
  // A log may hold several runs; only this one counts.
  const auto log = s.outcome.log.empty() ? Result<logger::RunLog>(Fail("no log"))
                                         : logger::LoadRunLog(s.outcome.log, {s.outcome.run, true});
  if (!log) return s;
  // What can be counted is counted from the log, so that `info` says the same.
  s.facts = log->facts;
  for (const auto& [name, channel] : s.facts.channels) {
    if (channel.hashed) s.messages += channel.messages;
  }
  for (const auto& [process, health] : s.facts.health) {
    s.lost += health.lost + health.discarded;
    s.resent += health.resent;
  }
  for (const logger::ModuleSeries& module : log->modules) {
    // A module's last STATUS says which role it has at the end.
    s.roles.emplace_back(module.name,
                         module.status.empty() ? "" : module.status.back().status.role_name);
  }
  // What follows is worked out from the plan's model and the log together.
  s.problems = RoleProblems(log->deployed.empty() ? plan : PlanAtEnd(plan, *log), s.roles);
  s.displacement = MeasureDisplacement(*log, RootBody(plan));
  s.walk = MeasureWalk(*log, Trunk(plan));
  return s;
}

Json SummaryJson(const RunSummary& s) {
  // What each process received and lost, by its last HEALTH.
  Json processes = Json::object();
  for (const auto& [process, health] : s.facts.health) {
    processes[process] = {{"received", health.received},
                          {"lost", health.lost},
                          {"discarded", health.discarded},
                          {"resent", health.resent},
                          {"asked", health.asked},
                          {"bad", health.bad},
                          {"queue_overflows", health.queue_overflows}};
  }
  // A module without a role is null, so that a script need not compare with "".
  Json roles = Json::object();
  for (const auto& [module, role] : s.roles)
    roles[module] = role.empty() ? Json(nullptr) : Json(role);
  Json faults = Json::array();
  for (const logger::FaultFact& fault : s.facts.faults) faults.push_back(FaultJson(fault));
  return {{"run", s.outcome.run},
          {"hash", s.facts.run_hash},
          {"seconds", s.facts.seconds},
          {"wall_seconds", s.outcome.wall_seconds},
          {"ticks", s.facts.ticks},
          {"messages", s.messages},
          {"lost", s.lost},
          {"resent", s.resent},
          {"roles", roles},
          {"problems", s.problems},
          {"displacement", s.displacement ? VectorJson(*s.displacement) : Json(nullptr)},
          {"faults", faults},
          {"num_faults", s.facts.num_faults},
          {"walk", WalkJson(s.walk)},
          {"program_hash", Hex(s.program_hash)},
          {"world_hash", s.world_hash},
          {"missed_deadlines", s.outcome.missed_deadlines},
          {"processes", processes},
          {"log", s.outcome.log},
          {"ended", s.outcome.reason},
          {"error", s.outcome.error.empty() ? Json(nullptr) : Json(s.outcome.error)}};
}

std::string SummaryText(const RunSummary& s) {
  // Figures, roles, motion, losses, faults, end: most is left out where there is nothing to say.
  const RunOutcome& outcome = s.outcome;
  const double seconds = s.facts.seconds;
  std::string text =
      fmt::format("run {}: {:.2f} s in {:.2f} s of wall time ({:.1f} x real time), {}, {}\n",
                  outcome.run, seconds, outcome.wall_seconds,
                  outcome.wall_seconds > 0 ? seconds / outcome.wall_seconds : 0.0,
                  Counted(s.facts.ticks, "tick"), Counted(s.messages, "message"));
  text += fmt::format("  hash {}   program {}   world {}\n",
                      s.facts.run_hash.empty() ? "-" : s.facts.run_hash, Hex(s.program_hash),
                      s.world_hash);
  for (const auto& [module, role] : s.roles) {
    text += fmt::format("  {:<8} {}\n", module, role.empty() ? "(no role)" : EscapeControl(role));
  }
  // Problems may be as many as modules times roles.
  for (size_t i = 0; i < std::min(s.problems.size(), kMostNamed); ++i) {
    text += fmt::format("    problem: {}\n", s.problems[i]);
  }
  if (s.problems.size() > kMostNamed) {
    text += fmt::format("    and {} more (--json)\n", s.problems.size() - kMostNamed);
  }
  // W is north, up, east.
  if (s.displacement) {
    text += fmt::format("  moved {:+.3f} m north, {:+.3f} m up, {:+.3f} m east\n",
                        s.displacement->x(), s.displacement->y(), s.displacement->z());
  }
  // Each of these is empty if there is nothing to say, but for the faults.
  text += WalkText(s.walk);
  text += LossText(s);
  if (outcome.missed_deadlines > 0) {
    text += fmt::format("  {} missed\n", Counted(outcome.missed_deadlines, "deadline"));
  }
  text += FaultsText(s);
  if (!outcome.reason.empty()) text += fmt::format("  ended: {}\n", EscapeControl(outcome.reason));
  if (!outcome.log.empty()) text += fmt::format("  log {}\n", outcome.log);
  return text;
}

}  // namespace morphbus::tools
