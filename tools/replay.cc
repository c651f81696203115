// morphbus replay: publishes a log again.

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdio>

#include "bridge/lcm_bus.h"
#include "logger/replayer.h"
#include "tools/commands.h"
#include "tools/control_link.h"
#include "tools/network.h"
#include "tools/run_choice.h"

namespace morphbus::tools {
namespace {

struct Options {
  std::string log;
  logger::ReplayOptions replay;
  RunChoice run;
  bool isolate = false;
  bool json = false;
};

/// A line typed on stdin: Enter goes on, or holds.
bool LineTyped() {
  pollfd fd = {STDIN_FILENO, POLLIN, 0};
  if (poll(&fd, 1, 0) != 1 || (fd.revents & POLLIN) == 0) return false;
  char buffer[256];
  return read(STDIN_FILENO, buffer, sizeof buffer) > 0;
}

/// Called ten times a second: shows where we are, takes Enter and Ctrl-C.
void Attend(logger::Replayer* replayer, bool fancy, bool interactive, volatile bool* stop) {
  if (CaughtSignal() != 0) *stop = true;
  if (interactive && LineTyped()) {
    const int64_t now_us = bridge::MonotonicTime().NowUs();
    if (replayer->paused()) {
      replayer->Resume(now_us);
    } else {
      replayer->Pause(now_us);
    }
  }
  if (!fancy) return;
  const logger::ReplayProgress& progress = replayer->progress();
  fmt::print(stderr, "\r\033[K{:.2f} s, {} messages{}", progress.time_s, progress.published,
             replayer->paused() ? ", paused (Enter goes on)" : "");
  std::fflush(stderr);
}

int ReplayLog(const Options& options) {
  if (!std::isfinite(options.replay.speed) || options.replay.speed < 0) {
    return Unusable("--speed: expected times real time, or 0 for as fast as possible");
  }
  if (options.isolate) {
    if (Result<void> entered = EnterPrivateNetwork(); !entered)
      return Unusable(entered.error().message);
  }
  Result<std::string> url = options.run.lcm_url;
  if (!options.run.run.empty()) url = JoinRun(options.run);
  if (!url) return Unusable(url.error().message);
  const Result<std::unique_ptr<bridge::Bus>> bus = bridge::OpenLcmBus(*url);
  if (!bus) return Unusable(bus.error().message);
  CatchSignals();
  volatile bool stop = false;
  const bool fancy = IsFancyTerminal(STDERR_FILENO);
  const bool interactive = options.replay.paused || isatty(STDIN_FILENO) == 1;
  const Result<logger::ReplayProgress> done = logger::Replay(
      options.log, options.replay, bus->get(), &stop,
      [&](logger::Replayer* replayer) { Attend(replayer, fancy, interactive, &stop); });
  if (fancy) fmt::print(stderr, "\r\033[K");
  if (!done) return Unusable(done.error().message);
  if (options.json) {
    PrintJson({{"published", done->published},
               {"withheld", done->withheld},
               {"filtered", done->filtered},
               {"damaged", done->damaged},
               {"loops", done->loops},
               {"seconds", done->time_s}});
  } else {
    fmt::print("{} messages published, {} filtered out, {} withheld; up to {:.2f} s\n",
               done->published, done->filtered, done->withheld, done->time_s);
  }
  if (done->damaged > 0)
    Warn(fmt::format("{}: {} in the file read past", options.log,
                     Plural(static_cast<size_t>(done->damaged), "damaged place")));
  return kDone;
}

}  // namespace

void AddReplay(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand("replay", "Publish a log again, for our tools and LCM's");
  auto options = std::make_shared<Options>();
  logger::ReplayOptions* replay = &options->replay;
  sub->add_option("LOG", options->log, "Log file")->required();
  sub->add_option("-s,--speed", replay->speed,
                  "Times the robot's pace; 0: as fast as listeners follow (default: 1)");
  sub->add_option("--from", replay->from_s, "Sim time to begin at, seconds");
  sub->add_option("--to", replay->to_s, "Sim time to end before, seconds");
  sub->add_option("-e,--channel", replay->channel, "Only channels whose whole name matches")
      ->type_name("REGEX");
  sub->add_flag("--loop", replay->loop, "Begin again at the end, until Ctrl-C");
  sub->add_flag("--paused", replay->paused, "Wait for Enter before the first message");
  sub->add_option("--wait-for", replay->wait_for,
                  "Wait until so many listeners asked for the description");
  sub->add_option("--run", options->run.run, "Publish into this run's private network");
  sub->add_flag("--isolate", options->isolate, "A private network of its own");
  sub->add_option("-l,--lcm-url", options->run.lcm_url,
                  "LCM URL (default: $LCM_DEFAULT_URL, else LCM's own)");
  sub->add_flag("--json", options->json, "One JSON object on stdout at the end");
  sub->footer(
      "Examples:\n  morphbus replay walk.log\n  morphbus replay walk.log --speed 0 --from 5 --to "
      "10\n"
      "  morphbus replay walk.log --channel 'walk/.*/STATUS' --loop");
  sub->callback([options, action] { *action = [options] { return ReplayLog(*options); }; });
}

}  // namespace morphbus::tools
