// morphbus replay: publishes a log again.

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "bridge/bus/lcm_bus.h"
#include "bridge/bus/lcm_url.h"
#include "compiler/base/quantity.h"
#include "compiler/base/text.h"
#include "logger/log/replayer.h"
#include "tools/base/lent_description.h"
#include "tools/base/print.h"
#include "tools/base/terminal_keys.h"
#include "tools/commands/commands.h"
#include "tools/commands/replay_into.h"
#include "tools/launch/launcher_link.h"
#include "tools/machine/network.h"
#include "tools/machine/run_choice.h"
#include "tools/machine/run_registry.h"

namespace morphbus::tools {
namespace {

constexpr double kLatestSeconds = 1e9;  ///< Of a range; far beyond any log.

/// The options of `morphbus replay`; `replay` holds those that the replayer itself takes.
struct ReplayOptions {
  std::string log;
  std::string description;  ///< A file or log with one (--description).
  logger::ReplayOptions replay;
  std::optional<double> to_s;  ///< End of the range; none: the log's.
  RunChoice run;
  bool isolate = false;
  bool json = false;
  std::string into;            ///< Module to run again instead; empty: the log is published.
  std::optional<double> at_s;  ///< With it: when its state is shown.
  std::string steps;           ///< With both: how finely that tick's steps are shown.
  std::string break_at;        ///< With --into: the source line at which it is shown.
};

/// A replay as the user steers it.
struct Session {
  bool fancy = false;                ///< Shows where it is.
  std::optional<TerminalKeys> keys;  ///< Takes keys.
  volatile bool stop = false;
  bool stdin_ended = false;  ///< While it waited for a key.
};

/// What the keys do, for the user.
constexpr const char* kKeys =
    "space: pause, go on; .: one tick; left, right: 1 s; page up, down: 10 s; home: to the start; "
    "+, -: speed; q: quit";

/// How far the arrows and the page keys go, seconds.
constexpr double kShortWay = 1.0;
constexpr double kLongWay = 10.0;
/// The speeds that + and - reach, times the robot's pace.
constexpr double kSlowest = 1.0 / 64;
constexpr double kFastestReplay = 64;

/// Half or double the speed; from as fast as possible (0) the slower one is the fastest of these.
double NextSpeed(double speed, bool faster) {
  if (speed <= 0) return faster ? 0.0 : kFastestReplay;
  // A speed that --speed put outside of the range may stay there, but goes no farther.
  return std::clamp(faster ? speed * 2 : speed / 2, std::min(speed, kSlowest),
                    std::max(speed, kFastestReplay));
}

/// Does what a key asks for.
void Obey(const TerminalKey& key, logger::Replayer* replayer, Session* session) {
  // Seeking and resuming begin a new schedule at this moment, on the clock by which the replayer
  // sends.
  const int64_t now_us = bridge::MonotonicTime().NowUs();
  const double time_s = replayer->progress().time_s;
  switch (key.kind) {
    case TerminalKey::Kind::kLeft:
      return replayer->Seek(time_s - kShortWay, now_us);
    case TerminalKey::Kind::kRight:
      return replayer->Seek(time_s + kShortWay, now_us);
    case TerminalKey::Kind::kPageUp:
      return replayer->Seek(time_s - kLongWay, now_us);
    case TerminalKey::Kind::kPageDown:
      return replayer->Seek(time_s + kLongWay, now_us);
    case TerminalKey::Kind::kHome:
      return replayer->Seek(0, now_us);
    case TerminalKey::Kind::kOther:
      return;
    case TerminalKey::Kind::kCharacter:
      break;
  }
  // Space and Enter pause a replay that runs, and resume one that is paused.
  if (key.character == ' ' || key.character == '\n' || key.character == '\r') {
    return replayer->paused() ? replayer->Resume(now_us) : replayer->Pause(now_us);
  }
  if (key.character == '.') {
    // A replay that runs is paused by it, and goes on by one tick.
    if (!replayer->paused()) replayer->Pause(now_us);
    return replayer->Step();
  }
  if (key.character == '+' || key.character == '=' || key.character == '-') {
    return replayer->SetSpeed(NextSpeed(replayer->speed(), key.character != '-'), now_us);
  }
  if (key.character == 'q') session->stop = true;
}

/// Says what people did to the run in the ticks that were passed.
void TellCommands(logger::Replayer* replayer) {
  for (const logger::ClockCommand& command : replayer->TakeCommands()) {
    Say("{:.2f} s, tick {}: {}\n", Seconds(command.time_us), command.tick,
        EscapeControl(command.text));
  }
}

/// Called ten times a second: shows where we are and what was commanded there, takes keys and
/// Ctrl-C.
void Attend(logger::Replayer* replayer, Session* session) {
  TellCommands(replayer);
  if (CaughtSignal() != 0) session->stop = true;
  while (session->keys && !session->stop) {
    const std::optional<TerminalKey> key = session->keys->Next();
    if (!key) break;
    Obey(*key, replayer, session);
  }
  // Paused and without an input from which a key could come, it would wait for ever.
  if (session->keys && session->keys->ended()) {
    session->keys.reset();
    session->stdin_ended = replayer->paused() && !session->stop;
    if (session->stdin_ended) session->stop = true;
  }
  // The line is drawn over itself, with the sim time up to which messages were published.
  if (!session->fancy) return;
  const logger::ReplayProgress& progress = replayer->progress();
  const double speed = replayer->speed();
  ShowPassing(fmt::format("{:.2f} of {:.2f} s, {}, {} messages{}", progress.time_s, progress.end_s,
                          speed > 0 ? fmt::format("{:g} x", speed) : "as fast as possible",
                          progress.published,
                          replayer->paused() ? ", paused (space goes on)" : ""));
}

/// Why the options cannot be used; empty if they can.
std::string WhyUnusable(const ReplayOptions& options) {
  // Not a number fails all of these comparisons.
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
  // An empty range would replay nothing and look like an empty log.
  if (options.to_s && *options.to_s <= replay.from_s) {
    return fmt::format("--from {} --to {}: the range is empty; --to must be the later time",
                       replay.from_s, *options.to_s);
  }
  // Each of the two chooses the network in which listeners will look for the messages.
  if (options.isolate && !options.run.run.empty()) {
    return "--run joins a run's network and --isolate makes a new one: leave one of them out";
  }
  if (replay.wait_for < 0) return "--wait-for: expected a number of listeners, 0 or more";
  return "";
}

/// The place that "12" or "lib.dyn:12" names; line 0 if it names none.
vm::SourcePlace PlaceIn(const std::string& text) {
  const size_t colon = text.rfind(':');
  const size_t begin = colon == std::string::npos ? 0 : colon + 1;
  const auto line = ReadNumber<int>(std::string_view(text).substr(begin));
  return {begin == 0 ? "" : text.substr(0, colon), line.value_or(0)};
}

/// Why --into and --at do not go with the other options; empty if they do.
std::string WhyNotInto(const ReplayOptions& options) {
  if (!options.steps.empty() && !options.at_s) return "--steps needs --at T, the time of a tick";
  const bool breaks = !options.break_at.empty();
  if (options.into.empty() && breaks) return "--break needs --into MODULE";
  if (options.into.empty()) return options.at_s ? "--at needs --into MODULE" : "";
  if (breaks && options.at_s) return "--break and --at: give one of them";
  if (breaks && PlaceIn(options.break_at).line < 1) {
    return "--break: expected a line, 1 or more, perhaps behind the name of an imported file: "
           "lib.dyn:12";
  }
  const logger::ReplayOptions standard;
  const logger::ReplayOptions& replay = options.replay;
  // Options that a rerun has no use for; --break takes --from and --to, for itself.
  const std::pair<const char*, bool> given[] = {
      {"--speed", replay.speed != standard.speed},
      {"--from", replay.from_s != standard.from_s && !breaks},
      {"--to", options.to_s.has_value() && !breaks},
      {"--channel", !replay.channel.empty()},
      {"--loop", replay.loop},
      {"--paused", replay.paused},
      {"--wait-for", replay.wait_for != 0},
      {"--run", !options.run.run.empty()},
      {"--isolate", options.isolate},
      {"--lcm-url", !options.run.lcm_url.empty()}};
  for (const auto& [name, is_given] : given) {
    if (is_given) return fmt::format("--into publishes nothing: leave out {}", name);
  }
  return "";
}

/// What the user should know of a log that was replayed.
void WarnOf(const ReplayOptions& options, const logger::ReplayProgress& done) {
  // Nothing was published, since the log ends before the range begins.
  if (options.replay.from_s > done.end_s) {
    Warn(fmt::format("--from {}: {} ends at {:.2f} s", options.replay.from_s, options.log,
                     done.end_s));
  }
  // Damage in the file's framing is told apart from messages whose own bytes are wrong: the former
  // were left out, the latter published as they stand.
  if (done.damaged > 0) {
    Warn(fmt::format("{}: {} in the file read past", options.log,
                     Counted(done.damaged, "damaged place")));
  }
  if (done.damaged_messages > 0) {
    Warn(fmt::format("{}: {} in the file, not mended (morphbus verify names the places)",
                     options.log, Counted(done.damaged_messages, "damaged message")));
  }
}

/// Makes a private network for the replay and lists it among the runs, so that others can join it.
Result<RunDirectory> Isolate(const ReplayOptions& options) {
  if (Result<void> entered = EnterPrivateNetwork(); !entered) return Fail(entered.error().message);
  // The URL is stored as it was resolved, for others may have another default.
  const Result<bridge::LcmUrl> url = bridge::ResolveLcmUrl(options.run.lcm_url);
  if (!url) return Fail(url.error().message);
  Result<RunDirectory> directory = RunDirectory::Claim("");
  if (!directory) return directory;
  const std::string log = std::filesystem::absolute(options.log).lexically_normal();
  const Result<void> published = directory->Publish(
      {directory->name(), getpid(), WallTime(), "(replay)", log, url->url, true});
  if (!published) return Fail(published.error().message);
  Say("in a private network: morphbus spy --run {} looks into it\n", directory->name());
  return directory;
}

/// Opens the bus, replays, and says what was published and what was not.
int ReplayLog(ReplayOptions options) {
  // The options are checked first; the network and the log come after.
  if (const std::string why = WhyNotInto(options); !why.empty()) return Unusable(why);
  if (!options.into.empty()) {
    return RunAgain({.log = options.log,
                     .description = options.description,
                     .module = options.into,
                     .at_s = options.at_s,
                     .steps = options.steps,
                     .break_at = PlaceIn(options.break_at),
                     .from_s = options.replay.from_s,
                     .to_s = options.to_s,
                     .json = options.json});
  }
  if (const std::string why = WhyUnusable(options); !why.empty()) return Unusable(why);
  // The replayer takes a negative end for the log's own.
  options.replay.to_s = options.to_s.value_or(-1.0);
  Result<std::string> description = LentDescription(options.description);
  if (!description) return Unusable(description.error().message);
  options.replay.description = std::move(*description);
  // The directory lists the replay among the runs for as long as this function runs.
  std::optional<RunDirectory> listed;
  if (options.isolate) {
    Result<RunDirectory> isolated = Isolate(options);
    if (!isolated) return Unusable(isolated.error().message);
    listed.emplace(std::move(*isolated));
  }
  // Before any thread: a process with threads cannot change its network.
  Result<std::string> url = options.run.lcm_url;
  if (!options.run.run.empty()) url = JoinRun(options.run);
  if (!url) return Unusable(url.error().message);
  const Result<std::unique_ptr<bridge::Bus>> bus = bridge::OpenLcmBus(*url);
  if (!bus) return Unusable(bus.error().message);
  CatchSignals();
  // A terminal shows progress and takes keys; a script only gets the result.
  Session session;
  session.fancy = IsFancyTerminal(STDERR_FILENO);
  // With --paused keys are read from a pipe as well, so that scripts can steer a replay.
  if (options.replay.paused || isatty(STDIN_FILENO) == 1) session.keys.emplace(STDIN_FILENO);
  if (session.fancy && isatty(STDIN_FILENO) == 1) Say("{}\n", kKeys);
  const Result<logger::ReplayProgress> done =
      logger::Replay(options.log, options.replay, bus->get(), &session.stop,
                     [&](logger::Replayer* replayer) { Attend(replayer, &session); });
  session.keys.reset();
  // The line of progress goes before anything else is printed.
  ShowPassing("");
  if (!done) return Unusable(done.error().message);
  // The replay was stopped because no key could have resumed it.
  if (session.stdin_ended) {
    return Unusable(
        "the replay waits for a key, but its input has ended: run it in a terminal, or "
        "leave out --paused");
  }
  // What was withheld would have steered a robot; what was filtered out, the user did not want.
  if (options.json) {
    PrintJson({{"published", done->published},
               {"withheld", done->withheld},
               {"filtered", done->filtered},
               {"damaged", done->damaged},
               {"damaged_messages", done->damaged_messages},
               {"loops", done->loops},
               {"seconds", done->time_s}});
  } else {
    Print("{} published, {} filtered out, {} withheld; up to {:.2f} s\n",
          Counted(done->published, "message"), done->filtered, done->withheld, done->time_s);
  }
  WarnOf(options, *done);
  return kDone;
}

}  // namespace

void AddReplay(CommandLine* line) {
  Subcommand sub = line->Add("replay", "Publish a log again, for our tools and LCM's");
  auto options = std::make_shared<ReplayOptions>();
  logger::ReplayOptions* replay = &options->replay;
  sub.Add("LOG", &options->log, "Log file").Required();
  sub.Add("-s,--speed", &replay->speed,
          "Times the robot's pace; 0: as fast as listeners follow (default: 1)");
  sub.Add("--from", &replay->from_s, "Sim time to begin at, seconds").Seconds();
  sub.Add("--to", &options->to_s, "Sim time to end before, seconds").Seconds();
  sub.Add("-e,--channel", &replay->channel, "Only channels whose whole name matches")
      .TypeName("REGEX");
  sub.Flag("--loop", &replay->loop, "Begin again at the end, until Ctrl-C");
  sub.Flag("--paused", &replay->paused, "Wait for the space bar before the first message");
  sub.Add("--wait-for", &replay->wait_for,
          "Wait until so many listeners asked for the description");
  sub.Description(&options->description);
  sub.Add("--run", &options->run.run, "Publish into this run's private network").TypeName("RUN");
  sub.Flag("--isolate", &options->isolate, "A private network of its own");
  sub.Add("-l,--lcm-url", &options->run.lcm_url,
          "LCM URL (default: $LCM_DEFAULT_URL, else LCM's own)")
      .TypeName("URL");
  sub.Add("--into", &options->into,
          "Publish nothing: run this module's program again on what it sensed and heard, and "
          "compare all that it says")
      .TypeName("MODULE");
  sub.Add("--at", &options->at_s,
          "With --into: show role, fields, joints and tasks at this sim time, seconds")
      .Seconds();
  sub.Add("--steps", &options->steps,
          "With --at: also all that the module's tasks do in that tick, by source lines or by "
          "instructions")
      .TypeName("lines|instructions");
  sub.Add("--break", &options->break_at,
          "With --into: show calls, variables and fields whenever a task comes to this source line "
          "(between --from and --to)")
      .TypeName("[FILE:]LINE");
  sub.Flag("--json", &options->json, "One JSON object on stdout at the end");
  sub.Footer(
      std::string("Keys in a terminal: ") + kKeys +
      "\nExamples:\n  morphbus replay walk.log\n  morphbus replay walk.log --speed 0 --from 5 --to "
      "10\n"
      "  morphbus replay walk.log --channel 'walk/.*/STATUS' --loop\n"
      "  morphbus replay walk.log --into m2 --at 2.5 --steps lines");
  sub.Do([options] { return ReplayLog(*options); });
}

}  // namespace morphbus::tools
