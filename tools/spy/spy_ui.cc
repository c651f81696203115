#include "tools/spy/spy_ui.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <sstream>

namespace morphbus::tools {
namespace {

using Code = Key::Code;

/// The text in small letters.
std::string Small(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// True if each word of the filter is in the text.
bool Passes(const std::string& filter, const std::string& text) {
  std::istringstream words(Small(filter));
  const std::string small = Small(text);
  std::string word;
  while (words >> word) {
    if (small.find(word) == std::string::npos) return false;
  }
  return true;
}

/// The figure by which a column of numbers is sorted.
double FigureOf(const ChannelRow& row, SortBy sort) {
  switch (sort) {
    case SortBy::kRate:
      return row.arrivals.hz;
    case SortBy::kJitter50:
      return row.arrivals.jitter_p50_s;
    case SortBy::kJitter99:
      return row.arrivals.jitter_p99_s;
    case SortBy::kBandwidth:
      return row.arrivals.bytes_per_s;
    case SortBy::kCount:
      return static_cast<double>(row.messages);
    case SortBy::kLost:
      return static_cast<double>(row.lost);
    case SortBy::kUndecodable:
      return static_cast<double>(row.undecodable);
    default:
      return 0.0;
  }
}

/// Whether `a` comes before `b`: names up, numbers down, equal ones by name.
bool ComesBefore(const ChannelRow& a, const ChannelRow& b, SortBy sort, bool reverse) {
  // Texts have an order of their own; all else is compared by its figure.
  if (sort == SortBy::kName) return reverse ? b.channel < a.channel : a.channel < b.channel;
  if (sort == SortBy::kType && a.type != b.type) return (a.type < b.type) != reverse;
  const double x = FigureOf(a, sort);
  const double y = FigureOf(b, sort);
  if (x != y) return (x > y) != reverse;
  return a.channel < b.channel;
}

/// Moves the selection in the list that keys move in by `rows`.
void Move(int rows, const SpySnapshot& spy, SpyUi* ui) {
  // At the ends the selection stays.
  const auto to = [&](int from, size_t size) {
    return std::clamp(from + rows, 0, std::max(0, static_cast<int>(size) - 1));
  };
  // Names are selected and not rows, so the neighbour in the present order is taken.
  if (ui->on_processes) {
    const std::vector<const ProcessRow*> list = ListedProcesses(spy, *ui);
    if (!list.empty()) ui->process = ProcessKey(*list[to(SelectedProcess(list, *ui), list.size())]);
  } else {
    const std::vector<const ChannelRow*> list = ListedChannels(spy, *ui);
    if (!list.empty()) ui->channel = list[to(SelectedChannel(list, *ui), list.size())]->channel;
  }
}

/// How many rows a key moves by; 0 for keys that do not.
int RowsOf(const Key& key, int page) {
  constexpr int kAll = 1 << 20;
  switch (key.code) {
    case Code::kUp:
      return -1;
    case Code::kDown:
      return 1;
    case Code::kPageUp:
      return -page;
    case Code::kPageDown:
      return page;
    case Code::kHome:
      return -kAll;
    case Code::kEnd:
      return kAll;
    case Code::kCharacter:
      return key.character == 'k'   ? -1
             : key.character == 'j' ? 1
             : key.character == 'g' ? -kAll
             : key.character == 'G' ? kAll
                                    : 0;
    default:
      return 0;
  }
}

/// A character or an editing key for the filter.
void Type(const Key& key, SpyUi* ui) {
  constexpr size_t kLongest = 60;
  // What is typed shows its effect at once; Enter only ends the typing.
  if (key.code == Code::kCharacter && ui->filter.size() < kLongest) ui->filter += key.character;
  if (key.code == Code::kBackspace && !ui->filter.empty()) ui->filter.pop_back();
  if (key.code == Code::kEnter) ui->typing = false;
  if (key.code == Code::kEscape) {
    ui->typing = false;
    ui->filter.clear();
  }
}

/// The speed that a run goes at or was asked for, times real time; 0: as fast as possible.
double SpeedOf(const RunRow* run, const SpyUi& ui) {
  // What was asked for last counts, whether the run says so yet or not.
  if (ui.asked_speed) return *ui.asked_speed;
  if (run == nullptr) return 1.0;
  if (run->clock.speed()) return *run->clock.speed();
  // Nobody asked yet: the nearest power of two to what was measured, which of a run that holds
  // still or goes step by step says nothing.
  if (run->clock.paused() || !run->speed || *run->speed <= 0) return 1.0;
  return std::exp2(std::round(std::log2(*run->speed)));
}

/// The command that a key gives to the run; "" for keys that give none.
std::string CommandOf(const Key& key, const RunRow* run, const SpyUi& ui) {
  if (key.code != Code::kCharacter) return "";
  // Speeds are doubled and halved within bounds, from the one in force.
  const double speed = SpeedOf(run, ui);
  switch (key.character) {
    case 'p':
    case ' ':
      return run != nullptr && HoldsStill(*run) ? "resume" : "pause";
    case '.':
      return "step 1";
    case ',':
      return "step 10";
    case '+':
      return speed <= 0 ? "speed 0" : fmt::format("speed {}", std::min(1024.0, speed * 2));
    case '-': {
      // From as fast as possible down to the next power of two below what that is.
      if (speed > 0) return fmt::format("speed {}", std::max(1.0 / 512, speed / 2));
      const double measured = run == nullptr ? 1.0 : run->speed.value_or(1.0);
      return fmt::format("speed {}",
                         measured > 1.0 / 512 ? std::exp2(std::floor(std::log2(measured))) : 1.0);
    }
    case '=':
      return "speed 1";
    case '0':
      return "speed 0";
    default:
      return "";
  }
}

/// Keys of the page with the lists.
void PressOnLists(const Key& key, const SpySnapshot& spy, SpyUi* ui) {
  // A page leaves one row of the page before in sight.
  if (const int rows = RowsOf(key, std::max(1, ui->list_rows - 1)); rows != 0) {
    return Move(rows, spy, ui);
  }
  const int column = static_cast<int>(ui->sort);
  // Which list keys move in, what is opened, and the filter.
  if (key.code == Code::kTab) {
    ui->on_processes = !ui->on_processes && !spy.processes.empty();
  } else if (key.code == Code::kEnter || key.code == Code::kRight) {
    // What was only the first one is the selected one from now on.
    Move(0, spy, ui);
    const bool any =
        ui->on_processes ? !ListedProcesses(spy, *ui).empty() : !ListedChannels(spy, *ui).empty();
    if (any) ui->page = ui->on_processes ? SpyUi::Page::kProcess : SpyUi::Page::kChannel;
    ui->field_top = 0;
  } else if (key.code == Code::kEscape) {
    ui->filter.clear();
  } else if (key.code == Code::kCharacter && key.character == '/') {
    ui->typing = true;
  } else if (key.code == Code::kCharacter && (key.character == 's' || key.character == '>')) {
    ui->sort = static_cast<SortBy>((column + 1) % kSortColumns);
    ui->reverse = false;
  } else if (key.code == Code::kCharacter && (key.character == 'S' || key.character == '<')) {
    ui->sort = static_cast<SortBy>((column + kSortColumns - 1) % kSortColumns);
    ui->reverse = false;
  } else if (key.code == Code::kCharacter && key.character == 'r') {
    ui->reverse = !ui->reverse;
  }
}

/// Keys of a page about one channel or process.
void PressOnDetails(const Key& key, const SpySnapshot& spy, SpyUi* ui) {
  // Whatever feels like going back does.
  const bool back = key.code == Code::kEscape || key.code == Code::kLeft ||
                    key.code == Code::kBackspace || key.code == Code::kEnter ||
                    (key.code == Code::kCharacter && key.character == 'q');
  if (back) {
    ui->page = SpyUi::Page::kLists;
  } else if (const int rows = RowsOf(key, std::max(1, ui->list_rows - 1)); rows != 0) {
    ui->field_top = std::max(0, ui->field_top + rows);
  } else if (key.code == Code::kTab ||
             (key.code == Code::kCharacter && (key.character == ']' || key.character == 'n'))) {
    // The next one of the list, and the one before, without going back to it.
    Move(1, spy, ui);
    ui->field_top = 0;
  } else if (key.code == Code::kCharacter && (key.character == '[' || key.character == 'b')) {
    Move(-1, spy, ui);
    ui->field_top = 0;
  }
}

}  // namespace

std::string ProcessKey(const ProcessRow& row) { return row.run + "/" + row.process; }

std::vector<const ChannelRow*> ListedChannels(const SpySnapshot& spy, const SpyUi& ui) {
  std::vector<const ChannelRow*> rows;
  for (const ChannelRow& row : spy.channels) {
    if (Passes(ui.filter, row.channel + " " + row.type)) rows.push_back(&row);
  }
  // The snapshot is in order of names, which a stable sort keeps among equals.
  std::stable_sort(rows.begin(), rows.end(), [&](const ChannelRow* a, const ChannelRow* b) {
    return ComesBefore(*a, *b, ui.sort, ui.reverse);
  });
  return rows;
}

std::vector<const ProcessRow*> ListedProcesses(const SpySnapshot& spy, const SpyUi& ui) {
  std::vector<const ProcessRow*> rows;
  for (const ProcessRow& row : spy.processes) {
    // The filter is for channels; modules it thins out only while they are looked at.
    const std::string text =
        ProcessKey(row) + " " + row.role() + " " + (row.status ? row.status->type_name : "");
    if (!ui.on_processes || Passes(ui.filter, text)) rows.push_back(&row);
  }
  return rows;
}

int SelectedChannel(const std::vector<const ChannelRow*>& rows, const SpyUi& ui) {
  const auto found = std::ranges::find(rows, ui.channel, &ChannelRow::channel);
  return found == rows.end() ? 0 : static_cast<int>(found - rows.begin());
}

int SelectedProcess(const std::vector<const ProcessRow*>& rows, const SpyUi& ui) {
  const auto found =
      std::ranges::find(rows, ui.process, [](const auto* row) { return ProcessKey(*row); });
  return found == rows.end() ? 0 : static_cast<int>(found - rows.begin());
}

std::string RunPrefix(const SpySnapshot& spy, const SpyUi& ui) {
  const RunRow* run = ShownRun(spy, ui);
  if (run == nullptr) return "";
  std::string prefix = run->run + "/";
  const bool alone = std::ranges::all_of(spy.channels, [&](const ChannelRow& row) {
    return !row.ours || row.channel.starts_with(prefix);
  });
  return alone ? prefix : "";
}

bool HoldsStill(const RunRow& run) {
  return run.clock.paused() || (run.silent_s > 2.0 && !run.clock.ended());
}

const RunRow* ShownRun(const SpySnapshot& spy, const SpyUi& ui) {
  // The run that was asked for, or the first one that was heard.
  if (const RunRow* run = spy.Run(ui.run)) return run;
  return ui.run.empty() && !spy.runs.empty() ? &spy.runs.front() : nullptr;
}

std::string Press(const Key& key, const SpySnapshot& spy, SpyUi* ui) {
  if (key.code == Code::kOther) return {};
  // While the filter is typed every character belongs to it.
  if (ui->typing) {
    Type(key, ui);
    return {};
  }
  // A message has been read when the next key is pressed.
  ui->message.clear();
  ui->failed = false;
  // Keys that mean the same on all pages come first, then those of the page.
  const char c = key.code == Code::kCharacter ? key.character : '\0';
  if (c == 'q' && ui->page == SpyUi::Page::kLists) {
    ui->quit = true;
    return {};
  }
  if (ui->page == SpyUi::Page::kHelp) {
    // Keys that scroll scroll; every other one leaves.
    const int rows = RowsOf(key, std::max(1, ui->list_rows - 1));
    ui->help_top = std::max(0, ui->help_top + rows);
    if (rows == 0) ui->page = ui->below_help;
    return {};
  }
  // Help is left to the page from which it was asked for.
  if (c == '?' || c == 'h') {
    ui->below_help = ui->page;
    ui->page = SpyUi::Page::kHelp;
    ui->help_top = 0;
    return {};
  }
  if (c == 'f') {
    ui->frozen = !ui->frozen;
    return {};
  }
  // A key that commands the run does so on every page.
  std::string command = CommandOf(key, ShownRun(spy, *ui), *ui);
  if (!command.empty()) return command;
  if (ui->page == SpyUi::Page::kLists) {
    PressOnLists(key, spy, ui);
  } else {
    PressOnDetails(key, spy, ui);
  }
  return {};
}

}  // namespace morphbus::tools
