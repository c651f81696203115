#include "tools/spy/spy_pages.h"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/wire/codec.h"
#include "compiler/base/text.h"
#include "tools/spy/process_table.h"

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

/// The texts below each other; `what` stands before the first one only.
void AddFacts(const std::string& what, const std::vector<std::string>& values, Style style,
              Screen* screen) {
  for (size_t i = 0; i < values.size(); ++i) {
    screen->push_back(Fact(i == 0 ? what : "", Visible(values[i]), style));
  }
}

/// A line for each field, task and call, as far as there is room for them.
std::vector<std::string> HeldLines(const bridge::HeldState& held) {
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
      add(fmt::format("  in {}, line {}{}", call.function, call.line, locals));
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
void AddStatus(const ProcessRow& row, Screen* screen) {
  const morphbus::status_t& status = *row.status;
  screen->push_back(Fact("role", row.role().empty() ? "none" : Visible(row.role()),
                         row.role().empty() ? Style::kBad : Style::kGood));
  if (status.frozen) screen->push_back(Fact("", "frozen: it changed too often", Style::kBad));
  // STATUS calls joints and links by index, and the spy has no model that names them.
  std::vector<std::string> lines;
  for (const morphbus::label_t& label : status.labels) {
    const bool joint = label.kind == morphbus::label_t::KIND_JOINT;
    lines.push_back(fmt::format("{}: {} {}", label.name, joint ? "joint" : "link", label.index));
  }
  AddFacts("labels", lines, Style::kPlain, screen);
  // The conventions of joints, by their index in the module.
  std::string signs;
  for (size_t i = 0; i < status.joint_sign.size(); ++i) {
    const int sign = status.joint_sign[i];
    signs += fmt::format("{}joint {} {}", i == 0 ? "" : ", ", i,
                         sign > 0   ? "+1"
                         : sign < 0 ? "-1"
                                    : "none");
  }
  if (!signs.empty()) screen->push_back(Fact("convention", signs));
  // Of each task the page tells where it stands.
  lines.clear();
  for (const morphbus::task_t& task : status.tasks) {
    lines.push_back(fmt::format("{} at line {}", task.function_name, task.line));
  }
  AddFacts("tasks", lines, Style::kPlain, screen);
  AddEnded(status, screen);
  // What the module holds is known from the last `inspect`, if there has been one.
  if (row.held_us < 0) return;
  screen->push_back(Fact("inspected", fmt::format("at {:.2f} s", Seconds(row.held_us))));
  AddFacts("", HeldLines(row.held), Style::kPlain, screen);
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

Screen ChannelHead(const ChannelRow* row, const std::string& channel, const ShownFields& fields) {
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
  if (!fields.problem.empty()) head.push_back({{Visible(fields.problem), Style::kBad}});
  return head;
}

Screen FieldLines(const ShownFields& fields, int width) {
  if (fields.history == nullptr) return {};
  // Names get what they need up to the half, values a quarter; the rest is for the history.
  int widest = 5;
  int widest_value = 5;
  for (const FieldRow& field : fields.history->fields()) {
    widest = std::max(widest, Cells(field.path));
    if (!field.history.empty()) widest_value = std::max(widest_value, Cells(field.value));
  }
  const int name = std::min(widest, std::max(8, width / 2));
  const int value = std::min(widest_value, std::max(6, width / 4));
  const int bars = width - name - value - 2;
  Screen lines;
  for (const FieldRow& field : fields.history->fields()) {
    // Where a name is too long, its end tells more than its beginning.
    ScreenLine line = {{FitEnd(Visible(field.path), name) + " ", Style::kDim}};
    if (field.history.empty()) {
      line.push_back({Visible(field.value)});
    } else {
      line.push_back({FitCells(field.value, value, true) + " "});
      // What never changes has no history to look at.
      const auto [least, most] = std::minmax_element(field.history.begin(), field.history.end());
      if (bars >= 4 && *least < *most) {
        line.push_back({Sparkline(field.history, bars), Style::kGood});
      }
    }
    lines.push_back(std::move(line));
  }
  // What found no place is at least counted.
  if (fields.history->more() > 0) {
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
  if (row.status) AddStatus(row, &screen);
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
      faults.push_back(fmt::format("{:.2f} s: {}", Seconds(time_us), HeardFaultText(fault)));
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

Screen HelpLines() {
  // A line without a text is a heading.
  using Line = std::pair<const char*, const char*>;
  static const std::vector<Line> lines = {
      {"KEYS", ""},
      {"up down j k", "select; PgUp PgDn, Home End (g G) further"},
      {"Enter, right", "the fields of a channel, or all about a module; Esc, left, q: back"},
      {"] [", "there: the next one of the list, the one before"},
      {"Tab", "moves in the list of modules, and back"},
      {"/", "filter: words that channel or type must hold; Esc drops it"},
      {"s S", "sort by the next column, the one before; r turns the order round"},
      {"f", "freezes the figures; what comes is still counted"},
      {"p, blank", "pauses the run, resumes it"},
      {". ,", "paused: runs one tick, ten ticks"},
      {"+ - =", "speed times two, half of it, real time; 0: as fast as possible"},
      {"? h", "this help"},
      {"q, Ctrl-C", "quits"},
      {"", ""},
      {"CHANNELS", ""},
      {"HZ", "messages a second over the last two seconds, or the last eight"},
      {"P50 P99", "jitter: the half, 99 % of the intervals differ from the median by at most that"},
      {"B/S", "bytes of payload a second"},
      {"LOST", "gaps in the numbers of our messages; others' have none"},
      {"UNDEC", "messages that are damaged, or of a type that nobody named (--types)"},
      {"", ""},
      {"MODULES", ""},
      {"POSE", "sim time since the root sent what the module's poses rest on"},
      {"FAULTS", "of its program, since the spy began to listen"},
      {"CPU MEM", "of its process: share of a core, largest memory so far"},
      {"LATE", "real time: ticks that were over before its answer came"},
  };
  Screen screen;
  for (const auto& [what, text] : lines) {
    const bool heading = *text == '\0';
    screen.push_back({{FitCells(what, 13) + " ", heading ? Style::kHeading : Style::kKey}, {text}});
  }
  return screen;
}

}  // namespace morphbus::tools
