#include "tools/launch/run_outcome.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "compiler/base/columns.h"
#include "compiler/base/text.h"
#include "logger/log/facts_text.h"
#include "logger/log/run_log.h"
#include "tools/base/inspection_report.h"
#include "tools/base/messages.h"
#include "tools/base/model_io.h"
#include "tools/base/program.h"
#include "tools/roles/static_roles.h"

namespace morphbus::tools {
namespace {

/// RunSummary::problems, for the roles and connections that modules have when the run ends. Nobody
/// expects a role of those that are lost.
std::vector<std::string> RoleProblems(const RunPlan& plan,
                                      const std::vector<std::pair<std::string, std::string>>& roles,
                                      const DockedTable& docked,
                                      const std::map<std::string, int64_t>& lost) {
  // Most runs end here: every module has its role.
  std::map<std::string, std::string> role_of(roles.begin(), roles.end());
  const bool all = std::none_of(roles.begin(), roles.end(), [&](const auto& entry) {
    return entry.second.empty() && !lost.contains(entry.first);
  });
  if (all || !HasRoles(plan)) return {};
  // Why a module has no role is found by ticking the robot at rest, as `morphbus roles` does.
  const Situation situation = {docked};
  const Result<StaticRoles> at_rest = SettleRoles(plan, &situation);
  if (!at_rest) return {at_rest.error().message};
  std::vector<std::string> problems;
  for (const StaticRole& module : at_rest->modules) {
    // A module that has a role has no problem, whatever it was at rest.
    if (!role_of[module.module].empty() || lost.contains(module.module)) continue;
    // It lost its role on the way, or the run was too short.
    if (!module.role.empty()) {
      problems.push_back(
          fmt::format("{}: has no role when the run ends; at the start values it fits {}",
                      module.module, module.role));
    }
    for (const RoleProblem& problem : module.problems) problems.push_back(problem.text);
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

/// Lines of which there may be thousands: the first ones, then how many more there are.
std::string FirstLines(const std::vector<std::string>& lines) {
  std::string text;
  for (size_t i = 0; i < std::min(lines.size(), kMostNamed); ++i) text += lines[i] + "\n";
  if (lines.size() > kMostNamed) {
    text += fmt::format("    and {} more (--json)\n", lines.size() - kMostNamed);
  }
  return text;
}

/// What went missing, by process; empty if nothing did.
std::string LossText(const RunSummary& s) {
  if (s.lost == 0) return "";
  // A line a process shows where messages went missing.
  std::vector<std::string> lines;
  for (const auto& [process, ledger] : s.facts.health) {
    lines.push_back(fmt::format(
        "    {:<8} {:>7} received {:>7} lost {:>7} thrown away {:>6} asked {:>6} sent again",
        process, ledger.received, ledger.lost, ledger.discarded, ledger.asked, ledger.resent));
  }
  return fmt::format("  {} lost, {} sent again\n", Counted(s.lost, "message"), s.resent) +
         FirstLines(lines);
}

/// Modules that the run went on without, with the sim time from which on, as JSON.
Json LostJson(const logger::LogFacts& facts) {
  Json lost = Json::object();
  for (const auto& [module, time_us] : facts.lost_modules) lost[module] = Seconds(time_us);
  return lost;
}

/// What happened to modules' processes; empty if nothing did.
std::string DeathsText(const RunSummary& s) {
  std::vector<std::string> lines;
  for (const auto& [module, time_us] : s.facts.lost_modules) {
    lines.push_back(fmt::format("  {} was lost at {:.2f} s", module, Seconds(time_us)));
  }
  for (const auto& [module, times] : s.outcome.restarts) {
    lines.push_back(
        fmt::format("  {} died and was started again: {}", module, Counted(times, "time")));
  }
  return FirstLines(lines);
}

/// Messages that nobody of the run can have sent, by process, and processes for which the kernel
/// took no filter; empty if there were none.
std::string RefusedText(const RunSummary& s) {
  std::string text;
  for (const auto& [process, health] : s.facts.health) {
    if (logger::RefusedMessages(health) == 0) continue;
    text += fmt::format("  {} refused {}\n", process, logger::RefusedText(health));
  }
  // All modules are mostly alike in this: one line for them together.
  int64_t filters = 0;
  std::string first;
  for (const auto& [process, health] : s.facts.health) {
    if (health.refused_filters > 0 && first.empty()) first = process;
    filters += health.refused_filters;
  }
  if (filters > 0) {
    text += fmt::format(
        "  {} refused by the kernel (first {}'s), so that all messages wake such a process: "
        "morphbus "
        "doctor\n",
        Counted(filters, "filter"), first);
  }
  return text;
}

/// The first faults of the log, a line each, how many there are, and what they have ended for good.
std::string FaultsText(const RunSummary& s) {
  constexpr size_t kShown = 10;
  if (s.facts.num_faults == 0) return "  no faults\n";
  std::string text = fmt::format("  {}\n", Counted(s.facts.num_faults, "fault"));
  const size_t shown = std::min(s.facts.faults.size(), kShown);
  for (size_t i = 0; i < shown; ++i) text += fmt::format("    {}\n", FaultText(s.facts.faults[i]));
  const int64_t more = s.facts.num_faults - static_cast<int64_t>(shown);
  if (more > 0) text += fmt::format("    and {} more (morphbus info)\n", more);
  for (const std::string& line : logger::EndedLines(s.facts.ended)) text += "  " + line + "\n";
  return text;
}

/// Which roles modules have at the end, and why those have none that do. Of a run that has failed
/// before that could be known, of a large robot only how many have one.
std::string RolesText(const RunSummary& s) {
  const bool failed = !s.outcome.error.empty();
  if (failed && s.roles.size() > kMostNamed) {
    std::vector<std::string> without;
    for (const auto& [module, role] : s.roles) {
      if (role.empty()) without.push_back(module);
    }
    if (without.empty()) return fmt::format("  all {} modules have a role\n", s.roles.size());
    return fmt::format("  {} of {} have no role: {}\n", without.size(),
                       Counted(static_cast<int64_t>(s.roles.size()), "module"),
                       NameFirst(without, 3));
  }
  std::vector<std::vector<std::string>> roles;
  for (const auto& [module, role] : s.roles) {
    roles.push_back({module, role.empty() ? "(no role)" : EscapeControl(role)});
  }
  // Problems may be as many as modules times roles. After a failure they need not be the program's.
  std::vector<std::string> problems;
  for (const std::string& problem : s.problems) problems.push_back("    problem: " + problem);
  return Columns(roles, "  ") + (failed ? "" : FirstLines(problems));
}

/// The first lines that the program printed, and how many there are; empty if it printed none.
std::string PrintsText(const RunSummary& s) {
  constexpr size_t kShown = 20;
  if (s.facts.num_prints == 0) return "";
  std::string text = fmt::format("  {} printed\n", Counted(s.facts.num_prints, "line"));
  const size_t shown = std::min(s.facts.prints.size(), kShown);
  for (size_t i = 0; i < shown; ++i) {
    const logger::PrintFact& print = s.facts.prints[i];
    text += fmt::format("    {:.3f} s {} ({}): {}\n", static_cast<double>(print.time_us) * 1e-6,
                        print.module, print.role.empty() ? "no role" : print.role, print.Line());
  }
  const int64_t more = s.facts.num_prints - static_cast<int64_t>(shown);
  if (more > 0) text += fmt::format("    and {} more (morphbus info)\n", more);
  return text;
}

/// What is wrong with a log that its run closed: whether it holds what was recorded. Empty if it
/// does.
std::string WhyLogDiffers(const logger::LogFacts& facts, const std::string& recorded_hash) {
  const bool damaged =
      std::any_of(facts.findings.begin(), facts.findings.end(),
                  [](const logger::LogFinding& finding) { return finding.is_damage(); });
  if (facts.end_state == logger::EndState::kVerified && !damaged) return "";
  return fmt::format(
      "the log was altered while it was written: the run's hash is {}, that of what the log holds "
      "{} (morphbus verify names the places)",
      recorded_hash, facts.run_hash);
}

}  // namespace

Json FaultJson(const logger::FaultFact& fault) {
  // Line 0 stands for a fault without a place in the source.
  const bool placed = fault.fault.line > 0 && !fault.file.empty();
  return {{"module", fault.module},
          {"time", Seconds(fault.time_us)},
          {"role", fault.role},
          {"fault", fault.text},
          {"ended", logger::EndedKind(fault)},
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
  s.arithmetic = plan.description.arithmetic();
  // A log may hold several runs; only this one counts.
  const auto log = s.outcome.log.empty() ? Result<logger::RunLog>(Fail("no log"))
                                         : logger::LoadRunLog(s.outcome.log, {s.outcome.run, true});
  std::string* error = &s.outcome.error;
  if (!log) {
    // A run without a log has said why; one that closed its log must be able to read it.
    if (error->empty() && !s.outcome.log.empty()) {
      *error = "the log cannot be read back: " + log.error().message;
    }
    return s;
  }
  // What can be counted is counted from the log, so that `info` says the same.
  s.facts = log->facts;
  s.hash = s.outcome.hash.empty() ? s.facts.run_hash : s.outcome.hash;
  // END vouches for what was written; what a failed run left unfinished is known to be cut.
  if (error->empty()) *error = WhyLogDiffers(s.facts, s.hash);
  for (const auto& [name, channel] : s.facts.channels) {
    if (channel.hashed) s.messages += channel.messages;
  }
  for (const auto& [process, health] : s.facts.health) {
    s.lost += health.lost + health.discarded;
    s.resent += health.resent;
    s.refused += logger::RefusedMessages(health);
  }
  for (const logger::ModuleSeries& module : log->modules) {
    // A module's last STATUS says which role it has at the end.
    // One that was lost plays nothing.
    const bool none = module.status.empty() || s.facts.lost_modules.contains(module.name);
    s.roles.emplace_back(module.name, none ? "" : module.status.back().status.role_name);
  }
  // What follows is worked out from the plan's model and the log together.
  DockedTable docked;
  for (const logger::ModuleSeries& module : log->modules) {
    if (!module.sensors.empty()) docked[module.name] = module.sensors.back().docked;
  }
  s.problems = RoleProblems(log->deployed.empty() ? plan : PlanAtEnd(plan, *log), s.roles, docked,
                            s.facts.lost_modules);
  s.figures = logger::FiguresOf(*log);
  s.inspections = InspectionsOf(*log);
  return s;
}

Json SummaryJson(const RunSummary& s) {
  // A module without a role is null, so that a script need not compare with "".
  Json roles = Json::object();
  for (const auto& [module, role] : s.roles)
    roles[module] = role.empty() ? Json(nullptr) : Json(role);
  Json faults = Json::array();
  for (const logger::FaultFact& fault : s.facts.faults) faults.push_back(FaultJson(fault));
  Json json = {{"run", s.outcome.run},
               {"hash", s.hash},
               {"seconds", s.facts.seconds},
               {"wall_seconds", s.outcome.wall_seconds},
               {"ticks", s.facts.ticks},
               {"messages", s.messages},
               {"lost", s.lost},
               {"resent", s.resent},
               {"refused", s.refused},
               {"roles", roles},
               {"problems", s.problems},
               {"faults", faults},
               {"num_faults", s.facts.num_faults},
               {"ended_tasks", logger::EndedJson(s.facts.ended)},
               {"prints", logger::PrintsJson(s.facts)},
               {"num_prints", s.facts.num_prints},
               {"inspections", s.inspections},
               {"program_hash", Hex(s.program_hash)},
               {"world_hash", s.world_hash},
               {"arithmetic", s.arithmetic},
               {"missed_deadlines", s.outcome.missed_deadlines},
               {"lateness", logger::LatenessJson(s.facts)},
               {"restarts", s.outcome.restarts},
               {"lost_modules", LostJson(s.facts)},
               {"processes", logger::HealthJson(s.facts)},
               {"log", s.outcome.log.empty() ? Json(nullptr) : Json(s.outcome.log)},
               {"log_hash", s.facts.run_hash},
               {"ended", s.outcome.reason},
               {"error", s.outcome.error.empty() ? Json(nullptr) : Json(s.outcome.error)}};
  json.update(logger::FiguresJson(s.figures));
  return json;
}

std::string SummaryText(const RunSummary& s) {
  // Figures, roles, motion, losses, faults, end: most is left out where there is nothing to say.
  const RunOutcome& outcome = s.outcome;
  const double seconds = s.facts.seconds;
  std::string text;
  if (!outcome.error.empty()) {
    text += fmt::format("failed at {:.2f} s: {}\n", seconds, EscapeControl(outcome.error));
  }
  text += fmt::format("run {}: {:.2f} s in {:.2f} s of wall time ({:.1f} x real time), {}, {}\n",
                      outcome.run, seconds, outcome.wall_seconds,
                      outcome.wall_seconds > 0 ? seconds / outcome.wall_seconds : 0.0,
                      Counted(s.facts.ticks, "tick"), Counted(s.messages, "message"));
  text += fmt::format("  hash {}   program {}   world {}\n", s.hash.empty() ? "-" : s.hash,
                      Hex(s.program_hash), s.world_hash);
  text += RolesText(s);
  for (const auto& [name, value] : logger::FigureLines(s.figures)) {
    text += fmt::format("  {} {}\n", name, value);
  }
  // Each of these is empty if there is nothing to say, but for the faults.
  text += LossText(s);
  text += DeathsText(s);
  text += RefusedText(s);
  if (outcome.missed_deadlines > 0) {
    text += fmt::format("  {} missed\n", Counted(outcome.missed_deadlines, "deadline"));
  }
  std::vector<std::string> late;
  for (const auto& [module, lateness] : s.facts.lateness) {
    late.push_back(fmt::format("    {:<8} {} missed; {} came late, {:.1f} ms at most", module,
                               lateness.missed, lateness.late,
                               static_cast<double>(lateness.worst_us) * 1e-3));
  }
  text += FirstLines(late);
  text += FaultsText(s);
  text += PrintsText(s);
  text += InspectionsText(s.inspections);
  // Why a failed run ended stands first.
  if (!outcome.reason.empty() && outcome.error.empty())
    text += fmt::format("  ended: {}\n", EscapeControl(outcome.reason));
  if (!outcome.log.empty()) text += fmt::format("  log {}\n", outcome.log);
  return text;
}

}  // namespace morphbus::tools
