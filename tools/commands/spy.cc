// morphbus spy: what is on the bus now, in the terminal.

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <regex>

#include "bridge/bus/lcm_bus.h"
#include "tools/commands/commands.h"
#include "tools/launch/control_link.h"
#include "tools/launch/run_choice.h"
#include "tools/launch/wall_clock.h"
#include "tools/spy/lcm_sources.h"
#include "tools/spy/spy_table.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus spy`.
struct SpyOptions {
  RunChoice run;
  std::string channel;
  double seconds = 0.0;
  double interval = 1.0;
  bool once = false;
  bool json = false;
};

/// One table or object. A live table is drawn over the last one.
void Show(const Json& spy, const SpyOptions& options, bool live) {
  if (options.json) {
    // A single object is indented for people; in a stream each object takes one line.
    fmt::print("{}\n", JsonText(spy, options.once ? 2 : -1));
  } else if (live) {
    // The window may have changed since the last table. One line stays free for the cursor.
    winsize size = {};
    ioctl(STDOUT_FILENO, TIOCGWINSZ, &size);
    fmt::print("\033[H\033[J{}",
               SpyText(spy, options.channel, size.ws_col, std::max(0, size.ws_row - 1)));
  } else {
    fmt::print("{}", SpyText(spy, options.channel, 0, 0));
  }
  std::fflush(stdout);
}

/// Listens until --seconds are over or a signal comes, and shows a table every --interval.
int Spy(SpyOptions options) {
  // Not a number fails both of these.
  if (!std::isfinite(options.seconds) || options.seconds < 0) {
    return Unusable("--seconds: expected a number, 0 or more");
  }
  if (!(options.interval >= 0.05 && options.interval <= 3600)) {
    return Unusable("--interval: expected 0.05 to 3600 seconds");
  }
  std::regex pattern;
  try {
    pattern = options.channel;
  } catch (const std::regex_error& error) {
    return Unusable(
        fmt::format("--channel '{}' is no regular expression: {}", options.channel, error.what()));
  }
  const ChannelFilter selected = [&](const std::string& channel) {
    return !options.channel.empty() && std::regex_match(channel, pattern);
  };
  // Joining a private network must come before LCM starts its thread.
  const Result<std::string> url = JoinRun(options.run);
  if (!url) return Unusable(url.error().message);
  const Result<std::unique_ptr<bridge::Bus>> bus = bridge::OpenLcmBus(*url);
  if (!bus) return Unusable(bus.error().message);
  Result<LcmSchema> schema = LcmSchema::Parse(LcmSources());
  if (!schema) return Failed(schema.error().message);
  // All channels, also those of other programs: what is strange on the bus is what one looks for.
  SpyTable table(std::move(*schema));
  const WallTimer timer;
  (*bus)->SubscribePrefix("", [&](std::string_view channel, const uint8_t* data, size_t size) {
    table.Take(channel, data, size, timer.seconds());
  });
  CatchSignals();
  // A terminal gets a table that is drawn again and again. A script gets one table, for it has no
  // screen to redraw.
  const bool live = !options.json && !options.once && IsFancyTerminal(STDOUT_FILENO);
  if (!options.json && !live) options.once = true;
  // One table is of the whole time, so its interval is that time.
  if (options.once && options.seconds <= 0) options.seconds = options.interval;
  if (options.once) options.interval = options.seconds;
  // Waits at most 50 ms at a time, so that a signal ends it at once.
  for (double next = options.interval; CaughtSignal() == 0;) {
    (*bus)->Handle(static_cast<int>(std::clamp((next - timer.seconds()) * 1000.0, 0.0, 50.0)));
    if (timer.seconds() < next) continue;
    table.Roll(timer.seconds());
    Show(table.ToJson(selected), options, live);
    if (options.seconds > 0 && timer.seconds() >= options.seconds) break;
    next += options.interval;
    if (std::ferror(stdout) != 0) break;  // the reader is gone
  }
  return kDone;
}

}  // namespace

void AddSpy(CommandLine* line) {
  Subcommand sub =
      line->Add("spy", "What is on the bus: channels, rates, bandwidth, losses, fields, roles");
  auto options = std::make_shared<SpyOptions>();
  AddRunChoice(&sub, &options->run);
  sub.Add("-e,--channel", &options->channel,
          "Show the decoded fields of the last message of channels whose whole name matches")
      .TypeName("REGEX");
  sub.Add("--seconds", &options->seconds, "Stop after this many seconds (default: until Ctrl-C)");
  sub.Add("--interval", &options->interval, "Seconds between two tables (default: 1)");
  sub.Flag("--once", &options->once, "One table, of --seconds (default: 1), then end");
  sub.Flag("--json", &options->json, "JSON on stdout: an object a line, or one object with --once");
  sub.Footer(
      "Examples:\n  morphbus spy\n  morphbus spy --run walk --channel 'walk/m1/.*'\n"
      "  morphbus spy --once --seconds 2 --json");
  sub.Do([options] { return Spy(*options); });
}

}  // namespace morphbus::tools
