// The spy's screen as text, and what keys do to it. No terminal.

#include "tools/spy/spy_view.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "tools/spy/spy_help.h"

namespace morphbus::tools {
namespace {

using Code = Key::Code;

/// A CLOCK of tick 617, and commands that take effect in it.
morphbus::sim_clock_t ClockWith(const std::vector<std::string>& controls) {
  morphbus::sim_clock_t clock = {};
  clock.header.tick = 617;
  clock.header.sim_time_us = 12'340'000;
  clock.tick_us = 20'000;
  clock.phase = morphbus::sim_clock_t::PHASE_RUN;
  clock.controls = controls;
  return clock;
}

/// A bus with so many channels, three modules and their simulator.
SpySnapshot Bus(int channels) {
  SpySnapshot spy;
  for (int i = 0; i < channels; ++i) {
    ChannelRow row;
    row.channel = fmt::format("walk/m{:02}/STATUS", i);
    row.type = "morphbus.status_t";
    row.ours = true;
    row.messages = 100 + i;
    row.arrivals = {10.0 + i, 1000.0 - i, 50, 0.02, 12e-6, 80e-6, 0.01, {10, 0, 5, 10}};
    spy.channels.push_back(row);
  }
  for (const char* name : {"m1", "m2", "m10", "SIM"}) {
    ProcessRow row;
    row.run = "walk";
    row.process = name;
    row.is_module = row.process != "SIM";
    if (row.is_module) row.status.emplace().role_name = "Leg";
    row.health.emplace().max_rss_kb = 7000;
    row.cpu = 0.015;
    spy.processes.push_back(row);
  }
  RunRow run;
  run.run = "walk";
  run.clock.Take(ClockWith({}));
  run.speed = 1.0;
  spy.runs.push_back(run);
  return spy;
}

std::vector<std::string> Lines(const Screen& screen) {
  std::istringstream text(PlainText(screen));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

class SpyViewTest : public ::testing::Test {
 protected:
  std::vector<std::string> Draw(int width = 80, int height = 24) {
    return Lines(DrawSpy(spy_, fields_, &ui_, width, height));
  }
  std::string Text(int width = 80, int height = 24) {
    return PlainText(DrawSpy(spy_, fields_, &ui_, width, height));
  }
  bool Has(const std::string& text, int width = 80, int height = 24) {
    return Text(width, height).find(text) != std::string::npos;
  }
  std::string Press(Code code) { return tools::Press({code, 0}, spy_, &ui_); }
  std::string Press(char character) {
    return tools::Press({Code::kCharacter, character}, spy_, &ui_);
  }
  void Type(const std::string& text) {
    for (const char c : text) Press(c);
  }
  /// The line that is marked as selected; "" if there is none.
  std::string Selected(int width = 80, int height = 24) {
    for (const std::string& line : Draw(width, height)) {
      if (line.starts_with('>')) return line;
    }
    return "";
  }

  SpySnapshot spy_ = Bus(40);
  ShownFields fields_;
  SpyUi ui_;
};

TEST_F(SpyViewTest, EveryScreenHasExactlyItsSize) {
  FieldHistory history;
  history.Take(FieldsOf({{"a.very.long.name.of.a.field.that.fits.nowhere", 1.5}, {"b", "text"}}));
  history.Take(FieldsOf({{"a.very.long.name.of.a.field.that.fits.nowhere", 2.5}, {"b", "text"}}));
  fields_.history = &history;
  for (const SpyUi::Page page :
       {SpyUi::Page::kLists, SpyUi::Page::kChannel, SpyUi::Page::kProcess, SpyUi::Page::kHelp}) {
    for (int width = 1; width <= 130; width += width < 30 ? 1 : 20) {
      for (int height = 1; height <= 60; height += height < 12 ? 1 : 9) {
        ui_ = SpyUi();
        ui_.page = page;
        ui_.channel = "walk/m07/STATUS";
        ui_.process = "walk/m2";
        const Screen screen = DrawSpy(spy_, fields_, &ui_, width, height);
        ASSERT_EQ(screen.size(), static_cast<size_t>(height)) << width << "x" << height;
        for (const ScreenLine& line : screen) {
          int cells = 0;
          for (const Span& span : line) cells += Cells(span.text);
          ASSERT_LE(cells, width) << width << "x" << height;
        }
      }
    }
  }
}

TEST_F(SpyViewTest, AnOrdinaryTerminalShowsChannelsModulesAndTheRun) {
  EXPECT_TRUE(Has("walk  running  sim 12.34 s  ×1.00  tick 617")) << Text();
  EXPECT_TRUE(Has("40 channels  1180 msg/s"));
  for (const char* part :
       {"CHANNEL 1-", "TYPE", "HZ", "P50", "P99", "B/S", "COUNT", "LOST", "UNDEC", "m00/STATUS",
        "status_t", "12µs", "80µs", "MODULE", "Leg", "simulator", "1.5%", "7.2M"}) {
    EXPECT_TRUE(Has(part)) << part << "\n" << Text();
  }
}

TEST_F(SpyViewTest, NarrowTerminalsLoseColumnsNotNames) {
  EXPECT_TRUE(Has("P99", 80));
  EXPECT_FALSE(Has("P99", 60));
  EXPECT_TRUE(Has("TREND", 60));
  EXPECT_TRUE(Has("TYPE", 72));
  EXPECT_FALSE(Has("SHARE", 80));
  EXPECT_TRUE(Has("SHARE", 90));
  EXPECT_FALSE(Has("TYPE", 40));
  EXPECT_TRUE(Has("HZ", 40));
  EXPECT_TRUE(Has("m00/STATUS", 40)) << Text(40);
}

TEST_F(SpyViewTest, TheSelectionStaysInSight) {
  EXPECT_NE(Selected().find("m00"), std::string::npos);
  for (int i = 0; i < 25; ++i) Press(Code::kDown);
  EXPECT_NE(Selected().find("m25"), std::string::npos) << Text();
  Press(Code::kEnd);
  EXPECT_NE(Selected().find("m39"), std::string::npos);
  Press('g');
  EXPECT_NE(Selected().find("m00"), std::string::npos);
  Press(Code::kPageDown);
  const std::string after = Selected();
  EXPECT_EQ(after.find("m00"), std::string::npos);
  // A window that becomes lower still shows it.
  EXPECT_EQ(Selected(80, 6).substr(0, 11), after.substr(0, 11));
}

TEST_F(SpyViewTest, TheSelectionIsAChannelNotAPlace) {
  for (int i = 0; i < 5; ++i) Press('j');
  EXPECT_EQ(ui_.channel, "walk/m05/STATUS");
  ChannelRow row = spy_.channels.front();
  row.channel = "a/first";
  spy_.channels.insert(spy_.channels.begin(), row);
  EXPECT_NE(Selected().find("m05"), std::string::npos);
}

TEST_F(SpyViewTest, ChannelsAreSortedByEachColumn) {
  spy_.channels[7].lost = 3;
  const auto first = [&] { return ListedChannels(spy_, ui_).front()->channel; };
  EXPECT_EQ(first(), "walk/m00/STATUS");
  Press('s');  // type
  Press('s');
  EXPECT_EQ(ui_.sort, SortBy::kRate);
  EXPECT_EQ(first(), "walk/m39/STATUS");
  EXPECT_TRUE(Has("HZ↓")) << Text();
  Press('r');
  EXPECT_EQ(first(), "walk/m00/STATUS");
  EXPECT_TRUE(Has("HZ↑"));
  while (ui_.sort != SortBy::kLost) Press('s');
  EXPECT_EQ(first(), "walk/m07/STATUS");
  Press('S');
  EXPECT_EQ(ui_.sort, SortBy::kCount);
  while (ui_.sort != SortBy::kName) Press('s');
  Press('r');
  EXPECT_EQ(first(), "walk/m39/STATUS");
}

TEST_F(SpyViewTest, TheFilterTakesWordsInAnyOrder) {
  Press('/');
  Type("status M1");
  EXPECT_TRUE(Has("filter: status M1_")) << Text();
  EXPECT_EQ(ListedChannels(spy_, ui_).size(), 10u);
  Press(Code::kBackspace);
  Type("2");
  Press(Code::kEnter);
  EXPECT_TRUE(Has("filter 'status M2'  10 of 40 channels  345.0 msg/s")) << Text();
  // Rates give way to what was lost.
  EXPECT_TRUE(Has("10 of 40 channels  0 lost  0 undecodable", 65)) << Text(65);
  EXPECT_EQ(ListedChannels(spy_, ui_).size(), 10u);
  // The first of them is the selected one now.
  EXPECT_NE(Selected().find("m20"), std::string::npos) << Text();
  Press('/');
  Type("x");
  EXPECT_TRUE(Has("no channel passes the filter"));
  Press(Code::kEscape);
  EXPECT_EQ(ListedChannels(spy_, ui_).size(), 40u);
}

TEST_F(SpyViewTest, ARunsNameIsNotRepeatedInEveryRow) {
  ChannelRow foreign;
  foreign.channel = "walk_alone";
  spy_.channels.push_back(foreign);
  EXPECT_TRUE(Selected().starts_with(">m00/STATUS")) << Text();
  Press(Code::kEnd);
  EXPECT_TRUE(Selected().starts_with(">walk_alone")) << Text();
  // A page names it in full, and so does the list where there is a second run.
  Press('g');
  Press(Code::kEnter);
  EXPECT_TRUE(Has("\nwalk/m00/STATUS  morphbus.status_t")) << Text();
  Press('q');
  spy_.channels.back().channel = "other/HELLO";
  spy_.channels.back().ours = true;
  EXPECT_TRUE(Selected().starts_with(">walk/m00/STATUS")) << Text();
  // Without a run in the first line nothing else would name it.
  spy_.channels.pop_back();
  spy_.runs.clear();
  EXPECT_TRUE(Selected().starts_with(">walk/m00/STATUS")) << Text();
}

TEST_F(SpyViewTest, ListsHaveTrendsAndMeters) {
  spy_.processes[0].cpu = 0.5;
  spy_.processes[0].cpu_history = {0.25, 0.5, 0.125};
  EXPECT_NE(Selected().find("█ ▄█"), std::string::npos) << Text();
  // All channels but the first one are silent: it has all of the bytes.
  for (size_t i = 1; i < spy_.channels.size(); ++i) spy_.channels[i].arrivals.bytes_per_s = 0;
  EXPECT_NE(Selected(120).find(" ██████████ "), std::string::npos) << Text(120);
  const std::vector<std::string> lines = Draw(120);
  const auto m1 =
      std::ranges::find_if(lines, [](const std::string& line) { return line.starts_with(" m1 "); });
  ASSERT_NE(m1, lines.end());
  EXPECT_NE(m1->find(" 50.0% █████ "), std::string::npos) << *m1;
  EXPECT_NE(m1->find("▄█▂"), std::string::npos) << *m1;
}

TEST_F(SpyViewTest, ALetterInTheFilterIsNoCommand) {
  Press('/');
  for (const char key : {'q', 'p', '.', '?', 'f'}) {
    EXPECT_EQ(Press(key), "") << key;
  }
  EXPECT_EQ(ui_.filter, "qp.?f");
  EXPECT_EQ(ui_.page, SpyUi::Page::kLists);
}

TEST_F(SpyViewTest, TabGoesToTheModulesAndEnterOpensOne) {
  Press(Code::kTab);
  EXPECT_NE(Selected().find("m1 "), std::string::npos) << Text();
  Press(Code::kDown);
  Press(Code::kEnter);
  EXPECT_EQ(ui_.page, SpyUi::Page::kProcess);
  EXPECT_EQ(ui_.process, "walk/m2");
  EXPECT_TRUE(Has("m2  of run walk")) << Text();
  EXPECT_TRUE(Has("role         Leg"));
  Press(']');
  EXPECT_TRUE(Has("m10  of run walk"));
  Press('q');
  EXPECT_EQ(ui_.page, SpyUi::Page::kLists);
}

TEST_F(SpyViewTest, AModulesPageTellsWhatFaultsHaveEnded) {
  Press(Code::kTab);
  Press(Code::kEnter);
  EXPECT_FALSE(Has("by a fault")) << Text();
  spy_.processes[0].status->ended_behaviors = 2;
  EXPECT_TRUE(Has("ended        2 behaviors, by a fault")) << Text();
  spy_.processes[0].status->startup_ended = 1;
  EXPECT_TRUE(Has("ended        a startup, by a fault: nothing else of the role starts")) << Text();
}

TEST_F(SpyViewTest, AChannelsPageHasItsFieldsWithHistories) {
  FieldHistory history;
  for (int i = 0; i < 8; ++i) {
    history.Take(FieldsOf(
        {{"hip_rad", 0.1 * i}, {"mode", 3}, {"name", "left"}, {"us", 1795994608511400 + i}}));
  }
  fields_.history = &history;
  Press(Code::kEnter);
  const std::string text = Text();
  EXPECT_NE(text.find("walk/m00/STATUS  morphbus.status_t"), std::string::npos) << text;
  EXPECT_NE(text.find("10.00 Hz  period 20ms  jitter 12µs p50, 80µs p99"), std::string::npos);
  EXPECT_NE(text.find("▁▂▃▄▅▆▇█"), std::string::npos) << text;
  EXPECT_NE(text.find("\"left\""), std::string::npos);
  EXPECT_TRUE(Has("1795994608511407", 60)) << Text(60);
  // What never changes has a value and no bars.
  for (const std::string& line : Draw()) {
    if (line.starts_with("mode")) {
      EXPECT_EQ(line.find("▁"), std::string::npos) << line;
    }
  }
}

TEST_F(SpyViewTest, WhatAFieldHasInCommonWithTheOneAboveIsBlank) {
  FieldHistory history;
  history.Take(FieldsOf({{"joints", {{{"mode", 1}, {"speed", 2}}, {{"mode", 3}, {"speed", 4}}}}}));
  fields_.history = &history;
  Press(Code::kEnter);
  const std::vector<std::string> lines = Draw();
  EXPECT_TRUE(lines[5].starts_with("joints[0].mode ")) << Text();
  EXPECT_TRUE(lines[6].starts_with("         .speed")) << Text();
  EXPECT_TRUE(lines[7].starts_with("      [1].mode ")) << Text();
  // The first line in sight has all of its name, wherever the page is scrolled to.
  Press(Code::kDown);
  EXPECT_TRUE(Draw(80, 9)[5].starts_with("joints[0].speed")) << Text(80, 9);
}

TEST_F(SpyViewTest, WhatCannotBeDecodedIsShownAsBytes) {
  FieldHistory history;
  history.Take(FieldsOf({{"old", 1}}));
  fields_.history = &history;
  fields_.problem = "unknown type, fingerprint 0001020304050607: name its .lcm files by --types";
  for (int i = 0; i < 20; ++i) fields_.bytes.push_back(static_cast<uint8_t>(i < 8 ? i : 0x30 + i));
  fields_.size = 5000;
  Press(Code::kEnter);
  EXPECT_TRUE(Has("name its .lcm files by --types")) << Text();
  EXPECT_TRUE(Has("0000  00 01 02 03 04 05 06 07  38 39 3a 3b 3c 3d 3e 3f  ........89:;<=>?"));
  const std::string rest = "0010  40 41 42 43" + std::string(39, ' ') + "@ABC\n";
  EXPECT_TRUE(Has(rest)) << Text();
  EXPECT_TRUE(Has("and 4980 more bytes"));
  EXPECT_FALSE(Has("old"));
  // A narrow terminal has shorter lines, and the hint on several.
  EXPECT_TRUE(Has("0008  38 39 3a 3b  3c 3d 3e 3f  89:;<=>?", 60)) << Text(60);
  EXPECT_TRUE(Has("by --types", 60));
}

TEST_F(SpyViewTest, KeysGiveTheRunsCommands) {
  const auto command = [&](char key) { return Press(key); };
  EXPECT_EQ(command('p'), "pause");
  spy_.runs[0].clock.Take(ClockWith({"pause"}));
  EXPECT_EQ(command(' '), "resume");
  EXPECT_EQ(command('.'), "step 1");
  EXPECT_EQ(command(','), "step 10");
  // Without a command for it, the speed is the power of two that is nearest to what was measured.
  spy_.runs[0].speed = 3.7;
  EXPECT_EQ(command('+'), "speed 2");
  spy_.runs[0].clock.Take(ClockWith({"resume"}));
  EXPECT_EQ(command('+'), "speed 8");
  EXPECT_EQ(command('-'), "speed 2");
  spy_.runs[0].clock.Take(ClockWith({"speed 0.5"}));
  EXPECT_EQ(command('-'), "speed 0.25");
  // What the run has agreed to, and will name once it goes on, counts before that.
  ui_.asked_speed = 4.0;
  EXPECT_EQ(command('+'), "speed 8");
  ui_.asked_speed.reset();
  spy_.runs[0].clock.Take(ClockWith({"speed 0"}));
  EXPECT_EQ(command('-'), "speed 2");
  EXPECT_EQ(command('+'), "speed 0");
  EXPECT_EQ(command('='), "speed 1");
  EXPECT_EQ(command('0'), "speed 0");
  // A run that was paused before the spy came.
  spy_.runs[0].silent_s = 5.0;
  EXPECT_EQ(command('p'), "resume");
}

TEST_F(SpyViewTest, TheLastLineHasTheKeysThatDoSomething) {
  EXPECT_EQ(Draw(120).back(), "? help  q quit  Enter open  / filter  s sort  Tab modules  f freeze")
      << "this run is not ours to command";
  ui_.takes_commands = true;
  EXPECT_NE(Draw(120).back().find("p pause  +- speed  f freeze"), std::string::npos);
  spy_.runs[0].clock.Take(ClockWith({"pause"}));
  EXPECT_NE(Draw(120).back().find("p resume  . step  +- speed"), std::string::npos);
  morphbus::sim_clock_t end = ClockWith({});
  end.phase = morphbus::sim_clock_t::PHASE_END;
  spy_.runs[0].clock.Take(end);
  EXPECT_EQ(Draw(120).back().find("step"), std::string::npos);
  EXPECT_EQ(Draw(120).back().find("speed"), std::string::npos);
  // The modules are not sorted, and Tab leads back from them.
  Press(Code::kTab);
  EXPECT_EQ(Draw(120).back(), "? help  q quit  Enter open  / filter  Tab channels  f freeze");
  Press('f');
  EXPECT_NE(Draw(120).back().find("f go on"), std::string::npos);
  // Where there is but one thing there is no next one, and what fits does not scroll.
  Press(Code::kEnter);
  EXPECT_EQ(Draw(120).back(), "? help  Esc back  ] next  [ previous  f go on");
  EXPECT_EQ(Draw(120, 5).back(), "? help  Esc back  ] next  [ previous  j k scroll  f go on");
  spy_.processes.resize(1);
  EXPECT_EQ(Draw(120).back(), "? help  Esc back  f go on");
  spy_ = SpySnapshot();
  ui_ = SpyUi();
  EXPECT_EQ(Draw(120).back(), "? help  q quit");
}

TEST_F(SpyViewTest, TheHelpHasTheKeysThatDoSomethingInLinesThatFit) {
  Press('?');
  EXPECT_FALSE(Has("pauses the run", 80, 60)) << "this run is not ours to command";
  ui_.takes_commands = true;
  EXPECT_TRUE(Has("pauses the run", 80, 60));
  EXPECT_EQ(Draw(80, 60).back(), "Esc back");
  EXPECT_EQ(Draw(80, 20).back(), "Esc back  j k scroll");
  // No line is too long, whatever the width.
  for (const int width : {80, 60, 40}) {
    for (const ScreenLine& line : HelpLines(spy_, ui_, width)) {
      int cells = 0;
      for (const Span& span : line) cells += Cells(span.text);
      EXPECT_LE(cells, width) << PlainText({line});
    }
    EXPECT_TRUE(Has("median", width, 200)) << Text(width, 200);
  }
}

TEST_F(SpyViewTest, WhatTheRunSaidStandsInTheLastLineUntilTheNextKey) {
  ui_.message = "pause: tick 617";
  EXPECT_EQ(Draw().back(), "pause: tick 617");
  Press(Code::kDown);
  EXPECT_NE(Draw().back().find("? help"), std::string::npos);
}

TEST_F(SpyViewTest, TheHelpScrollsAndEveryOtherKeyLeavesIt) {
  Press('?');
  EXPECT_TRUE(Has("the fields of a channel"));
  EXPECT_FALSE(Has("real time: ticks", 80, 10));
  Press(Code::kEnd);
  EXPECT_TRUE(Has("real time: ticks", 80, 10)) << Text(80, 10);
  Press('q');
  EXPECT_FALSE(ui_.quit);
  EXPECT_EQ(ui_.page, SpyUi::Page::kLists);
  Press('q');
  EXPECT_TRUE(ui_.quit);
}

TEST_F(SpyViewTest, StatesOfTheRunAreSaid) {
  spy_.runs[0].clock.Take(ClockWith({"pause"}));
  EXPECT_TRUE(Has("walk  paused"));
  morphbus::sim_clock_t end = ClockWith({});
  end.phase = morphbus::sim_clock_t::PHASE_END;
  end.end_reason = "finished";
  spy_.runs[0].clock.Take(end);
  EXPECT_TRUE(Has("ended: finished"));
  spy_.runs[0] = RunRow();
  spy_.runs[0].run = "walk";
  spy_.runs[0].silent_s = 7;
  EXPECT_TRUE(Has("silent for 7.0s"));
  ui_.run = "other";
  EXPECT_TRUE(Has("no run of Morphbus heard"));
}

TEST_F(SpyViewTest, AnEmptyBusSaysSo) {
  spy_ = SpySnapshot();
  EXPECT_TRUE(Has("nothing heard yet")) << Text();
  for (const Code code : {Code::kDown, Code::kEnter, Code::kTab, Code::kEnd, Code::kPageUp})
    Press(code);
  EXPECT_EQ(ui_.page, SpyUi::Page::kLists);
  EXPECT_TRUE(Has("nothing heard yet"));
}

TEST_F(SpyViewTest, NamesFromTheBusCannotSteerTheTerminalOrTheLayout) {
  spy_.channels[0].channel = "a\x1b[2J\xc2\x9b\xff\xe6\xbc\xa2\xcc\x81";
  spy_.processes[0].status->role_name = "\x1b]0;x\x07";
  const std::string text = Text(200, 24);
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_EQ(text.find('\x07'), std::string::npos);
  EXPECT_NE(text.find("a\\x1b[2J\\u009b\\xff??"), std::string::npos) << text;
}

}  // namespace
}  // namespace morphbus::tools
