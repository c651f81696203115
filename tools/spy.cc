// morphbus spy: what is on the bus now, in the terminal.

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>

#include "bridge/lcm_bus.h"
#include "tools/commands.h"
#include "tools/control_link.h"
#include "tools/json_text.h"
#include "tools/lcm_sources.h"
#include "tools/run_choice.h"
#include "tools/spy_table.h"
#include "tools/wall_clock.h"

namespace morphbus::tools {
namespace {

struct Options {
  RunChoice run;
  std::string channel;
  double seconds = 0.0;
  double interval = 1.0;
  bool once = false;
  bool json = false;
};

void Show(const Json& spy, const Options& options, bool live) {
  if (options.json) {
    // One object; or, as a stream, one a line.
    fmt::print("{}\n", JsonText(spy, options.once ? 2 : -1));
  } else if (live) {
    winsize size = {};
    ioctl(STDOUT_FILENO, TIOCGWINSZ, &size);
    fmt::print("\033[H\033[J{}",
               SpyText(spy, options.channel, size.ws_col, std::max(0, size.ws_row - 1)));
  } else {
    fmt::print("{}", SpyText(spy, options.channel, 0, 0));
  }
  std::fflush(stdout);
}

int Spy(Options options) {
  if (!std::isfinite(options.seconds) || options.seconds < 0) {
    return Unusable("--seconds: expected a number, 0 or more");
  }
  if (!(options.interval >= 0.05 && options.interval <= 3600)) {
    return Unusable("--interval: expected 0.05 to 3600 seconds");
  }
  const Result<std::string> url = JoinRun(options.run);
  if (!url) return Unusable(url.error().message);
  const Result<std::unique_ptr<bridge::Bus>> bus = bridge::OpenLcmBus(*url);
  if (!bus) return Unusable(bus.error().message);
  Result<LcmSchema> schema = LcmSchema::Parse(LcmSources());
  if (!schema) return Failed(schema.error().message);
  SpyTable table(std::move(*schema));
  const WallTimer timer;
  (*bus)->SubscribePrefix("", [&](std::string_view channel, const uint8_t* data, size_t size) {
    table.Take(channel, data, size, timer.seconds());
  });
  CatchSignals();
  const bool live = !options.json && !options.once && IsFancyTerminal(STDOUT_FILENO);
  // A script gets one table: there is no screen to redraw.
  if (!options.json && !live) options.once = true;
  if (options.once && options.seconds <= 0) options.seconds = options.interval;
  if (options.once) options.interval = options.seconds;
  for (double next = options.interval; CaughtSignal() == 0;) {
    (*bus)->Handle(static_cast<int>(std::clamp((next - timer.seconds()) * 1000.0, 0.0, 50.0)));
    if (timer.seconds() < next) continue;
    table.Roll(timer.seconds());
    Show(table.ToJson(options.channel), options, live);
    if (options.seconds > 0 && timer.seconds() >= options.seconds) break;
    next += options.interval;
    if (std::ferror(stdout) != 0) break;  // the reader is gone
  }
  return kDone;
}

}  // namespace

void AddSpy(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand(
      "spy", "What is on the bus: channels, rates, bandwidth, losses, fields, roles");
  auto options = std::make_shared<Options>();
  AddRunChoice(sub, &options->run);
  sub->add_option("--channel", options->channel,
                  "Show the decoded fields of this channel's last message");
  sub->add_option("--seconds", options->seconds,
                  "Stop after this many seconds (default: until Ctrl-C)");
  sub->add_option("--interval", options->interval, "Seconds between two tables (default: 1)");
  sub->add_flag("--once", options->once, "One table, of --seconds (default: 1), then end");
  sub->add_flag("--json", options->json,
                "JSON on stdout: an object a line, or one object with --once");
  sub->footer(
      "Examples:\n  morphbus spy\n  morphbus spy --run walk --channel walk/m1/STATUS\n"
      "  morphbus spy --once --seconds 2 --json");
  sub->callback([options, action] { *action = [options] { return Spy(*options); }; });
}

}  // namespace morphbus::tools
