#include "tools/spy/spy_screen.h"

#include <fmt/format.h>
#include <poll.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <optional>
#include <utility>

#include "bridge/bus/lcm_bus.h"
#include "bridge/control/control_command.h"
#include "compiler/base/text.h"
#include "tools/control/commander.h"
#include "tools/launch/launcher_link.h"
#include "tools/machine/wall_clock.h"
#include "tools/spy/field_history.h"
#include "tools/spy/spy_terminal.h"
#include "tools/spy/spy_view.h"

namespace morphbus::tools {
namespace {

// A bar of a sparkline stands for so long, or for a message of a slower channel.
constexpr double kBarSeconds = 0.2;

/// The state of the screen between two looks.
class SpySession {
 public:
  SpySession(bridge::LcmTap* tap, SpyTable* table, const SpyScreenOptions& options,
             SpyTerminal* terminal)
      : tap_(*tap), table_(*table), options_(options), terminal_(*terminal), commander_([&options] {
          return WayTo(options);
        }) {
    ui_.run = options.run.run;
  }

  void Run() {
    // Something is to be seen at once, even on a bus where nothing is said.
    snapshot_ = SnapshotNow(table_, tap_);
    Draw();
    // Messages are counted as they come; figures and screen change at the chosen interval or at a
    // key.
    while (CaughtSignal() == 0 && !ui_.quit) {
      if (options_.seconds > 0 && timer_.seconds() >= options_.seconds) return;
      if (!Wait()) return;
      tap_.Take([this](const bridge::TappedMessage& message) { Hear(message); });
      ReadKeys();
      HearAnswer();
      if (timer_.seconds() >= next_look_) Look();
      if (dirty_) Draw();
    }
  }

 private:
  /// Waits for a key, a message or the next look; false if the terminal is gone.
  bool Wait() {
    std::array<pollfd, 2> ready = {{{STDIN_FILENO, POLLIN, 0}, {tap_.fd(), POLLIN, 0}}};
    // An answer to a command is looked for ten times a second.
    const double wait = std::clamp(next_look_ - timer_.seconds(), 0.0, 0.1);
    // A change of the window's size interrupts this; ncurses then has a key for it.
    poll(ready.data(), ready.size(), static_cast<int>(wait * 1000) + 1);
    return (ready[0].revents & (POLLHUP | POLLERR | POLLNVAL)) == 0;
  }

  /// A message of the bus.
  void Hear(const bridge::TappedMessage& message) {
    table_.Take(message.channel, message.data, message.size, message.arrival_ns);
    // The channel that was named on the command line is opened when it is first heard.
    if (ui_.channel.empty() && options_.open && options_.open(std::string(message.channel))) {
      ui_.channel = message.channel;
      ui_.page = SpyUi::Page::kChannel;
      FollowSelection();
    }
    if (ui_.page != SpyUi::Page::kChannel || ui_.frozen || message.channel != watched_) return;
    // A fast channel is not decoded more often than the eye can follow.
    if (timer_.seconds() - last_bar_ >= kBarSeconds) TakeFields();
  }

  /// Decodes the last message of the selected channel.
  void TakeFields() {
    Result<MessageFields> last = table_.FieldsOfLast(watched_);
    last_bar_ = timer_.seconds();
    dirty_ = true;
    shown_ = {};
    if (last) return fields_.Take(*std::move(last));
    // What has no fields is shown as its bytes.
    shown_.problem = last.error().message;
    const std::vector<uint8_t>* bytes = table_.BytesOfLast(watched_);
    if (bytes == nullptr) return;
    shown_.size = bytes->size();
    const size_t dumped = std::min(bytes->size(), ShownFields::kMostDumped);
    shown_.bytes.assign(bytes->data(), bytes->data() + dumped);
  }

  /// Another channel was selected: its last message is there already.
  void FollowSelection() {
    // Where no channel's page is open the last one goes on to be watched, so that its history is
    // there when the page is opened again.
    const std::string& wanted = ui_.page == SpyUi::Page::kChannel ? ui_.channel : watched_;
    if (wanted == watched_) return;
    watched_ = wanted;
    table_.Watch(watched_);
    fields_ = FieldHistory();
    TakeFields();
  }

  void ReadKeys() {
    while (const std::optional<Key> key = terminal_.ReadKey()) {
      // What a key means depends on how the run is now, such as paused.
      if (timer_.seconds() - last_look_ > 0.1) Look();
      dirty_ = true;
      const std::string command = Press(*key, snapshot_, &ui_);
      if (!command.empty()) Command(command);
      FollowSelection();
    }
  }

  /// The run to command: another one may have its name by now.
  static Result<std::shared_ptr<Commander::Way>> WayTo(const SpyScreenOptions& options) {
    // A bus that was named without a run may be another host's, where nobody here has the key.
    if (options.run.run.empty() && !options.run.lcm_url.empty()) {
      return Fail("commands need --run: only a run of this machine can be commanded");
    }
    Result<ControlledRun> run = FindControlled(options.run.run);
    if (!run) return tl::unexpected(run.error());
    Result<std::unique_ptr<bridge::Bus>> bus = bridge::OpenLcmBus(options.url);
    if (!bus) return tl::unexpected(bus.error());
    return std::make_shared<Commander::Way>(Commander::Way{std::move(*run), std::move(*bus)});
  }

