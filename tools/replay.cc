// morphbus replay: publishes a log again.

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <cerrno>
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

constexpr double kLatestSeconds = 1e9;  ///< Of a range; far beyond any log.

struct Options {
  std::string log;
  logger::ReplayOptions replay;
  std::optional<double> to_s;  ///< End of the range; none: the log's.
  RunChoice run;
  bool isolate = false;
  bool json = false;
};

enum class Typed { kNothing, kLine, kEnd };

/// What stands on stdin: a line (Enter goes on, or holds), or that no line will ever come.
Typed ReadTyped() {
  pollfd fd = {STDIN_FILENO, POLLIN, 0};
  if (poll(&fd, 1, 0) != 1 || fd.revents == 0) return Typed::kNothing;
  char buffer[256];
  const ssize_t n = read(STDIN_FILENO, buffer, sizeof buffer);
  if (n < 0 && (errno == EINTR || errno == EAGAIN)) return Typed::kNothing;
  return n > 0 ? Typed::kLine : Typed::kEnd;
}

/// A replay as the user steers it.
struct Session {
  bool fancy = false;        ///< Shows where it is.
  bool interactive = false;  ///< Takes Enter.
  volatile bool stop = false;
  bool stdin_ended = false;  ///< While it waited for Enter.
};

/// Called ten times a second: shows where we are, takes Enter and Ctrl-C.
void Attend(logger::Replayer* replayer, Session* session) {
  if (CaughtSignal() != 0) session->stop = true;
  const Typed typed = session->interactive ? ReadTyped() : Typed::kNothing;
  if (typed == Typed::kEnd) {
    session->interactive = false;
    session->stdin_ended = replayer->paused();
    if (session->stdin_ended) session->stop = true;
  }
  if (typed == Typed::kLine) {
    const int64_t now_us = bridge::MonotonicTime().NowUs();
    if (replayer->paused()) {
      replayer->Resume(now_us);
    } else {
      replayer->Pause(now_us);
    }
  }
  if (!session->fancy) return;
  const logger::ReplayProgress& progress = replayer->progress();
  fmt::print(stderr, "\r\033[K{:.2f} s, {} messages{}", progress.time_s, progress.published,
             replayer->paused() ? ", paused (Enter goes on)" : "");
  std::fflush(stderr);
}

/// Why the options cannot be used; empty if they can.
std::string WhyUnusable(const Options& options) {
  const logger::ReplayOptions& replay = options.replay;
  if (!std::isfinite(replay.speed) || replay.speed < 0) {
    return "--speed: expected times real time, or 0 for as fast as possible";
  }
  for (const auto& [name, time_s] : {std::pair("--from", replay.from_s),
                                     std::pair("--to", options.to_s.value_or(replay.from_s + 1))}) {
    if (!(time_s >= 0 && time_s <= kLatestSeconds)) {
      return fmt::format("{} {}: expected a sim time, 0 to {} seconds", name, time_s,
                         kLatestSeconds);
    }
  }
  if (options.to_s && *options.to_s <= replay.from_s) {
    return fmt::format("--from {} --to {}: the range is empty; --to must be the later time",
                       replay.from_s, *options.to_s);
  }
  if (replay.wait_for < 0) return "--wait-for: expected a number of listeners, 0 or more";
  return "";
}

/// What the user should know of a log that was replayed.
void WarnOf(const Options& options, const logger::ReplayProgress& done) {
  if (options.replay.from_s > done.end_s) {
    Warn(fmt::format("--from {}: {} ends at {:.2f} s", options.replay.from_s, options.log,
                     done.end_s));
  }
  if (done.damaged > 0) {
    Warn(fmt::format("{}: {} in the file read past", options.log,
                     Plural(static_cast<size_t>(done.damaged), "damaged place")));
  }
  if (done.damaged_messages > 0) {
    Warn(fmt::format("{}: {} in the file, not mended (morphbus verify names the places)",
                     options.log,
                     Plural(static_cast<size_t>(done.damaged_messages), "damaged message")));
  }
}

int ReplayLog(Options options) {
  if (const std::string why = WhyUnusable(options); !why.empty()) return Unusable(why);
  options.replay.to_s = options.to_s.value_or(-1.0);
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
  Session session;
  session.fancy = IsFancyTerminal(STDERR_FILENO);
  session.interactive = options.replay.paused || isatty(STDIN_FILENO) == 1;
  const Result<logger::ReplayProgress> done =
      logger::Replay(options.log, options.replay, bus->get(), &session.stop,
                     [&](logger::Replayer* replayer) { Attend(replayer, &session); });
  if (session.fancy) fmt::print(stderr, "\r\033[K");
  if (!done) return Unusable(done.error().message);
  if (session.stdin_ended) {
    return Unusable(
        "the replay waits for Enter, but its input has ended: run it in a terminal, or "
        "leave out --paused");
  }
  if (options.json) {
    PrintJson({{"published", done->published},
               {"withheld", done->withheld},
               {"filtered", done->filtered},
               {"damaged", done->damaged},
               {"damaged_messages", done->damaged_messages},
               {"loops", done->loops},
               {"seconds", done->time_s}});
  } else {
    fmt::print("{} messages published, {} filtered out, {} withheld; up to {:.2f} s\n",
               done->published, done->filtered, done->withheld, done->time_s);
  }
  WarnOf(options, *done);
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
  sub->add_option("--to", options->to_s, "Sim time to end before, seconds");
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
