#include "logger/log/run_facts.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "bridge/observe/ledger_counts.h"
#include "logger/log/text_lines.h"

namespace morphbus::bridge {
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DescribedRun, model_file, program_file, mode, root_module, build,
                                   started, world_hash, arithmetic, still, loss, seed, random_seed,
                                   noise_seed, open, faults_file, fault_rules, attributes,
                                   root_sensor, root_noise_m, root_noise_rad)
}  // namespace morphbus::bridge

namespace morphbus::logger {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ChannelFacts, messages, events, bytes, lost, duplicates, bad,
                                   hashed)

namespace {

/// So many places of damage are listed; all are counted.
constexpr size_t kMaxDamage = 1000;

/// One of the `channels` of `info --json`.
nlohmann::json ChannelJson(const LogFacts& f, const ChannelFacts& c) {
  const double wall = Seconds(f.last_us - f.first_us);
  // Counts first, then rates in hertz, by sim time and by wall time, and sizes in bytes.
  nlohmann::json json = c;
  json["rate_hz"] = EventRate(c.messages, c.sim_seconds);
  json["wall_rate_hz"] = EventRate(c.events, Seconds(c.last_us - c.first_us));
  json["bytes_per_second"] = wall > 0 ? static_cast<double>(c.bytes) / wall : 0.0;
  json["of_run"] = c.ours;
  // Keys that mean nothing for the channel are left out; `matches_end` is null where END says
  // nothing.
  if (c.lost > 0) json["first_lost"] = c.first_lost;
  if (c.hashed) json["hash"] = Hex(c.hash);
  json["matches_end"] = c.matches_end ? nlohmann::json(*c.matches_end) : nlohmann::json(nullptr);
  return json;
}

/// The `parameters` of `info --json`: by name, with the range that the source allows.
nlohmann::json ParametersJson(const LogFacts& f) {
  nlohmann::json parameters = nlohmann::json::object();
  for (const dynarole::ProgramParameter& p : f.parameters) {
    // Numbers as people wrote them: a float of single precision has the digits of its text.
    const auto number = [&p](double value) { return nlohmann::json::parse(p.Text(value)); };
    parameters[p.name] = {{"value", number(p.value)},
                          {"source", number(p.source_value)},
                          {"least", number(p.least)},
                          {"most", number(p.most)}};
  }
  return parameters;
}

/// One of the `deployments` of `info --json`; null stands for what did not happen.
nlohmann::json DeploymentJson(const DeploymentFact& d) {
  // A module that never went over to the program is there with null.
  nlohmann::json switched = nlohmann::json::object();
  for (const auto& [module, tick] : d.switched) {
    switched[module] = tick ? nlohmann::json(*tick) : nlohmann::json(nullptr);
  }
  return {
      {"tick", d.tick},
      {"program", d.program.empty() ? nlohmann::json(nullptr) : nlohmann::json(d.program)},
      {"parameter", d.parameter.empty() ? nlohmann::json(nullptr) : nlohmann::json(d.parameter)},
      {"value", d.value.empty() ? nlohmann::json(nullptr) : nlohmann::json(d.value)},
      {"program_hash", Hex(d.program_hash)},
      {"to", d.to.empty() ? nlohmann::json(nullptr) : nlohmann::json(d.to)},
      {"switch_tick", d.switch_tick < 0 ? nlohmann::json(nullptr) : nlohmann::json(d.switch_tick)},
      {"switched", std::move(switched)},
      {"max_tilt_rad", d.max_tilt_rad ? nlohmann::json(*d.max_tilt_rad) : nlohmann::json(nullptr)}};
}

}  // namespace

double EventRate(int64_t count, double seconds) {
  return count > 1 && seconds > 0 ? static_cast<double>(count - 1) / seconds : 0.0;
}

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
  // Without END the log vouches for nothing, and there is nothing to compare.
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
    // A channel on which nothing was said is listed, too, and has no event in the log.
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

nlohmann::json HealthJson(const LogFacts& f) {
  nlohmann::json processes = nlohmann::json::object();
  for (const auto& [process, health] : f.health) {
    nlohmann::json& ledger = processes[process];
    // One table names the counts for text, JSON and viewers.
    for (const bridge::LedgerCount& count : bridge::kLedgerCounts) {
      ledger[count.name] = health.*count.value;
    }
    ledger["first_refused"] = health.first_refused;
  }
  return processes;
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
                      {"file", print.file},
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
                      {"ended", EndedKind(fault)},
                      {"function", fault.function},
                      {"file", fault.file},
                      {"line", fault.fault.line}});
  }
  // Damage has the sim time up to which the log was whole, findings have ranges of bytes.
  nlohmann::json damage = nlohmann::json::array();
  for (const LogDamage& d : f.damage) {
    damage.push_back({{"what", d.what}, {"offset", d.offset}, {"time", Seconds(d.time_us)}});
  }
  nlohmann::json findings = nlohmann::json::array();
  for (const LogFinding& finding : f.findings) findings.push_back(FindingJson(finding));
  // What people did to the run, and what the robot's connectors did, in the order of time.
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
                         {"ended_tasks", EndedJson(f.ended)},
                         {"prints", PrintsJson(f)},
                         {"num_prints", f.num_prints},
                         {"damage", std::move(damage)},
                         {"num_damage", f.num_damage},
                         {"findings", std::move(findings)},
                         {"health", HealthJson(f)},
                         {"lateness", LatenessJson(f)},
                         {"problems", f.problems}};
  // What END says is null without one, and the description is left out.
  json["clean"] = f.end ? nlohmann::json(f.end->clean != 0) : nlohmann::json(nullptr);
  json["reason"] = f.end ? nlohmann::json(f.end->reason) : nlohmann::json(nullptr);
  if (f.has_description) {
    json["description"] = static_cast<const bridge::DescribedRun&>(f);
    json["description"]["parameters"] = ParametersJson(f);
    json["description"]["robot"] = f.robot_name;
    json["description"]["model_hash"] = Hex(f.model_hash);
    json["description"]["program_hash"] = Hex(f.program_hash);
  }
  return json;
}

}  // namespace morphbus::logger
