#include "logger/show/command_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <string_view>

#include "compiler/base/text.h"
#include "logger/show/report_page.h"

namespace morphbus::logger {
namespace {

/// So many commands stand in a table, and so many are marked in a plot; `info` lists all.
constexpr size_t kMostRows = 200;
constexpr size_t kMostMarks = 16;

/// A command's first word.
std::string FirstWord(const std::string& text) { return text.substr(0, text.find(' ')); }

/// Whether it did something to the robot or its program, and not only to the run's pace.
bool ActsOnRobot(const std::string& text) {
  static constexpr std::string_view kOfTheRun[] = {"pause", "resume", "step", "speed", "stop"};
  const std::string word = FirstWord(text);
  return std::find(std::begin(kOfTheRun), std::end(kOfTheRun), word) == std::end(kOfTheRun);
}

/// A cell with a tick and one with its sim time (s).
std::string TickCells(const std::optional<int64_t>& tick, int32_t tick_us) {
  // A command that the other run alone had has no tick here.
  if (!tick) return "<td class='n dim'>–</td><td class='n dim'>–</td>";
  return fmt::format("<td class='n'>{}</td><td class='n'>{:.2f}</td>", *tick,
                     Seconds(*tick * tick_us));
}

/// What follows the rows of a table that shows only the first of `count` commands.
std::string EndOfCommands(size_t count) {
  const std::string more =
      count > kMostRows
          ? fmt::format("<p class='dim'>{} in all; morphbus info lists them.</p>", count)
          : "";
  return kTableEnd + more + "</section>";
}

}  // namespace

std::string CommandsHtml(const LogFacts& facts) {
  if (facts.commands.empty()) return "";
  std::string html =
      "<section><h2>Commands</h2>" + TableHead({"#tick", "#time|s", "command", "what came of it"});
  size_t rows = 0;
  for (const auto& [tick, text] : facts.commands) {
    if (++rows > kMostRows) break;
    // Of a deployment it counts how the robot stood afterwards.
    std::string effect;
    for (const DeploymentFact& d : facts.deployments) {
      if (d.tick != tick || !d.max_tilt_rad || text.find(d.program) == std::string::npos) continue;
      effect =
          fmt::format("tilted {:.1f}° at most in {:g} s", *d.max_tilt_rad * kDegrees, kTiltSeconds);
    }
    html += fmt::format("<tr>{}<td class='m'>{}</td><td>{}</td></tr>",
                        TickCells(tick, facts.tick_us), EscapeHtml(text), effect);
  }
  return html + EndOfCommands(facts.commands.size());
}

std::string CommandsHtml(const Comparison& comparison) {
  if (comparison.commands.empty()) return "";
  std::string html = "<section><h2>Commands</h2>" +
                     TableHead({"#tick in A", "#s", "#tick in B", "#s", "command", ""});
  size_t rows = 0;
  for (const CommandPair& pair : comparison.commands) {
    if (++rows > kMostRows) break;
    // Where the ticks of both runs have nothing in common, unequal ones are no difference.
    const bool differs = Differs(pair, CommandsByTicks(comparison));
    html +=
        fmt::format("<tr{}>{}{}<td class='m'>{}</td><td>{}</td></tr>",
                    differs ? " class='over'" : "", TickCells(pair.tick_a, comparison.a.tick_us),
                    TickCells(pair.tick_b, comparison.b.tick_us), EscapeHtml(pair.text),
                    !differs                     ? ""
                    : pair.tick_a && pair.tick_b ? "at other ticks"
                    : pair.tick_a                ? "only in A"
                                                 : "only in B");
  }
  return html + EndOfCommands(comparison.commands.size());
}

std::vector<PlotMark> CommandMarks(const LogFacts& facts) {
  std::vector<PlotMark> marks;
  for (const auto& [tick, text] : facts.commands) {
    if (marks.size() == kMostMarks) break;
    if (ActsOnRobot(text)) marks.push_back({Seconds(tick * facts.tick_us), FirstWord(text)});
  }
  return marks;
}

std::vector<PlotMark> CommandMarks(const Comparison& comparison) {
  std::vector<PlotMark> marks;
  for (const CommandPair& pair : comparison.commands) {
    if (marks.size() == kMostMarks) break;
    if (!ActsOnRobot(pair.text)) continue;
    // There a tick of B has no place on A's axis.
    if (!pair.tick_a && !CommandsByTicks(comparison)) continue;
    // Every pair has at least one of the two ticks.
    const int64_t us =
        pair.tick_a ? *pair.tick_a * comparison.a.tick_us : *pair.tick_b * comparison.b.tick_us;
    const char* whose = pair.tick_a && pair.tick_b ? "" : pair.tick_a ? " (A)" : " (B)";
    marks.push_back({Seconds(us), FirstWord(pair.text) + whose});
  }
  return marks;
}

}  // namespace morphbus::logger
