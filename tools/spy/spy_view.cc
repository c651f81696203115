#include "tools/spy/spy_view.h"

#include <fmt/format.h>

#include <algorithm>

#include "compiler/base/text.h"
#include "tools/spy/hex_dump.h"
#include "tools/spy/list_tables.h"
#include "tools/spy/spy_help.h"
#include "tools/spy/spy_pages.h"

namespace morphbus::tools {
namespace {

/// The lines of the top: the run, and what there is in all.
Screen HeadLines(const SpySnapshot& spy, const SpyUi& ui, int width) {
  constexpr int kNarrow = 60;
  ScreenLine title;
  if (width >= kNarrow) title.push_back({"morphbus spy  ", Style::kTitle});
  if (const RunRow* run = ShownRun(spy, ui)) {
    const ScreenLine line = RunLine(*run);
    title.insert(title.end(), line.begin(), line.end());
  } else {
    title.push_back({fmt::format("no run of Morphbus heard  {:.0f} s", spy.seconds)});
  }
  // All channels together that the filter lets through.
  const std::vector<const ChannelRow*> listed = ListedChannels(spy, ui);
  double hz = 0.0;
  double bytes = 0.0;
  int64_t lost = 0;
  int64_t undecodable = 0;
  for (const ChannelRow* row : listed) {
    hz += row->arrivals.hz;
    bytes += row->arrivals.bytes_per_s;
    lost += row->lost;
    undecodable += row->undecodable;
  }
  const std::string of = ui.filter.empty() ? "" : fmt::format("{} of ", listed.size());
  // What makes the figures look other than they are comes first: frozen, filtered.
  ScreenLine totals;
  if (ui.frozen) totals.push_back({"FROZEN (f goes on)  ", Style::kBad});
  if (!ui.filter.empty()) totals.push_back({fmt::format("filter '{}'  ", ui.filter), Style::kKey});
  totals.push_back(
      {fmt::format("{}{}  ", of, Counted(static_cast<int64_t>(spy.channels.size()), "channel"))});
  auto rates_at = std::ssize(totals);
  totals.push_back({fmt::format("{} lost  ", lost), lost > 0 ? Style::kBad : Style::kPlain});
  totals.push_back(
      {fmt::format("{} undecodable", undecodable), undecodable > 0 ? Style::kBad : Style::kPlain});
  // What this listener itself missed makes the counts above it doubtful.
  if (spy.missing > 0) {
    totals.push_back({fmt::format("  {} missed here", spy.missing), Style::kBad});
  }
  if (spy.untold_messages > 0) {
    totals.push_back(
        {fmt::format("  {} on channels beyond these", spy.untold_messages), Style::kBad});
  }
  // Where there is no room for all, what was lost is of more worth than rates.
  int cells = 0;
  for (const Span& span : totals) cells += Cells(span.text);
  for (const std::string& rate : {ShortRate(hz) + " msg/s  ", ShortBytes(bytes) + "B/s  "}) {
    cells += Cells(rate);
    if (cells > width) break;
    totals.insert(totals.begin() + rates_at++, {rate});
  }
  return {title, totals};
}

/// Puts `top` where a list of `rows` lines shows the one at `selected` of `count`.
void ScrollTo(int selected, int count, int rows, int* top) {
  // As little as it takes to bring it into sight, and no empty rows at the end.
  *top = std::clamp(*top, selected - rows + 1, selected);
  *top = std::clamp(*top, 0, std::max(0, count - rows));
}

/// A table of at most `height` lines, heading included, of which the row at `selected` is in sight;
/// `focused` if keys move in it. `count_is_known`: the lines above say how many rows there are.
void AddTable(SpyTableText table, int selected, bool focused, bool count_is_known, int width,
              int height, int* top, Screen* screen) {
  const int rows = height - 1;
  const int count = static_cast<int>(table.rows.size());
  ScrollTo(selected, count, rows, top);
  // Where not all can be seen, the heading says which, if there is room for it.
  constexpr int kRoomy = 40;
  if (count > rows && rows > 0 && width >= kRoomy) {
    table.columns.front().title += fmt::format(" {}-{}{}", *top + 1, *top + rows,
                                               count_is_known ? "" : fmt::format("/{}", count));
  }
  // A column is for the mark of the selected row.
  const std::vector<int> widths = TableWidths(table.columns, table.rows, width - 1);
  const auto add = [&](const char* mark, Style style, ScreenLine line) {
    line.insert(line.begin(), Span{mark, style});
    screen->push_back(std::move(line));
  };
  add(" ", Style::kHeading, TableHeading(table.columns, widths));
  for (int i = *top; i < std::min(count, *top + rows); ++i) {
    const bool here = focused && i == selected;
    add(here ? ">" : " ", here ? Style::kSelected : Style::kPlain,
        TableLine(table.columns, widths, table.rows[i], here));
  }
}

/// The lists of channels and processes, in `height` lines.
void AddLists(const SpySnapshot& spy, SpyUi* ui, int width, int height, Screen* screen) {
  const std::vector<const ChannelRow*> channels = ListedChannels(spy, *ui);
  const std::vector<const ProcessRow*> processes = ListedProcesses(spy, *ui);
  // The list that keys move in gets the larger share; what one does not need, the other gets. A
  // screen that is too low for both shows that one alone.
  constexpr int kLowest = 8;
  const int channels_need = static_cast<int>(channels.size()) + 1;
  const int processes_need = static_cast<int>(processes.size()) + 1;
  int below = 0;
  if (height < kLowest) {
    below = ui->on_processes ? height : 0;
  } else if (!spy.processes.empty()) {
    const int share = ui->on_processes ? height * 3 / 5 : height * 2 / 5;
    below = std::clamp(height - 1 - channels_need, share, std::max(share, processes_need));
    below = std::min(below, processes_need);
  }
  // A blank line stands between the two.
  const int gap = below > 0 && below < height ? 1 : 0;
  const int above = height - below - gap;
  ui->list_rows = std::max(1, (ui->on_processes ? below : above) - 1);
  if (above > 0) {
    AddTable(ChannelTableText(channels, RunPrefix(spy, *ui), ui), SelectedChannel(channels, *ui),
             !ui->on_processes, true, width, above, &ui->channel_top, screen);
    if (channels.empty()) {
      screen->push_back(
          {{spy.channels.empty() ? " nothing heard yet" : " no channel passes the filter",
            Style::kDim}});
    }
  }
  if (below == 0) return;
  // The modules stand at the same height however few channels there are.
  while (gap > 0 && static_cast<int>(screen->size()) < above + gap + 2) screen->emplace_back();
  AddTable(ProcessTableText(processes, spy.runs.size() > 1), SelectedProcess(processes, *ui),
           ui->on_processes, false, width, below, &ui->process_top, screen);
}

/// The last line: what was said, what is typed, or which keys do something. `scrolls` as in
/// KeyHints.
ScreenLine FootLine(const SpySnapshot& spy, const SpyUi& ui, bool scrolls, int width) {
  // What needs an answer now goes before what was said, and that before hints.
  if (ui.typing) {
    return {{"filter: ", Style::kKey},
            {ui.filter + "_"},
            {"  Enter keeps it, Esc drops it", Style::kDim}};
  }
  if (!ui.message.empty()) return {{ui.message, ui.failed ? Style::kBad : Style::kGood}};
  ScreenLine line;
  int used = 0;
  for (const auto& [key, what] : KeyHints(spy, ui, scrolls)) {
    // A hint that does not fit whole is left out.
    const std::string text = fmt::format(" {}  ", what);
    used += Cells(key) + Cells(text);
    if (used > width + 2) break;
    line.push_back({key, Style::kKey});
    line.push_back({text, Style::kDim});
  }
  return line;
}

/// Where a page of `count` lines is scrolled to if `height` of them can be seen.
int ScrolledTo(int count, int height, SpyUi* ui, int* top) {
  *top = std::clamp(*top, 0, std::max(0, count - height));
  ui->list_rows = std::max(1, height);
  return *top;
}

/// Adds the lines of a page that is scrolled as text, from `*top` on. True if not all are in sight.
bool AddScrolled(const Screen& lines, int height, SpyUi* ui, int* top, Screen* screen) {
  const int count = static_cast<int>(lines.size());
  const int first = ScrolledTo(count, height, ui, top);
  for (int i = first; i < std::min(count, first + height); ++i) screen->push_back(lines[i]);
  return count > height;
}

/// Adds a channel's page. What is fixed stands above what is scrolled: its fields, or its bytes if
/// nobody knows them. True if not all of that is in sight.
bool AddChannel(const SpySnapshot& spy, const ShownFields& fields, SpyUi* ui, int width, int height,
                Screen* screen) {
  const Screen head = ChannelHead(spy.Channel(ui->channel), ui->channel, fields, width);
  screen->insert(screen->end(), head.begin(), head.end());
  const int rest = std::max(0, height - static_cast<int>(head.size()));
  if (!fields.problem.empty()) {
    return AddScrolled(HexDump(fields.bytes, fields.size, width), rest, ui, &ui->field_top, screen);
  }
  // The first line in sight has its whole name, those below what is new in theirs.
  const int count = FieldCount(fields);
  const int first = ScrolledTo(count, rest, ui, &ui->field_top);
  const Screen lines = FieldLines(fields, first, rest, width);
  screen->insert(screen->end(), lines.begin(), lines.end());
  return count > rest;
}

}  // namespace

ScreenLine RunLine(const RunRow& run) {
  // The last that holds is shown: a run that is paused is silent for a reason, one that ended for
  // good.
  Span state = {"running", Style::kGood};
  if (run.silent_s > 2.0)
    state = {fmt::format("silent for {}", ShortTime(run.silent_s)), Style::kBad};
  if (run.clock.paused()) state = {"paused", Style::kKey};
  if (run.clock.ended()) {
    const std::string& why = run.clock.end_reason();
    const std::string reason = why.empty() ? "" : ": " + Visible(why);
    state = {"ended" + reason, Style::kBad};
  }
  const std::string speed = run.speed ? fmt::format("  ×{:.2f}", *run.speed) : "";
  return {{Visible(run.run) + "  ", Style::kTitle},
          state,
          {fmt::format("  sim {:.2f} s{}  tick {}", Seconds(run.clock.time_us()), speed,
                       run.clock.tick())}};
}

Screen DrawSpy(const SpySnapshot& spy, const ShownFields& fields, SpyUi* ui, int width,
               int height) {
  // A terminal may be resized to nothing for a moment.
  width = std::max(1, width);
  height = std::max(1, height);
  Screen screen = HeadLines(spy, *ui, width);
  const int body = height - static_cast<int>(screen.size()) - 1;
  bool scrolls = false;
  if (body > 0) {
    switch (ui->page) {
      case SpyUi::Page::kLists:
        AddLists(spy, ui, width, body, &screen);
        break;
      case SpyUi::Page::kChannel:
        scrolls = AddChannel(spy, fields, ui, width, body, &screen);
        break;
      case SpyUi::Page::kProcess:
        scrolls = AddScrolled(ProcessLines(spy, *ui), body, ui, &ui->field_top, &screen);
        break;
      case SpyUi::Page::kHelp:
        scrolls = AddScrolled(HelpLines(spy, *ui, width), body, ui, &ui->help_top, &screen);
        break;
    }
  }
  // Too few lines are filled up, too many cut, so that the last one is always the same.
  screen.resize(static_cast<size_t>(std::max(0, height - 1)));
  screen.push_back(FootLine(spy, *ui, scrolls, width));
  for (ScreenLine& line : screen) line = FitLine(line, width);
  return screen;
}

}  // namespace morphbus::tools
