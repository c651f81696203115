#include "logger/show/command_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <numbers>
#include <optional>
#include <string_view>

#include "compiler/base/text.h"

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
std::string TableEnd(size_t count) {
  std::string html = "</tbody></table></div>";
  if (count > kMostRows) {
    html += fmt::format("<p class='dim'>{} in all; morphbus info lists them.</p>", count);
  }
  return html + "</section>";
}

}  // namespace

std::string CommandsHtml(const LogFacts& facts) {
  if (facts.commands.empty()) return "";
  std::string html =
      "<section><h2>Commands</h2><div class='scroll'><table><thead><tr><th class='n'>tick</th>"
      "<th class='n'>time<br><small>s</small></th><th>command</th><th>what came of it</th></tr>"
      "</thead><tbody>";
  size_t rows = 0;
  for (const auto& [tick, text] : facts.commands) {
    if (++rows > kMostRows) break;
    // Of a deployment it counts how the robot stood afterwards.
    std::string effect;
    for (const DeploymentFact& d : facts.deployments) {
      if (d.tick != tick || !d.max_tilt_rad || text.find(d.program) == std::string::npos) continue;
      effect = fmt::format("tilted {:.1f}° at most in {:g} s",
                           *d.max_tilt_rad * 180.0 / std::numbers::pi, kTiltSeconds);
    }
    html += fmt::format("<tr>{}<td class='m'>{}</td><td>{}</td></tr>",
                        TickCells(tick, facts.tick_us), EscapeHtml(text), effect);
  }
  return html + TableEnd(facts.commands.size());
}

std::string CommandsHtml(const Comparison& comparison) {
  if (comparison.commands.empty()) return "";
  std::string html =
      "<section><h2>Commands</h2><div class='scroll'><table><thead><tr>"
      "<th class='n'>tick in A</th><th class='n'>s</th><th class='n'>tick in B</th>"
      "<th class='n'>s</th><th>command</th><th></th></tr></thead><tbody>";
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
  return html + TableEnd(comparison.commands.size());
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
