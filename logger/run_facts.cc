#include "logger/run_facts.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <nlohmann/json.hpp>

namespace morphbus::logger {
namespace {

constexpr size_t kMaxDamage = 1000;

double Seconds(int64_t us) { return static_cast<double>(us) * 1e-6; }

/// Hertz of `count` events spread evenly over `seconds`.
double Rate(int64_t count, double seconds) {
  return count > 1 && seconds > 0 ? static_cast<double>(count - 1) / seconds : 0.0;
}

std::string WallTime(int64_t us) {
  const std::time_t seconds = static_cast<std::time_t>(us / 1'000'000);
  // Outside these years the timestamp is damaged, or no wall clock at all.
  if (us < 0 || seconds > 4'102'444'800) return fmt::format("{} us", us);
  return fmt::format("{:%Y-%m-%d %H:%M:%S} UTC", fmt::gmtime(seconds));
}

std::string Bytes(int64_t bytes) {
  if (bytes < 10'000) return fmt::format("{} B", bytes);
  if (bytes < 10'000'000) return fmt::format("{:.1f} kB", static_cast<double>(bytes) * 1e-3);
  return fmt::format("{:.1f} MB", static_cast<double>(bytes) * 1e-6);
}

const char* FindingKind(LogFinding::Kind kind) {
  switch (kind) {
    case LogFinding::Kind::kDamaged:
      return "damaged";
    case LogFinding::Kind::kTruncated:
      return "truncated";
    case LogFinding::Kind::kNumber:
      return "number";
    case LogFinding::Kind::kMissing:
      return "missing";
    case LogFinding::Kind::kRestart:
      return "restart";
    case LogFinding::Kind::kClockStep:
      return "clock_step";
  }
  return "damaged";
}

std::string Heading(const LogFacts& f) {
  std::string text = fmt::format("{}: {}, {} events\n", f.path,
                                 Bytes(static_cast<int64_t>(f.file_bytes)), f.events);
  if (f.events > 0) {
    text += fmt::format("recorded {} to {} ({:.3f} s of wall time)\n", WallTime(f.first_us),
                        WallTime(f.last_us), Seconds(f.last_us - f.first_us));
  }
  text += fmt::format("run {}, {} ticks of {:.1f} ms, {:.3f} s of sim time\n", f.run, f.ticks,
                      f.tick_us * 1e-3, f.seconds);
  for (const std::string& other : f.other_runs) {
    text += fmt::format("the file also holds messages of run {}\n", other);
  }
  if (f.has_description) {
    text += fmt::format("robot {} of {}, program {}, {}, root {}\n", f.robot, f.model_file,
                        f.program_file, f.mode, f.root_module);
    text += fmt::format("model {:016x}, program {:016x}, world {}, build {}\n", f.model_hash,
                        f.program_hash, f.world_hash.empty() ? "-" : f.world_hash, f.build);
    if (f.loss > 0) text += fmt::format("loss {} on purpose, seed {}\n", f.loss, f.seed);
  }
  return text;
}

std::string ChannelTable(const LogFacts& f) {
  const double wall = Seconds(f.last_us - f.first_us);
  std::string text =
      fmt::format("\n  {:<40} {:>9} {:>9} {:>11} {:>9} {:>6} {:>6} {:>5}\n", "channel", "messages",
                  "Hz (sim)", "bandwidth", "size", "lost", "again", "bad");
  for (const auto& [name, c] : f.channels) {
    const double sim_hz = Rate(c.messages, c.sim_seconds);
    text +=
        fmt::format("  {:<40} {:>9} {:>9} {:>9}/s {:>9} {:>6} {:>6} {:>5}{}\n", name, c.messages,
                    sim_hz > 0 ? fmt::format("{:.2f}", sim_hz) : "-",
                    Bytes(wall > 0 ? static_cast<int64_t>(static_cast<double>(c.bytes) / wall) : 0),
                    Bytes(c.bytes), c.lost, c.duplicates, c.bad,
                    c.matches_end.value_or(true) ? "" : "  not as END says");
  }
  return text;
}

std::string EndText(const LogFacts& f) {
  switch (f.end_state) {
    case EndState::kMissing:
      return "no END: the log was cut";
    case EndState::kUnreadable:
      return "the END event is unreadable";
    case EndState::kMismatch:
      return "END contradicts the content";
    case EndState::kVerified:
      break;
  }
  return fmt::format("END verified, {}{}{}", f.end->clean ? "clean" : "not clean",
                     f.end->reason.empty() ? "" : ": ", f.end->reason);
}

nlohmann::json ChannelJson(const LogFacts& f, const ChannelFacts& c) {
  const double wall = Seconds(f.last_us - f.first_us);
  nlohmann::json json = {{"messages", c.messages},
                         {"events", c.events},
                         {"bytes", c.bytes},
                         {"rate_hz", Rate(c.messages, c.sim_seconds)},
                         {"wall_rate_hz", Rate(c.events, Seconds(c.last_us - c.first_us))},
                         {"bytes_per_second", wall > 0 ? static_cast<double>(c.bytes) / wall : 0.0},
                         {"lost", c.lost},
                         {"duplicates", c.duplicates},
                         {"bad", c.bad},
                         {"hashed", c.hashed},
                         {"of_run", c.ours}};
  if (c.lost > 0) json["first_lost"] = c.first_lost;
  if (c.hashed) json["hash"] = fmt::format("{:016x}", c.hash);
  json["matches_end"] = c.matches_end ? nlohmann::json(*c.matches_end) : nlohmann::json(nullptr);
  return json;
}

}  // namespace

bool LogFacts::whole() const {
  return num_damage == 0 && lost() == 0 && end_state == EndState::kVerified;
}

int64_t LogFacts::lost() const {
  int64_t sum = 0;
  for (const auto& [name, channel] : channels) sum += channel.lost;
  return sum;
}

void LogFacts::AddDamage(std::string what, uint64_t offset, int64_t time_us) {
  ++num_damage;
  if (damage.size() < kMaxDamage) damage.push_back({std::move(what), offset, time_us});
}

const char* EndStateName(EndState state) {
  switch (state) {
    case EndState::kMissing:
      return "missing";
    case EndState::kUnreadable:
      return "unreadable";
    case EndState::kMismatch:
      return "mismatch";
    case EndState::kVerified:
      return "verified";
  }
  return "missing";
}

std::string FactsText(const LogFacts& f) {
  std::string text = Heading(f);
  text += EndText(f) + "; run hash " + f.run_hash + "\n";
  text += ChannelTable(f);
  if (!f.health.empty()) {
    text += "\n";
    for (const auto& [process, h] : f.health) {
      text += fmt::format(
          "  {}: received {}, lost {}, duplicates {}, asked {}, resent {}, "
          "discarded {}, bad {}, overflows {}, missed deadlines {}\n",
          process, h.received, h.lost, h.duplicates, h.asked, h.resent, h.discarded, h.bad,
          h.queue_overflows, h.missed_deadlines);
    }
  }
  if (f.num_faults > 0) text += fmt::format("\n{} faults of the program:\n", f.num_faults);
  for (const FaultFact& fault : f.faults) {
    text += fmt::format(
        "  {:.3f} s {} ({}): {}{}\n", Seconds(fault.time_us), fault.module,
        fault.role.empty() ? "no role" : fault.role, fault.text,
        fault.function.empty() ? "" : fmt::format(" in {}, line {}", fault.function, fault.line));
  }
  if (f.num_damage + f.lost() > 0 || !f.problems.empty()) text += "\n" + VerifyText(f);
  return text;
}

std::string VerifyText(const LogFacts& f) {
  std::string text;
  for (const LogDamage& damage : f.damage) {
    text += fmt::format("{}: after {:.3f} s: {}\n", f.path, Seconds(damage.time_us), damage.what);
  }
  const int64_t unlisted = f.num_damage - static_cast<int64_t>(f.damage.size());
  if (unlisted > 0) text += fmt::format("{}: {} more places\n", f.path, unlisted);
  for (const auto& [name, channel] : f.channels) {
    if (channel.lost > 0) {
      text += fmt::format("{}: {} lost {} messages, number {} first\n", f.path, name, channel.lost,
                          channel.first_lost);
    }
    if (!channel.matches_end.value_or(true)) {
      text += fmt::format("{}: {} is not what END says\n", f.path, name);
    }
  }
  for (const std::string& problem : f.problems) text += f.path + ": " + problem + "\n";
  text += fmt::format("{}: {}; {}\n", f.path, f.whole() ? "whole" : "NOT whole", EndText(f));
  return text;
}

nlohmann::json FindingJson(const LogFinding& finding) {
  return {{"kind", FindingKind(finding.kind)},
          {"begin", finding.begin},
          {"end", finding.end},
          {"what", finding.what}};
}

nlohmann::json FactsJson(const LogFacts& f) {
  nlohmann::json channels = nlohmann::json::object();
  for (const auto& [name, channel] : f.channels) channels[name] = ChannelJson(f, channel);
  nlohmann::json faults = nlohmann::json::array();
  for (const FaultFact& fault : f.faults) {
    faults.push_back({{"time", Seconds(fault.time_us)},
                      {"module", fault.module},
                      {"role", fault.role},
                      {"code", fault.code},
                      {"text", fault.text},
                      {"function", fault.function},
                      {"line", fault.line}});
  }
  nlohmann::json damage = nlohmann::json::array();
  for (const LogDamage& d : f.damage) {
    damage.push_back({{"what", d.what}, {"offset", d.offset}, {"time", Seconds(d.time_us)}});
  }
  nlohmann::json findings = nlohmann::json::array();
  for (const LogFinding& finding : f.findings) {
    findings.push_back(FindingJson(finding));
  }
  nlohmann::json health = nlohmann::json::object();
  for (const auto& [process, h] : f.health) {
    health[process] = {{"received", h.received},
                       {"sent", h.sent},
                       {"lost", h.lost},
                       {"discarded", h.discarded},
                       {"duplicates", h.duplicates},
                       {"resent", h.resent},
                       {"asked", h.asked},
                       {"bad", h.bad},
                       {"queue_overflows", h.queue_overflows},
                       {"missed_deadlines", h.missed_deadlines}};
  }
  nlohmann::json json = {{"path", f.path},
                         {"bytes", f.file_bytes},
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
                         {"faults", std::move(faults)},
                         {"num_faults", f.num_faults},
                         {"damage", std::move(damage)},
                         {"num_damage", f.num_damage},
                         {"findings", std::move(findings)},
                         {"health", std::move(health)},
                         {"problems", f.problems}};
  json["clean"] = f.end ? nlohmann::json(f.end->clean != 0) : nlohmann::json(nullptr);
  json["reason"] = f.end ? nlohmann::json(f.end->reason) : nlohmann::json(nullptr);
  if (f.has_description) {
    json["description"] = {{"robot", f.robot},
                           {"model_file", f.model_file},
                           {"program_file", f.program_file},
                           {"mode", f.mode},
                           {"root_module", f.root_module},
                           {"build", f.build},
                           {"started", f.started},
                           {"world_hash", f.world_hash},
                           {"model_hash", fmt::format("{:016x}", f.model_hash)},
                           {"program_hash", fmt::format("{:016x}", f.program_hash)},
                           {"loss", f.loss},
                           {"seed", f.seed}};
  }
  return json;
}

}  // namespace morphbus::logger
