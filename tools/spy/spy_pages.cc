#include "tools/spy/spy_pages.h"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/wire/codec.h"
#include "compiler/base/text.h"

namespace morphbus::tools {
namespace {

/// A line "what  value", the values below each other.
ScreenLine Fact(const std::string& what, const std::string& value, Style style = Style::kPlain) {
  constexpr int kWidth = 12;
  return {{FitCells(what, kWidth) + " ", Style::kDim}, {value, style}};
}

/// A count that is bad news if there is any.
ScreenLine BadFact(const std::string& what, int64_t count) {
  return Fact(what, std::to_string(count), count > 0 ? Style::kBad : Style::kPlain);
}

/// A field's path in `width` cells below that of the line above: what both begin with, up to a
/// point or bracket, is blank. Where it is too long, its end tells more than its beginning.
std::string NameBelow(const std::string& above, const std::string& path, int width) {
  size_t common = 0;
  for (size_t i = 0; i < std::min(above.size(), path.size()) && above[i] == path[i]; ++i) {
    if (path[i] == '.' || path[i] == '[') common = i;
  }
  const int cut = std::max(0, Cells(path) - width);
  const int blank = Cells(path.substr(0, common)) - cut;
  if (blank <= 0) return FitEnd(path, width);
  return FitCells(std::string(static_cast<size_t>(blank), ' ') + path.substr(common), width);
}

/// The name of a part, or what it is and its number where that is not known.
std::string NameOr(const std::string& name, const char* what, int number) {
  return name.empty() ? fmt::format("{} {}", what, number) : Visible(name);
}

/// The texts below each other; `what` stands before the first one only.
void AddFacts(const std::string& what, const std::vector<std::string>& values, Style style,
              Screen* screen) {
  for (size_t i = 0; i < values.size(); ++i) {
    screen->push_back(Fact(i == 0 ? what : "", Visible(values[i]), style));
  }
}

/// A line for each field, task and call, as far as there is room for them.
std::vector<std::string> HeldLines(const bridge::HeldState& held, const RunNames& names,
                                   int64_t program_hash) {
  constexpr size_t kMostLines = 64;
  constexpr size_t kLongest = 200;
  std::vector<std::string> lines;
  // A module may hold thousands of values, of which the page has room for the first few.
  const auto add = [&lines](const std::string& line) {
    if (lines.size() < kMostLines) lines.push_back(bridge::CutText(line, kLongest));
  };
  for (const bridge::HeldValue& field : held.fields) {
    add(fmt::format("field {} = {} ({})", field.name, field.value, field.type));
  }
  for (const bridge::HeldTask& task : held.tasks) {
    add(task.routine);
    for (const bridge::HeldCall& call : task.calls) {
      std::string locals;
      for (const bridge::HeldValue& local : call.locals) {
        locals += fmt::format("{} {} = {}", locals.empty() ? ":" : ",", local.name, local.value);
      }
      add(fmt::format("  in {}, {}{}", call.function, names.Line(program_hash, call.line), locals));
    }
  }
  return lines;
}

/// What a fault has ended for as long as the role is held.
void AddEnded(const morphbus::status_t& status, Screen* screen) {
  if (status.startup_ended) {
    screen->push_back(
        Fact("ended", "a startup, by a fault: nothing else of the role starts", Style::kBad));
  }
  if (status.ended_behaviors > 0) {
    screen->push_back(Fact(status.startup_ended ? "" : "ended",
                           Counted(status.ended_behaviors, "behavior") + ", by a fault",
                           Style::kBad));
  }
}

/// What the module says of itself.
void AddStatus(const ProcessRow& row, const RunNames& names, Screen* screen) {
  const morphbus::status_t& status = *row.status;
  screen->push_back(Fact("role", row.role().empty() ? "none" : Visible(row.role()),
                         row.role().empty() ? Style::kBad : Style::kGood));
  if (status.frozen) screen->push_back(Fact("", "frozen: it changed too often", Style::kBad));
  // STATUS calls joints and links by index; the run's description names them, where it is known.
  const RunNames known = names.Of(status.header.model_hash);
  const int module = known.NumberOf(row.process);
  std::vector<std::string> lines;
  for (const morphbus::label_t& label : status.labels) {
    const bool joint = label.kind == morphbus::label_t::KIND_JOINT;
    const int part = label.index;
    lines.push_back(fmt::format("{}: {}", label.name,
                                joint ? NameOr(known.Joint(module, part), "joint", part)
                                      : NameOr(known.Link(module, part), "link", part)));
  }
  AddFacts("labels", lines, Style::kPlain, screen);
  // The conventions of joints.
  std::string signs;
  for (size_t i = 0; i < status.joint_sign.size(); ++i) {
    const int sign = status.joint_sign[i];
    const int joint = static_cast<int>(i);
    signs += fmt::format("{}{} {}", i == 0 ? "" : ", ",
                         NameOr(known.Joint(module, joint), "joint", joint),
                         sign > 0   ? "+1"
                         : sign < 0 ? "-1"
                                    : "none");
  }
  if (!signs.empty()) screen->push_back(Fact("convention", signs));
  // Of each task the page tells where it stands.
  lines.clear();
  for (const morphbus::task_t& task : status.tasks) {
    lines.push_back(fmt::format("{} at {}", task.function_name,
                                known.Line(status.header.program_hash, task.line)));
  }
  AddFacts("tasks", lines, Style::kPlain, screen);
  AddEnded(status, screen);
  // What the module holds is known from the last `inspect`, if there has been one.
  if (row.held_us < 0) return;
  screen->push_back(Fact("inspected", fmt::format("at {:.2f} s", Seconds(row.held_us))));
  AddFacts("", HeldLines(row.held, known, status.header.program_hash), Style::kPlain, screen);
}

/// How the process fares, by its HEALTH.
void AddHealth(const ProcessRow& row, Screen* screen) {
  if (!row.health) {
    screen->push_back(Fact("health", "not heard yet", Style::kDim));
    return;
  }
  const morphbus::health_t& health = *row.health;
  // What it uses, what it sent and got, and what went wrong.
  const std::string cpu = row.cpu ? fmt::format("{:.1f} % of a core, ", *row.cpu * 100) : "";
  screen->push_back(
      Fact("process", fmt::format("{}{}B of memory at most", cpu,
                                  ShortBytes(static_cast<double>(health.max_rss_kb) * 1024))));
  screen->push_back(
      Fact("messages", fmt::format("{} received, {} sent, {} resent, {} asked again",
                                   health.received, health.sent, health.resent, health.asked)));
  screen->push_back(BadFact("lost", health.lost));
  screen->push_back(BadFact("bad", health.bad));
  if (health.restarts > 0) screen->push_back(BadFact("restarts", health.restarts));
  if (!health.first_refused.empty()) {
    screen->push_back(Fact("refused", Visible(health.first_refused), Style::kBad));
  }
}

}  // namespace

Screen ChannelHead(const ChannelRow* row, const std::string& channel, const ShownFields& fields,
                   int width) {
  if (row == nullptr) {
    return {{{Visible(channel), Style::kTitle}, {"  not heard any more", Style::kBad}}};
  }
  // Name and type, then how regularly messages come.
  const ArrivalFigures& a = row->arrivals;
  const std::string type = row->type.empty() ? "of unknown type" : Visible(row->type);
  Screen head = {{{Visible(channel), Style::kTitle},
                  {fmt::format("  {}  {}", type, Hex(row->fingerprint)), Style::kDim}}};
  head.push_back({{fmt::format("{} Hz  period {}  jitter {} p50, {} p99  {}B/s", ShortRate(a.hz),
                               ShortTime(a.period_s), ShortTime(a.jitter_p50_s),
                               ShortTime(a.jitter_p99_s), ShortBytes(a.bytes_per_s))}});
  // Three periods, so that a slow channel is not called silent between two messages.
  const bool silent = a.silent_s > 2.0 && a.silent_s > 3.0 * a.period_s;
  // How much has come, and what of it was of no use.
  ScreenLine counts = {{fmt::format("{} of {}B now", Counted(row->messages, "message"),
                                    ShortBytes(static_cast<double>(row->last_bytes)))}};
  // Only our messages have numbers by which losses are seen.
  if (row->ours) {
    counts.push_back(
        {fmt::format("  {} lost", row->lost), row->lost > 0 ? Style::kBad : Style::kPlain});
  }
  counts.push_back({fmt::format("  {} undecodable", row->undecodable),
                    row->undecodable > 0 ? Style::kBad : Style::kPlain});
  if (row->unauthentic > 0) {
    counts.push_back({fmt::format("  {} not authentic", row->unauthentic), Style::kBad});
  }
  if (silent)
    counts.push_back({fmt::format("  silent for {}", ShortTime(a.silent_s)), Style::kBad});
  head.push_back(counts);
  if (fields.problem.empty()) return head;
  for (const std::string& line : Wrap(Visible(fields.problem), width)) {
    head.push_back({{line, Style::kBad}});
  }
  return head;
}

int FieldCount(const ShownFields& fields) {
  if (fields.history == nullptr) return 0;
  return static_cast<int>(fields.history->fields().size()) + (fields.history->more() > 0 ? 1 : 0);
}

Screen FieldLines(const ShownFields& fields, int first, int rows, int width) {
  if (fields.history == nullptr) return {};
  const std::vector<FieldRow>& all = fields.history->fields();
  // Names get what they need up to the half, values a third; the rest is for the history.
  int widest = 5;
  int widest_value = 5;
  for (const FieldRow& field : all) {
    widest = std::max(widest, Cells(Visible(field.path)));
    if (!field.history.empty()) widest_value = std::max(widest_value, Cells(Visible(field.value)));
  }
  const int name = std::min(widest, std::max(8, width / 2));
  const int value = std::min(widest_value, std::max(6, width / 3));
  const int bars = width - name - value - 2;
  const int end = std::min(first + rows, static_cast<int>(all.size()));
  Screen lines;
  for (int i = first; i < end; ++i) {
    const FieldRow& field = all[i];
    const std::string above = i > first ? Visible(all[i - 1].path) : "";
    ScreenLine line = {{NameBelow(above, Visible(field.path), name) + " ", Style::kDim}};
    if (field.history.empty()) {
      line.push_back({Visible(field.value)});
    } else {
      line.push_back({FitCells(Visible(field.value), value, true) + " "});
      // What never changes has no history to look at.
      const auto [least, most] = std::minmax_element(field.history.begin(), field.history.end());
      if (bars >= 4 && *least < *most) {
        line.push_back({Sparkline(field.history, bars), Style::kGood});
      }
    }
    lines.push_back(std::move(line));
  }
  // What found no place is at least counted.
  if (fields.history->more() > 0 && first + rows > end) {
    lines.push_back({{fmt::format("and {} more", fields.history->more()), Style::kDim}});
  }
  return lines;
}

Screen ProcessLines(const SpySnapshot& spy, const SpyUi& ui) {
  const auto found = std::ranges::find(spy.processes, ui.process, ProcessKey);
  if (found == spy.processes.end()) return {{{"not heard any more", Style::kBad}}};
  const ProcessRow& row = *found;
  Screen screen = {{{Visible(row.process), Style::kTitle},
                    {fmt::format("  of run {}  {}", Visible(row.run),
                                 row.status ? Visible(row.status->type_name) : ""),
                     Style::kDim}}};
  const RunRow* run = spy.Run(row.run);
  const RunNames names = run == nullptr ? RunNames() : run->names;
  if (row.status) AddStatus(row, names, &screen);
  // Where it is, and what its program did wrong.
  if (row.is_module) {
    std::string pose = "unknown";
    // A pose is as old as the root's broadcast that it rests on.
    if (row.pose_age_s) {
      pose = fmt::format("{} old, {} from the root{}", ShortTime(*row.pose_age_s),
                         Counted(row.hops, "module"), row.pose_stale ? ", stale" : "");
    }
    screen.push_back(Fact("pose", pose, row.pose_stale ? Style::kBad : Style::kPlain));
    screen.push_back(BadFact("faults", row.faults));
    std::vector<std::string> faults;
    for (const auto& [time_us, fault] : row.last_faults) {
      // A fault comes in a STATUS, so that there is one.
      faults.push_back(
          fmt::format("{:.2f} s: {}", Seconds(time_us),
                      names.Of(row.status->header.model_hash)
                          .Fault(row.status->header.program_hash, row.status->type_name, fault)));
    }
    AddFacts("", faults, Style::kBad, &screen);
  }
  // Only the simulator knows who was late, and says so in real time.
  if (row.lateness) {
    screen.push_back(Fact("late",
                          fmt::format("{} missed; {} came late, {} at most",
                                      Counted(row.lateness->missed, "deadline"),
                                      Counted(row.lateness->late, "answer"),
                                      ShortTime(Seconds(row.lateness->worst_us))),
                          Style::kBad));
  }
  AddHealth(row, &screen);
  return screen;
}

}  // namespace morphbus::tools
