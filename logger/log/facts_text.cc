#include "logger/log/facts_text.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <map>
#include <utility>
#include <vector>

#include "bridge/observe/ledger_counts.h"
#include "bridge/wire/channels.h"
#include "logger/log/text_lines.h"

namespace morphbus::logger {
namespace {

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
    AddLine(&text, "robot {} of {}, program {}, {}, root {}", f.robot_name, f.model_file,
            f.program_file,
            f.mode.empty() ? "of unknown mode"
            : f.still      ? f.mode + " without physics"
                           : f.mode,
            f.root_module);
    AddLine(&text, "model {:016x}, program {:016x}, world {}, build {}", f.model_hash,
            f.program_hash, f.world_hash.empty() ? "-" : f.world_hash, f.build);
    AddLine(&text, "arithmetic {}", f.arithmetic.empty() ? "not known" : f.arithmetic);
    if (!f.parameters.empty()) {
      AddLine(&text, "parameters {}", dynarole::ParametersText(f.parameters));
    }
    if (!f.attributes.empty())
      AddLine(&text, "of the model was set {}", fmt::join(f.attributes, ", "));
    // What was unusual about the run, and may explain what the log shows.
    if (f.open)
      AddLine(&text, "open: without a key, so that whoever reached its bus could speak in it");
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

/// Adds what a channel carried to the sums of several; the least that is known of END counts.
void AddChannel(const ChannelFacts& c, ChannelFacts* sum) {
  sum->messages += c.messages;
  sum->bytes += c.bytes;
  sum->lost += c.lost;
  sum->duplicates += c.duplicates;
  sum->bad += c.bad;
  sum->sim_seconds = std::max(sum->sim_seconds, c.sim_seconds);
  if (!c.matches_end.value_or(true)) sum->matches_end = false;
}

/// A row of the table: one channel, or the channels of all modules with one topic.
struct ChannelRow {
  std::string name;
  ChannelFacts facts;
  int channels = 0;
};

/// The rows: a channel each if `all`, else modules' channels together, by topic, where they are
/// more than three.
std::vector<ChannelRow> ChannelRows(const LogFacts& f, bool all) {
  const auto group = [&](const std::string& name) -> std::string {
    const auto parts = bridge::ParseChannel(name);
    const bool of_module = parts && parts->run == f.run && bridge::CheckModuleName(parts->process);
    return of_module ? fmt::format("{}/*/{}", f.run, bridge::TopicName(parts->topic)) : "";
  };
  std::map<std::string, int> sizes;
  for (const auto& [name, c] : f.channels) ++sizes[group(name)];
  std::vector<ChannelRow> rows;
  std::map<std::string, size_t> row_of;
  for (const auto& [name, c] : f.channels) {
    const std::string of = group(name);
    const bool together = !all && !of.empty() && sizes[of] > 3;
    const std::string title = together ? fmt::format("{} ({})", of, sizes[of]) : name;
    const auto [at, fresh] = row_of.try_emplace(title, rows.size());
    if (fresh) rows.push_back({title, {}, 0});
    AddChannel(c, &rows[at->second].facts);
    ++rows[at->second].channels;
  }
  return rows;
}

/// One line a channel, or a topic of all modules (ChannelRows); rates are those of one channel.
std::string ChannelTable(const LogFacts& f, bool all) {
  // Bandwidth is by wall time, since it tells what the network carried; rates are by sim time.
  const double wall = Seconds(f.last_us - f.first_us);
  std::string text = "\n";
  AddLine(&text, "  {:<40} {:>9} {:>9} {:>11} {:>9} {:>6} {:>6} {:>5}", "channel", "messages",
          "Hz (sim)", "bandwidth", "size", "lost", "again", "bad");
  for (const ChannelRow& row : ChannelRows(f, all)) {
    // A channel whose content is not what END lists is marked at the end of its line.
    const ChannelFacts& c = row.facts;
    const double sim_hz = EventRate(c.messages / row.channels, c.sim_seconds);
    AddLine(&text, "  {:<40} {:>9} {:>9} {:>9}/s {:>9} {:>6} {:>6} {:>5}{}", row.name, c.messages,
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
  return fmt::format("END verified, {}{}{}{}", f.end->clean ? "clean" : "not clean",
                     f.end->open ? ", of an open run" : "", f.end->reason.empty() ? "" : ": ",
                     f.end->reason);
}

/// Commands that a process refused.
int64_t RefusedCommands(const morphbus::health_t& h) {
  return h.old_commands + h.malformed_commands;
}

/// What a process received and lost, by its ledger.
std::string LedgerLine(const std::string& process, const morphbus::health_t& h) {
  return fmt::format(
      "  {}: received {}, lost {}, duplicates {}, asked {}, resent {}, discarded {}, bad {}, "
      "overflows {}, "
      "missed deadlines {}",
      process, h.received, h.lost, h.duplicates, h.asked, h.resent, h.discarded, h.bad,
      h.queue_overflows, h.missed_deadlines);
}

/// What is not so in most runs: faults on purpose, deaths, refusals; a line each.
std::vector<std::string> RemarkableLines(const std::string& process, const morphbus::health_t& h) {
  std::vector<std::string> lines;
  if (h.doubled + h.delayed + h.corrupted > 0) {
    lines.push_back(fmt::format("  {}: on purpose: {} doubled, {} delayed, {} corrupted", process,
                                h.doubled, h.delayed, h.corrupted));
  }
  if (h.restarts > 0) {
    lines.push_back(
        fmt::format("  {}: died and was started again: {}", process, Counted(h.restarts, "time")));
  }
  // Where nobody else is on the bus, there is nothing to refuse.
  if (RefusedMessages(h) > 0)
    lines.push_back(fmt::format("  {}: refused {}", process, RefusedText(h)));
  if (h.refused_filters > 0)
    lines.push_back(fmt::format("  {}: {}", process, RefusedFiltersText(h)));
  // Only the sim takes commands.
  if (RefusedCommands(h) > 0) {
    lines.push_back(fmt::format("  {}: refused commands: {} old, {} malformed", process,
                                h.old_commands, h.malformed_commands));
  }
  return lines;
}

/// The last ledgers of all processes together.
morphbus::health_t SumOfLedgers(const LogFacts& f) {
  morphbus::health_t sum{};
  for (const auto& [process, h] : f.health) {
    for (const bridge::LedgerCount& count : bridge::kLedgerCounts) {
      sum.*count.value += h.*count.value;
    }
  }
  return sum;
}

/// What the network did during the run: a line a process if `all`, else their sums, and what was
/// remarkable.
std::vector<std::string> LedgerLines(const LogFacts& f, bool all) {
  std::vector<std::string> lines;
  if (!all && f.health.size() > 3) {
    lines.push_back(LedgerLine(fmt::format("{} processes", f.health.size()), SumOfLedgers(f)));
  }
  for (const auto& [process, h] : f.health) {
    if (all || f.health.size() <= 3) lines.push_back(LedgerLine(process, h));
    const std::vector<std::string> more = RemarkableLines(process, h);
    lines.insert(lines.end(), more.begin(), more.end());
  }
  return lines;
}

/// The first lines of a list, and how many more there are; all if `all`. Nothing for an empty list.
std::string Listed(const std::vector<std::string>& lines, bool all) {
  // A summary fits a screen.
  constexpr size_t kMostListed = 10;
  std::string text;
  const size_t shown = all ? lines.size() : std::min(lines.size(), kMostListed);
  for (size_t i = 0; i < shown; ++i) AddLine(&text, "{}", lines[i]);
  if (shown < lines.size()) AddLine(&text, "  and {} more (--all)", lines.size() - shown);
  return text;
}

}  // namespace

std::string FactsText(const LogFacts& f, bool all) {
  // What the log is of, the state of END, and a table of the channels.
  std::string text = Heading(f);
  AddLine(&text, "{}; run hash {}", EndText(f), f.run_hash);
  text += ChannelTable(f, all);
  // Each list that follows stands under an empty line, if there is anything in it.
  const auto add = [&text, all](const std::string& title, const std::vector<std::string>& lines) {
    if (lines.empty()) return;
    text += "\n";
    if (!title.empty()) AddLine(&text, "{}", title);
    text += Listed(lines, all);
  };
  add("", LedgerLines(f, all));
  // Only in real time does anybody come too late.
  std::vector<std::string> lines;
  for (const auto& [module, l] : f.lateness) {
    lines.push_back(fmt::format("  {}: {} missed; {} came late, {:.1f} ms at most", module,
                                Counted(l.missed, "deadline"), Counted(l.late, "answer"),
                                static_cast<double>(l.worst_us) * 1e-3));
  }
  add("", std::exchange(lines, {}));
  for (const auto& [module, time_us] : f.lost_modules) {
    lines.push_back(fmt::format("  {} was lost at {:.3f} s: the run went on without it", module,
                                Seconds(time_us)));
  }
  add("", std::exchange(lines, {}));
  for (const auto& [tick, command] : f.commands)
    lines.push_back(fmt::format("  {} {}", tick, command));
  add(fmt::format("{} while it ran (tick, command):",
                  Counted(static_cast<int64_t>(f.commands.size()), "command")),
      std::exchange(lines, {}));
  if (!f.deployments.empty()) text += "\n" + DeploymentsText(f.deployments, f.tick_us);
  if (f.num_dockings > 0) text += "\n" + DockingsText(f.dockings, f.num_dockings);
  // Faults are the program's, and say nothing against the log.
  for (const FaultFact& fault : f.faults) {
    lines.push_back(fmt::format("  {:.3f} s {} ({}): {}", Seconds(fault.time_us), fault.module,
                                fault.role.empty() ? "no role" : fault.role, fault.Line()));
  }
  add(Counted(f.num_faults, "fault") + " of the program:", std::exchange(lines, {}));
  add("", EndedLines(f.ended));
  for (const PrintFact& print : f.prints) {
    lines.push_back(fmt::format("  {:.3f} s {} ({}): {}", Seconds(print.time_us), print.module,
                                print.role.empty() ? "no role" : print.role, print.Line()));
  }
  add(Counted(f.num_prints, "line") + " printed:", std::exchange(lines, {}));
  // What is wrong with the log itself comes last, where it is seen.
  if (f.num_damage > 0 || f.lost() > 0 || !f.problems.empty()) text += "\n" + VerifyText(f);
  return text;
}

int64_t RefusedMessages(const morphbus::health_t& h) {
  return h.unauthentic + h.conflicts + h.outside_window + h.fragments;
}

namespace {

/// On which channels messages came that were not authentic, most of them first heard of: " (3 on
/// m2/ACTUATOR)"; empty where there were none.
std::string ChannelsText(const morphbus::health_t& h) {
  if (h.unauthentic_channels.empty()) return "";
  std::vector<std::string> parts;
  int64_t others = h.unauthentic;
  for (const morphbus::channel_count_t& entry : h.unauthentic_channels) {
    // Their names came from the bus.
    parts.push_back(fmt::format("{} on {}", entry.count, EscapeControl(entry.channel)));
    others -= entry.count;
  }
  if (others > 0) parts.push_back(fmt::format("{} on others", others));
  return fmt::format(" ({})", fmt::join(parts, ", "));
}

}  // namespace

std::string RefusedText(const morphbus::health_t& h) {
  std::string text;
  const auto add = [&text](int64_t count, const std::string& what) {
    if (count > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, what);
  };
  add(h.unauthentic, "not authentic" + ChannelsText(h));
  add(h.conflicts, "that contradict others of the same number");
  add(h.outside_window, "of a tick that cannot be");
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

}  // namespace morphbus::logger
