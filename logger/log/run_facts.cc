#include "logger/log/run_facts.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <nlohmann/json.hpp>
#include <set>

#include "logger/log/text_lines.h"

namespace morphbus {

// What stands in JSON as it is called here. A ledger is that of its process.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(health_t, received, sent, lost, discarded, duplicates, resent,
                                   asked, bad, queue_overflows, missed_deadlines, forged_commands,
                                   replayed_commands, late_commands, malformed_commands, doubled,
                                   delayed, corrupted, restarts, conflicts, outside_window,
                                   false_ends, foreign, fragments, hasty_requests, refused_filters,
                                   first_refused)

namespace logger {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DescribedRun, robot, model_file, program_file, mode, root_module,
                                   build, started, world_hash, arithmetic, still, loss, seed,
                                   random_seed, faults_file, fault_rules, root_sensor, root_noise_m,
                                   root_noise_rad)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ChannelFacts, messages, events, bytes, lost, duplicates, bad,
                                   hashed)

namespace {

/// So many places of damage are listed; all are counted.
constexpr size_t kMaxDamage = 1000;

/// Hertz of `count` events spread evenly over `seconds`.
double Rate(int64_t count, double seconds) {
  return count > 1 && seconds > 0 ? static_cast<double>(count - 1) / seconds : 0.0;
}

/// A time stamp of the file for people.
std::string WallTime(int64_t us) {
  const std::time_t seconds = static_cast<std::time_t>(us / 1'000'000);
  // Outside the years 1970 to 2100 the timestamp is damaged, or no wall clock at all.
  if (us < 0 || seconds > 4'102'444'800) return fmt::format("{} us", us);
  return fmt::format("{:%Y-%m-%d %H:%M:%S} UTC", fmt::gmtime(seconds));
}

/// A size for people.
std::string Bytes(int64_t bytes) {
  if (bytes < 10'000) return fmt::format("{} B", bytes);
  if (bytes < 10'000'000) return fmt::format("{:.1f} kB", static_cast<double>(bytes) * 1e-3);
  return fmt::format("{:.1f} MB", static_cast<double>(bytes) * 1e-6);
}

/// What the log is of: file, times, run, robot and program.
std::string Heading(const LogFacts& f) {
  std::string text;
  // The file: its size, and when it was written by the wall clock.
  const std::string size = Bytes(static_cast<int64_t>(f.file_bytes));
  AddLine(&text, "{}: {}, {}", f.path,
          f.compressed
              ? fmt::format("{} compressed from {}", size, Bytes(static_cast<int64_t>(f.log_bytes)))
              : size,
          Counted(f.events, "event"));
  if (f.events > 0) {
    AddLine(&text, "recorded {} to {} ({:.3f} s of wall time)", WallTime(f.first_us),
            WallTime(f.last_us), Seconds(f.last_us - f.first_us));
  }
  // The run: how long it was by sim time, and which others the file also holds.
  AddLine(&text, "run {}, {} of {:.1f} ms, {:.3f} s of sim time", f.run, Counted(f.ticks, "tick"),
          f.tick_us * 1e-3, f.seconds);
  for (const std::string& other : f.other_runs) {
    AddLine(&text, "the file also holds messages of run {}", other);
  }
  // What the description says; without one nobody knows the robot.
  if (f.has_description) {
    AddLine(&text, "robot {} of {}, program {}, {}, root {}", f.robot, f.model_file, f.program_file,
            f.mode.empty() ? "of unknown mode"
            : f.still      ? f.mode + " without physics"
                           : f.mode,
            f.root_module);
    AddLine(&text, "model {:016x}, program {:016x}, world {}, build {}", f.model_hash,
            f.program_hash, f.world_hash.empty() ? "-" : f.world_hash, f.build);
    AddLine(&text, "arithmetic {}", f.arithmetic.empty() ? "not known" : f.arithmetic);
    if (f.loss > 0) AddLine(&text, "loss {} on purpose, seed {}", f.loss, f.seed);
    if (f.root_sensor) {
      AddLine(&text, "the root measured its pose, with noise of {} m and {} rad", f.root_noise_m,
              f.root_noise_rad);
    }
    if (!f.fault_rules.empty()) {
      AddLine(&text, "faults of the bus on purpose by {}, seed {}", f.faults_file, f.seed);
    }
  }
  return text;
}

/// One line a channel.
std::string ChannelTable(const LogFacts& f) {
  // Bandwidth is by wall time, since it tells what the network carried; rates are by sim time.
  const double wall = Seconds(f.last_us - f.first_us);
  std::string text = "\n";
  AddLine(&text, "  {:<40} {:>9} {:>9} {:>11} {:>9} {:>6} {:>6} {:>5}", "channel", "messages",
          "Hz (sim)", "bandwidth", "size", "lost", "again", "bad");
  for (const auto& [name, c] : f.channels) {
    // A channel whose content is not what END lists is marked at the end of its line.
    const double sim_hz = Rate(c.messages, c.sim_seconds);
    AddLine(&text, "  {:<40} {:>9} {:>9} {:>9}/s {:>9} {:>6} {:>6} {:>5}{}", name, c.messages,
            sim_hz > 0 ? fmt::format("{:.2f}", sim_hz) : "-",
            Bytes(wall > 0 ? static_cast<int64_t>(static_cast<double>(c.bytes) / wall) : 0),
            Bytes(c.bytes), c.lost, c.duplicates, c.bad,
            c.matches_end.value_or(true) ? "" : "  not as END says");
  }
  return text;
}

/// In what state END is, and what it says.
std::string EndText(const LogFacts& f) {
  // The state says first whether END can be trusted at all; only then it is quoted.
  static constexpr const char* kUntrusted[] = {
      "no END: the log was cut", "the END event is unreadable", "END contradicts the content"};
  if (f.end_state != EndState::kVerified) return kUntrusted[static_cast<int>(f.end_state)];
  return fmt::format("END verified, {}{}{}", f.end->clean ? "clean" : "not clean",
                     f.end->reason.empty() ? "" : ": ", f.end->reason);
}

/// Commands that a process refused.
int64_t RefusedCommands(const morphbus::health_t& h) {
  return h.forged_commands + h.replayed_commands + h.late_commands + h.malformed_commands;
}

/// One of the `channels` of `info --json`.
nlohmann::json ChannelJson(const LogFacts& f, const ChannelFacts& c) {
  const double wall = Seconds(f.last_us - f.first_us);
  // Counts first, then rates in hertz, by sim time and by wall time, and sizes in bytes.
  nlohmann::json json = c;
  json["rate_hz"] = Rate(c.messages, c.sim_seconds);
  json["wall_rate_hz"] = Rate(c.events, Seconds(c.last_us - c.first_us));
  json["bytes_per_second"] = wall > 0 ? static_cast<double>(c.bytes) / wall : 0.0;
  json["of_run"] = c.ours;
  // Keys that mean nothing for the channel are left out; `matches_end` is null where END says
  // nothing.
  if (c.lost > 0) json["first_lost"] = c.first_lost;
  if (c.hashed) json["hash"] = fmt::format("{:016x}", c.hash);
  json["matches_end"] = c.matches_end ? nlohmann::json(*c.matches_end) : nlohmann::json(nullptr);
  return json;
}

/// One of the `deployments` of `info --json`; null stands for what did not happen.
nlohmann::json DeploymentJson(const DeploymentFact& d) {
  nlohmann::json switched = nlohmann::json::object();
  for (const auto& [module, tick] : d.switched) {
    switched[module] = tick ? nlohmann::json(*tick) : nlohmann::json(nullptr);
  }
  return {
      {"tick", d.tick},
      {"program", d.program},
      {"program_hash", Hex(d.program_hash)},
      {"to", d.to.empty() ? nlohmann::json(nullptr) : nlohmann::json(d.to)},
      {"switch_tick", d.switch_tick < 0 ? nlohmann::json(nullptr) : nlohmann::json(d.switch_tick)},
      {"switched", std::move(switched)},
      {"max_tilt_rad", d.max_tilt_rad ? nlohmann::json(*d.max_tilt_rad) : nlohmann::json(nullptr)}};
}

}  // namespace

bool LogFacts::whole() const {
  // Losses and damage are told apart, and either makes a log not whole.
  return num_damage == 0 && lost() == 0 && end_state == EndState::kVerified;
}

int64_t LogFacts::lost() const {
  int64_t sum = 0;
  for (const auto& [name, channel] : channels) {
    // Numbers of damaged messages can claim gaps whose sum fits no integer.
    sum += std::min(channel.lost, std::numeric_limits<int64_t>::max() - sum);
  }
  return sum;
}

void LogFacts::AddDamage(std::string what, uint64_t offset, int64_t time_us) {
  ++num_damage;
  if (damage.size() < kMaxDamage) damage.push_back({std::move(what), offset, time_us});
}

void LogFacts::VerifyEnd(bool end_seen) {
  if (!end) {
    end_state = end_seen ? EndState::kUnreadable : EndState::kMissing;
    return;
  }
  // END's run hash covers all hashed channels; each listed one must have the same count and hash.
  bool right = end->run_hash == run_hash && end->run == run;
  std::set<std::string> listed;
  for (const morphbus::channel_total_t& total : end->channels) {
    listed.insert(total.channel);
    const auto found = channels.find(total.channel);
    const bool matches = found != channels.end() && found->second.messages == total.count &&
                         found->second.hash == static_cast<uint64_t>(total.chained_hash);
    if (found != channels.end()) found->second.matches_end = matches;
    right = right && (matches || (total.count == 0 && found == channels.end()));
  }
  // A hashed channel that END does not list was added afterwards.
  for (auto& [key, channel] : channels) {
    if (!channel.hashed || listed.contains(key)) continue;
    channel.matches_end = false;
    right = false;
  }
  end_state = right ? EndState::kVerified : EndState::kMismatch;
}

const char* EndStateName(EndState state) {
  static constexpr const char* kNames[] = {"missing", "unreadable", "mismatch", "verified"};
  return kNames[static_cast<int>(state)];
}

std::string FactsText(const LogFacts& f) {
  // What the log is of, the state of END, and a table of the channels.
  std::string text = Heading(f);
  AddLine(&text, "{}; run hash {}", EndText(f), f.run_hash);
  text += ChannelTable(f);
  // The last ledger of each process tells what the network did during the run.
  if (!f.health.empty()) {
    text += "\n";
    for (const auto& [process, h] : f.health) {
      AddLine(&text,
              "  {}: received {}, lost {}, duplicates {}, asked {}, resent {}, "
              "discarded {}, bad {}, overflows {}, missed deadlines {}",
              process, h.received, h.lost, h.duplicates, h.asked, h.resent, h.discarded, h.bad,
              h.queue_overflows, h.missed_deadlines);
      if (h.doubled + h.delayed + h.corrupted > 0) {
        AddLine(&text, "  {}: on purpose: {} doubled, {} delayed, {} corrupted", process, h.doubled,
                h.delayed, h.corrupted);
      }
      if (h.restarts > 0) {
        AddLine(&text, "  {}: died and was started again: {}", process,
                Counted(h.restarts, "time"));
      }
      // Where nobody else is on the bus, there is nothing to refuse.
      if (RefusedMessages(h) > 0) AddLine(&text, "  {}: refused {}", process, RefusedText(h));
      if (h.refused_filters > 0) AddLine(&text, "  {}: {}", process, RefusedFiltersText(h));
      // Only the sim takes commands.
      if (RefusedCommands(h) == 0) continue;
      AddLine(&text, "  {}: refused commands: {} forged, {} replayed, {} late, {} malformed",
              process, h.forged_commands, h.replayed_commands, h.late_commands,
              h.malformed_commands);
    }
  }
  // Only in real time does anybody come too late.
  if (!f.lateness.empty()) text += "\n";
  for (const auto& [module, l] : f.lateness) {
    AddLine(&text, "  {}: {} missed; {} came late, {:.1f} ms at most", module,
            Counted(l.missed, "deadline"), Counted(l.late, "answer"),
            static_cast<double>(l.worst_us) * 1e-3);
  }
  if (!f.lost_modules.empty()) text += "\n";
  for (const auto& [module, time_us] : f.lost_modules) {
    AddLine(&text, "  {} was lost at {:.3f} s: the run went on without it", module,
            Seconds(time_us));
  }
  if (!f.commands.empty()) {
    text += "\n";
    AddLine(&text, "{} while it ran (tick, command):",
            Counted(static_cast<int64_t>(f.commands.size()), "command"));
    text += CommandsText(f);
  }
  if (!f.deployments.empty()) text += "\n" + DeploymentsText(f.deployments, f.tick_us);
  if (f.num_dockings > 0) text += "\n" + DockingsText(f.dockings, f.num_dockings);
  // Faults are the program's, and say nothing against the log.
  if (f.num_faults > 0) {
    text += "\n";
    AddLine(&text, "{} of the program:", Counted(f.num_faults, "fault"));
  }
  for (const FaultFact& fault : f.faults) {
    AddLine(&text, "  {:.3f} s {} ({}): {}", Seconds(fault.time_us), fault.module,
            fault.role.empty() ? "no role" : fault.role, fault.Line());
  }
  if (f.num_prints > 0) {
    text += "\n";
    AddLine(&text, "{} printed:", Counted(f.num_prints, "line"));
  }
  for (const PrintFact& print : f.prints) {
    AddLine(&text, "  {:.3f} s {} ({}): {}", Seconds(print.time_us), print.module,
            print.role.empty() ? "no role" : print.role, print.Line());
  }
  // What is wrong with the log itself comes last, where it is seen.
  if (f.num_damage > 0 || f.lost() > 0 || !f.problems.empty()) text += "\n" + VerifyText(f);
  return text;
}

int64_t RefusedMessages(const morphbus::health_t& h) {
  return h.conflicts + h.outside_window + h.false_ends + h.foreign + h.fragments;
}

std::string RefusedText(const morphbus::health_t& h) {
  std::string text;
  const auto add = [&text](int64_t count, const char* what) {
    if (count > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, what);
  };
  add(h.conflicts, "that contradict others of the same number");
  add(h.outside_window, "of a tick that cannot be");
  add(h.false_ends, "of an end that is none");
  add(h.foreign, "on channels that the run does not have");
  add(h.fragments, "fragments");
  // Names in it came from the bus.
  return text + (h.first_refused.empty() ? "" : "; first: " + EscapeControl(h.first_refused));
}

std::string RefusedFiltersText(const morphbus::health_t& h) {
  return fmt::format("{} refused by the kernel, so that all messages wake it: morphbus doctor",
                     Counted(h.refused_filters, "filter"));
}

std::string CommandsText(const LogFacts& f) {
  std::string text;
  for (const auto& [tick, command] : f.commands) AddLine(&text, "  {} {}", tick, command);
  return text;
}

std::string VerifyText(const LogFacts& f) {
  std::string text;
  // Places of damage first, then what each channel lacks, then the verdict.
  for (const LogDamage& damage : f.damage) {
    AddLine(&text, "{}: after {:.3f} s: {}", f.path, Seconds(damage.time_us), damage.what);
  }
  // The list is bounded; the rest is only counted.
  const int64_t unlisted = f.num_damage - static_cast<int64_t>(f.damage.size());
  if (unlisted > 0) AddLine(&text, "{}: {}", f.path, Counted(unlisted, "more place"));
  for (const auto& [name, channel] : f.channels) {
    if (channel.lost > 0) {
      AddLine(&text, "{}: {} lost {}, number {} first", f.path, name,
              Counted(channel.lost, "message"), channel.first_lost);
    }
    if (!channel.matches_end.value_or(true)) {
      AddLine(&text, "{}: {} is not what END says", f.path, name);
    }
  }
  for (const std::string& problem : f.problems) AddLine(&text, "{}: {}", f.path, problem);
  AddLine(&text, "{}: {}; {}", f.path, f.whole() ? "whole" : "NOT whole", EndText(f));
  return text;
}

nlohmann::json LatenessJson(const LogFacts& f) {
  nlohmann::json json = nlohmann::json::object();
  for (const auto& [module, l] : f.lateness) {
    json[module] = {{"missed", l.missed}, {"late", l.late}, {"worst_us", l.worst_us}};
  }
  return json;
}

nlohmann::json FindingJson(const LogFinding& finding) {
  // Scripts may rely on these words, which stand in the order of the enumeration.
  static constexpr const char* kKinds[] = {"damaged", "truncated", "payload",   "number",
                                           "missing", "restart",   "clock_step"};
  return {{"kind", kKinds[static_cast<int>(finding.kind)]},
          {"begin", finding.begin},
          {"end", finding.end},
          {"what", finding.what}};
}

nlohmann::json PrintsJson(const LogFacts& f) {
  nlohmann::json prints = nlohmann::json::array();
  for (const PrintFact& print : f.prints) {
    prints.push_back({{"time", Seconds(print.time_us)},
                      {"module", print.module},
                      {"role", print.role},
                      {"text", print.text},
                      {"line", print.print.line}});
  }
  return prints;
}

nlohmann::json FactsJson(const LogFacts& f) {
  // Each channel becomes an entry under its name.
  nlohmann::json channels = nlohmann::json::object();
  for (const auto& [name, channel] : f.channels) channels[name] = ChannelJson(f, channel);
  // The faults of the program, by sim time in seconds.
  nlohmann::json faults = nlohmann::json::array();
  for (const FaultFact& fault : f.faults) {
    faults.push_back({{"time", Seconds(fault.time_us)},
                      {"module", fault.module},
                      {"role", fault.role},
                      {"code", static_cast<int>(fault.fault.code)},
                      {"text", fault.text},
                      {"function", fault.function},
                      {"line", fault.fault.line}});
  }
  // Damage has the sim time up to which the log was whole, findings have ranges of bytes.
  nlohmann::json damage = nlohmann::json::array();
  for (const LogDamage& d : f.damage) {
    damage.push_back({{"what", d.what}, {"offset", d.offset}, {"time", Seconds(d.time_us)}});
  }
  nlohmann::json findings = nlohmann::json::array();
  for (const LogFinding& finding : f.findings) findings.push_back(FindingJson(finding));
  nlohmann::json commands = nlohmann::json::array();
  for (const auto& [tick, command] : f.commands) {
    commands.push_back({{"tick", tick}, {"command", command}});
  }
  nlohmann::json deployments = nlohmann::json::array();
  for (const DeploymentFact& d : f.deployments) deployments.push_back(DeploymentJson(d));
  nlohmann::json dockings = nlohmann::json::array();
  for (const DockingFact& d : f.dockings) {
    dockings.push_back({{"time", Seconds(d.time_us)},
                        {"docked", d.docked},
                        {"connector", d.connector},
                        {"mate", d.mate}});
  }
  // From which sim time on in seconds the run went on without a module.
  nlohmann::json lost_modules = nlohmann::json::object();
  for (const auto& [module, time_us] : f.lost_modules) lost_modules[module] = Seconds(time_us);
  // What is always there.
  nlohmann::json json = {{"path", f.path},
                         {"bytes", f.file_bytes},
                         {"compressed", f.compressed},
                         {"log_bytes", f.log_bytes},
                         {"events", f.events},
                         {"run", f.run},
                         {"other_runs", f.other_runs},
                         {"ticks", f.ticks},
                         {"tick_us", f.tick_us},
                         {"seconds", f.seconds},
                         {"wall_seconds", Seconds(f.last_us - f.first_us)},
                         {"hash", f.run_hash},
                         {"end", EndStateName(f.end_state)},
                         {"whole", f.whole()},
                         {"lost", f.lost()},
                         {"channels", std::move(channels)},
                         {"commands", std::move(commands)},
                         {"deployments", std::move(deployments)},
                         {"dockings", std::move(dockings)},
                         {"num_dockings", f.num_dockings},
                         {"lost_modules", std::move(lost_modules)},
                         {"faults", std::move(faults)},
                         {"num_faults", f.num_faults},
                         {"prints", PrintsJson(f)},
                         {"num_prints", f.num_prints},
                         {"damage", std::move(damage)},
                         {"num_damage", f.num_damage},
                         {"findings", std::move(findings)},
                         {"health", f.health},
                         {"lateness", LatenessJson(f)},
                         {"problems", f.problems}};
  // What END says is null without one, and the description is left out.
  json["clean"] = f.end ? nlohmann::json(f.end->clean != 0) : nlohmann::json(nullptr);
  json["reason"] = f.end ? nlohmann::json(f.end->reason) : nlohmann::json(nullptr);
  if (f.has_description) {
    json["description"] = static_cast<const DescribedRun&>(f);
    json["description"]["model_hash"] = fmt::format("{:016x}", f.model_hash);
    json["description"]["program_hash"] = fmt::format("{:016x}", f.program_hash);
  }
  return json;
}

}  // namespace logger
}  // namespace morphbus
