// morphbus spy: what is on the bus now, in the terminal.

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <cmath>

#include "bridge/bus/lcm_tap.h"
#include "compiler/base/name_pattern.h"
#include "tools/base/files.h"
#include "tools/base/print.h"
#include "tools/commands/commands.h"
#include "tools/launch/launcher_link.h"
#include "tools/machine/key_choice.h"
#include "tools/machine/run_choice.h"
#include "tools/machine/run_registry.h"
#include "tools/machine/wall_clock.h"
#include "tools/spy/spy_screen.h"
#include "tools/spy/spy_table.h"
#include "tools/spy/spy_terminal.h"
#include "tools/spy/spy_text.h"
#include "tools/spy/type_folder.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus spy`.
struct SpyOptions {
  RunChoice run;
  std::string channel;
  std::vector<std::string> types;
  std::optional<double> seconds;
  double interval = 1.0;
  bool once = false;
  bool json = false;
};

/// Listens until --seconds are over or a signal comes, and prints a table or an object every
/// --interval.
int PrintSpy(bridge::LcmTap* tap, SpyTable* table, SpyOptions options,
             const ChannelFilter& selected) {
  // A script gets one table, for it has no screen to redraw; it is of the whole time.
  if (!options.json) options.once = true;
  double seconds = options.seconds.value_or(0.0);
  if (options.once && seconds <= 0) seconds = options.interval;
  if (options.once) options.interval = seconds;
  const WallTimer timer;
  for (double next = options.interval; CaughtSignal() == 0;) {
    // Waits at most 50 ms at a time, so that a signal ends it at once.
    pollfd ready = {tap->fd(), POLLIN, 0};
    const double wait_ms = std::clamp((next - timer.seconds()) * 1000.0, 0.0, 50.0);
    poll(&ready, 1, static_cast<int>(wait_ms));
    // All that has come so far, with its time of arrival by the kernel.
    tap->Take([&](const bridge::TappedMessage& message) {
      table->Take(message.channel, message.data, message.size, message.arrival_ns);
    });
    if (timer.seconds() < next) continue;
    const SpySnapshot spy = SnapshotNow(*table, *tap);
    // A single object is indented for people; in a stream each object takes one line.
    const std::string text =
        options.json ? JsonText(SpyJson(*table, spy, selected), options.once ? 2 : -1) + "\n"
                     : SpyText(*table, spy, selected);
    PrintText(text);
    if (FlushResult() != 0) break;  // the reader is gone
    // A channel that was asked for and said nothing would else be missing without a word.
    const auto shown = [&](const ChannelRow& row) { return selected(row.channel); };
    if (options.once && !options.channel.empty() && std::ranges::none_of(spy.channels, shown)) {
      Warn(
          fmt::format("--channel {}: heard nothing on such a channel; the pattern must match the "
                      "whole name, as .*/m1/ACTUATOR matches walk/m1/ACTUATOR",
                      options.channel));
    }
    if (seconds > 0 && timer.seconds() >= seconds) break;
    // Counted from the beginning, so that delays of single tables do not add up.
    next += options.interval;
  }
  return kDone;
}

/// On a terminal the screen, elsewhere text.
int Spy(const SpyOptions& options) {
  // Not a number fails both of these.
  const double seconds = options.seconds.value_or(0.0);
  if (!std::isfinite(seconds) || seconds < 0) {
    return Unusable("--seconds: expected a number, 0 or more");
  }
  if (options.once && options.seconds == 0.0) {
    return Unusable("--once --seconds 0: expected more than 0 seconds, or --once alone for 1 s");
  }
  if (!(options.interval >= 0.05 && options.interval <= 3600)) {
    return Unusable("--interval: expected 0.05 to 3600 seconds");
  }
  // A mistake in a pattern or a folder is told before the bus is opened.
  const Result<NamePattern> pattern = NamePattern::Parse(options.channel);
  if (!pattern) return Unusable("--channel " + pattern.error().message);
  const ChannelFilter selected = [&](const std::string& channel) {
    return !options.channel.empty() && pattern->Matches(channel);
  };
  std::vector<std::string> warnings;
  Result<LcmSchema> schema = ReadSchema(options.types, &warnings);
  if (!schema) return Unusable(schema.error().message);
  WarnOfMany(warnings);
  // Key and description are read before the run's network is entered, which may change the user.
  // A bus that is named by its URL alone belongs to no run of this machine.
  const bool elsewhere = options.run.run.empty() && !options.run.lcm_url.empty();
  const Result<RunEntry> own = elsewhere ? Fail("elsewhere") : FindRun(options.run.run);
  const std::string& key_file = options.run.key_file;
  const Result<bridge::RunKey> key = !key_file.empty() ? bridge::RunKey::Read(key_file)
                                     : own             ? bridge::RunKey::Read(KeyPath(own->folder))
                                                       : Fail("none");
  if (!key && !key_file.empty()) return Unusable(key.error().message);
  const std::string description = own ? ReadFile(own->folder + "/description.pb").value_or("") : "";
  // Joining a private network must come before LCM starts its thread.
  const Result<std::string> url = JoinRun(options.run);
  if (!url) return Unusable(url.error().message);
  const Result<std::unique_ptr<bridge::LcmTap>> tap = bridge::LcmTap::Open(*url);
  if (!tap) return Unusable(tap.error().message);
  // All channels, also those of other programs: what is strange on the bus is what the spy is for.
  SpyTable table(std::move(*schema));
  if (key) table.KnowKey(own ? own->name : "", *key);
  if (!description.empty()) table.KnowDescription(description, ArrivalClockNs());
  CatchSignals();
  if (!options.json && !options.once && CanShowScreen()) {
    SpyScreenOptions screen = {options.run, *url, options.interval, seconds, nullptr};
    if (!options.channel.empty()) screen.open = selected;
    const Result<void> shown = ShowSpyScreen(tap->get(), &table, screen);
    if (shown) return kDone;
    // A terminal that cannot show the screen still gets the figures.
    Warn(shown.error().message + "; here is a table");
  }
  return PrintSpy(tap->get(), &table, options, selected);
}

}  // namespace

void AddSpy(CommandLine* line) {
  Subcommand sub =
      line->Add("spy", "What is on the bus: channels, rates, jitter, losses, fields, modules");
  auto options = std::make_shared<SpyOptions>();
  AddRunChoice(&sub, &options->run);
  sub.Add("-e,--channel", &options->channel,
          "Show the decoded fields of the last message of channels whose whole name matches; on "
          "a terminal, opens the first one")
      .TypeName("REGEX");
  sub.Add("--types", &options->types,
          "A folder with the .lcm files of other programs, or such a file; may be repeated")
      .TypeName("FOLDER|FILE.lcm")
      .Repeatable();
  sub.Add("--seconds", &options->seconds, "Stop after this many seconds (default: until q, Ctrl-C)")
      .Seconds();
  sub.Add("--interval", &options->interval, "Seconds between two looks (default: 1)").Seconds();
  sub.Flag("--once", &options->once, "One table, of --seconds (default: 1), then end");
  sub.Flag("--json", &options->json, "JSON on stdout: an object a line, or one object with --once");
  sub.Footer(
      "On a terminal: ? for the keys. Elsewhere, or with TERM=dumb, one plain table.\n"
      "Examples:\n  morphbus spy\n  morphbus spy --run walk --channel 'walk/m1/.*'\n"
      "  morphbus spy --lcm-url udpm://239.255.76.67:7667 --types ~/robot/lcmtypes\n"
      "  morphbus spy --once --seconds 2 --json");
  sub.Do([options] { return Spy(*options); });
}

}  // namespace morphbus::tools
