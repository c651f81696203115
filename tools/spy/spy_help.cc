#include "tools/spy/spy_help.h"

#include <algorithm>

namespace morphbus::tools {
namespace {

/// Adds the keys that command the run, if it takes commands.
void AddRunKeys(const SpySnapshot& spy, const SpyUi& ui, std::vector<KeyHint>* hints) {
  const RunRow* run = ShownRun(spy, ui);
  if (run == nullptr || !ui.takes_commands || run->clock.ended()) return;
  // Only a run that was told to hold still, or never went on, can go on step by step.
  const bool still = HoldsStill(*run);
  hints->emplace_back("p", still ? "resume" : "pause");
  if (still) hints->emplace_back(".", "step");
  hints->emplace_back("+-", "speed");
}

}  // namespace

std::vector<KeyHint> KeyHints(const SpySnapshot& spy, const SpyUi& ui, bool scrolls) {
  using Page = SpyUi::Page;
  std::vector<KeyHint> hints;
  if (ui.page == Page::kHelp) {
    hints = {{"Esc", "back"}};
    if (scrolls) hints.emplace_back("j k", "scroll");
    return hints;
  }
  const size_t listed =
      ui.on_processes ? ListedProcesses(spy, ui).size() : ListedChannels(spy, ui).size();
  hints.emplace_back("?", "help");
  if (ui.page == Page::kLists) {
    hints.emplace_back("q", "quit");
    if (listed > 0) hints.emplace_back("Enter", "open");
    // What is filtered can be had back, what is not there cannot be filtered or sorted.
    if (!spy.channels.empty()) hints.emplace_back("/", "filter");
    if (!ui.filter.empty()) hints.emplace_back("Esc", "all");
    if (!ui.on_processes && listed > 1) hints.emplace_back("s", "sort");
    if (!spy.processes.empty()) hints.emplace_back("Tab", ui.on_processes ? "channels" : "modules");
  } else {
    hints.emplace_back("Esc", "back");
    if (listed > 1) {
      hints.emplace_back("]", "next");
      hints.emplace_back("[", "previous");
    }
    if (scrolls) hints.emplace_back("j k", "scroll");
  }
  AddRunKeys(spy, ui, &hints);
  if (!spy.channels.empty()) hints.emplace_back("f", ui.frozen ? "go on" : "freeze");
  return hints;
}

Screen HelpLines(const SpySnapshot& spy, const SpyUi& ui, int width) {
  std::vector<KeyHint> run_keys;
  AddRunKeys(spy, ui, &run_keys);
  // A line without a text is a heading.
  std::vector<KeyHint> lines = {
      {"KEYS", ""},
      {"up down j k", "select; PgUp PgDn, Home End (g G) further"},
      {"Enter, right", "the fields of a channel, or all about a module; Esc, left, q: back"},
      {"] [", "there: the next one of the list, the one before"},
      {"Tab", "moves in the list of modules, and back"},
      {"/", "filter: words that channel or type must hold; Esc drops it"},
      {"s S", "sort by the next column, the one before; r turns the order round"},
      {"f", "freezes the figures; what comes is still counted"},
  };
  if (!run_keys.empty()) {
    lines.insert(lines.end(),
                 {{"p, blank", "pauses the run, resumes it"},
                  {". ,", "paused: runs one tick, ten ticks"},
                  {"+ - =", "speed times two, half of it, real time; 0: as fast as possible"}});
  }
  lines.insert(
      lines.end(),
      {{"? h", "this help"},
       {"q, Ctrl-C", "quits"},
       {"", ""},
       {"CHANNELS", ""},
       {"HZ", "messages a second over the last two seconds, or the last eight"},
       {"TREND", "HZ second by second, the newest at the right, from 0 to its greatest"},
       {"P50 P99", "jitter: half, 99 % of the intervals differ from the median by at most so much"},
       {"B/S SHARE", "bytes of payload a second, and their share of all that are listed"},
       {"LOST", "gaps in the numbers of our messages; others' have none"},
       {"UNDEC", "messages that are damaged, or of a type that nobody named (--types)"},
       {"", ""},
       {"MODULES", ""},
       {"POSE", "sim time since the root sent what the module's poses rest on"},
       {"FAULTS", "of its program, since the spy began to listen"},
       {"CPU LOAD", "of its process: share of a core, as a number and as a bar"},
       {"TREND", "CPU from HEALTH to HEALTH, from 0 to its greatest"},
       {"MEM", "the largest memory of its process so far"},
       {"LATE", "real time: ticks that were over before its answer came"}});
  constexpr int kKeys = 13;
  Screen screen;
  for (const auto& [what, text] : lines) {
    Style style = text.empty() ? Style::kHeading : Style::kKey;
    // Where there is no room for two columns every line is wrapped as it is.
    const int room = std::max(8, width - kKeys - 1);
    std::string key = what;
    for (const std::string& line : Wrap(text, room)) {
      screen.push_back({{FitCells(key, kKeys) + " ", style}, {line}});
      key.clear();
      style = Style::kPlain;
    }
  }
  return screen;
}

}  // namespace morphbus::tools