  /// Whether the keys for commands act on the run that is shown.
  [[nodiscard]] bool TakesCommands(const std::string& run) const {
    if (options_.run.run.empty() && !options_.run.lcm_url.empty()) return false;
    const Result<ControlledRun> found = FindControlled(options_.run.run);
    return found && found->entry.name == run;
  }

  /// Gives a command; one at a time, so that each answer belongs to the last key.
  void Command(const std::string& command) {
    ui_.failed = !given_.empty();
    ui_.message = ui_.failed ? "the last command is still under way" : command + " ...";
    if (ui_.failed) return;
    const Result<bridge::ControlCommand> given = bridge::ParseControl(command);
    if (!given) {
      ui_.failed = true;
      ui_.message = fmt::format("{}: {}", command, Visible(given.error().message));
      return;
    }
    given_ = command;
    given_speed_.reset();
    if (given->kind == bridge::ControlKind::kSpeed) given_speed_ = given->speed;
    commander_.Give({*given, nullptr, [this](const Json& answer, const std::string& refusal) {
                       // This runs in the commander's thread; the screen looks for the answer when
                       // it next wakes.
                       const std::lock_guard lock(mutex_);
                       answer_ = {answer, refusal};
                     }});
  }

  /// What the run said to a command.
  void HearAnswer() {
    std::optional<Answer> heard;
    {
      const std::lock_guard lock(mutex_);
      heard = std::exchange(answer_, std::nullopt);
    }
    if (!heard) return;
    const std::string given = std::exchange(given_, "");
    ui_.failed = !heard->refusal.empty();
    ui_.message = fmt::format("{}: {}", given, Visible(heard->refusal));
    if (!ui_.failed) {
      // In which tick it took effect.
      const Json& answer = heard->answer;
      ui_.message = fmt::format("{}: tick {} ({:.2f} s){}", given, answer["tick"].get<int64_t>(),
                                answer["seconds"].get<double>(),
                                answer["pending"].get<bool>() ? ", once the run goes on" : "");
    }
    dirty_ = true;
    // A paused run names the new speed in CLOCK only when it goes on.
    if (!ui_.failed && given_speed_) ui_.asked_speed = given_speed_;
  }

  /// Takes the figures anew, unless they are to stand still.
  void Look() {
    if (!ui_.frozen) snapshot_ = SnapshotNow(table_, tap_);
    // From now on CLOCK's word on the speed counts.
    const RunRow* run = ShownRun(snapshot_, ui_);
    const std::optional<double> named = run == nullptr ? std::nullopt : run->clock.speed();
    if (named != named_speed_) ui_.asked_speed.reset();
    named_speed_ = named;
    if (run != nullptr && run->run != asked_run_) {
      asked_run_ = run->run;
      ui_.takes_commands = TakesCommands(run->run);
    }
    last_look_ = timer_.seconds();
    // What was missed while nobody looked is not made up for.
    if (next_look_ <= last_look_) {
      next_look_ = std::max(next_look_ + options_.interval_s, last_look_);
    }
    dirty_ = true;
  }

  void Draw() {
    // The size is asked for each time, since the window may have changed.
    const auto [width, height] = terminal_.Size();
    shown_.history = &fields_;
    terminal_.Draw(DrawSpy(snapshot_, shown_, &ui_, width, height));
    dirty_ = false;
  }

  bridge::LcmTap& tap_;
  SpyTable& table_;
  const SpyScreenOptions& options_;
  SpyTerminal& terminal_;
  WallTimer timer_;
  SpyUi ui_;
  SpySnapshot snapshot_;
  FieldHistory fields_;  ///< Of the channel that is watched.
  ShownFields shown_;    ///< What else is known of its last message.
  std::string watched_;
  std::string asked_run_;              ///< The run of which is known whether it takes commands.
  std::string given_;                  ///< The command that is under way; empty: none is.
  std::optional<double> given_speed_;  ///< The speed that it asks for, if it does.
  std::optional<double> named_speed_;  ///< The speed that CLOCK named last.
  double last_bar_ = -1.0;             ///< When a message was decoded last, on `timer_`.
  double last_look_ = 0.0;             ///< When the figures were taken, on `timer_`.
  double next_look_ = 0.25;            ///< The first figures come soon.
  bool dirty_ = true;                  ///< Something has changed since it was drawn.
  /// What became of a command: as Commander tells it, in its thread.
  struct Answer {
    Json answer;
    std::string refusal;
  };
  std::mutex mutex_;  ///< Guards the answer, until it is heard.
  std::optional<Answer> answer_;
  Commander commander_;
};

}  // namespace

int64_t ArrivalClockNs() {
  timespec now = {};
  clock_gettime(CLOCK_REALTIME, &now);
  return int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

SpySnapshot SnapshotNow(const SpyTable& table, const bridge::LcmTap& tap) {
  SpySnapshot snapshot = table.Snapshot(ArrivalClockNs());
  const bridge::TapLosses losses = tap.losses();
  snapshot.missing = losses.missing;
  snapshot.overflowed = losses.overflowed;
  snapshot.incomplete = losses.incomplete;
  snapshot.not_lcm = losses.bad;
  return snapshot;
}

Result<void> ShowSpyScreen(bridge::LcmTap* tap, SpyTable* table, const SpyScreenOptions& options) {
  Result<std::unique_ptr<SpyTerminal>> terminal = SpyTerminal::Open();
  if (!terminal) return Fail(terminal.error().message);
  SpySession(tap, table, options, terminal->get()).Run();
  return {};
}

}  // namespace morphbus::tools
