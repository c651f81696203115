#include "tools/control/commander.h"

#include <signal.h>

#include <utility>

#include "bridge/control/control_service.h"
#include "compiler/base/text.h"

namespace morphbus::tools {

Result<bridge::ControlAnswer> GiveTo(const ControlledRun& run, bridge::Bus* bus,
                                     const bridge::ControlCommand& command,
                                     const std::function<bool()>& stop) {
  // Tools share one name: the sim tells commands apart by their counters, and not by who gave them.
  const bridge::Sender sender = {run.entry.name, "TOOL", run.plan.description.model_hash(), 0};
  return bridge::GiveCommand(bus, bridge::MonotonicTime(), sender, run.key, command,
                             kControlPatienceUs, stop);
}

Json AnswerJson(const ControlledRun& run, const bridge::ControlAnswer& answer) {
  using State = bridge::ControlAnswer::State;
  const bool refused = answer.state == State::kRefused;
  const double seconds = Seconds(answer.tick * run.plan.description.tick_us());
  Json object = {{"run", run.entry.name},
                 {"command", answer.command},
                 {"tick", refused ? Json(nullptr) : Json(answer.tick)},
                 {"seconds", refused ? Json(nullptr) : Json(seconds)},
                 {"pending", answer.state == State::kLater},
                 {"refused", refused ? Json(answer.reason) : Json(nullptr)}};
  // A deployment takes effect when all modules go over to the program.
  if (answer.at) object["switch_seconds"] = *answer.at;
  return object;
}

Commander::Commander(Find find) : find_(std::move(find)) {
  // Signals are for the thread that waits for them.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { Work(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

Commander::~Commander() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  // The thread wakes, drops what still waits, and ends.
  given_.notify_all();
  thread_.join();
}

void Commander::Give(WaitingCommand command) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(std::move(command));
  given_.notify_all();
}

void Commander::Work() {
  while (true) {
    // The lock is not held while a command is given, so that others can be put behind it meanwhile.
    WaitingCommand next;
    {
      std::unique_lock lock(mutex_);
      // One command at a time: the next one waits until the run has answered.
      given_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
      if (stop_) return;
      next = std::move(waiting_.front());
      waiting_.pop_front();
    }
    const auto done = std::move(next.done);
    const Result<Json> answer = Do(std::move(next));
    done(answer ? *answer : Json(), answer ? "" : answer.error().message);
  }
}

Result<Json> Commander::Do(WaitingCommand given) {
  // The run is found anew for each command: the one before may have ended since.
  const Result<std::shared_ptr<Way>> way = find_();
  if (!way) return tl::unexpected(way.error());
  const ControlledRun& run = (*way)->run;
  // A deployment lacks its image until the run is known in whose folder that is laid.
  if (given.complete) {
    if (Result<void> whole = given.complete(run, &given.command); !whole) {
      return tl::unexpected(whole.error());
    }
  }
  // The answer comes on the bus, which may take seconds; who ends does not wait for it.
  const Result<bridge::ControlAnswer> answer =
      GiveTo(run, (*way)->bus.get(), given.command, [this] {
        const std::lock_guard lock(mutex_);
        return stop_;
      });
  if (!answer) return tl::unexpected(answer.error());
  // A refusal is the caller's to word.
  if (answer->state == bridge::ControlAnswer::State::kRefused) {
    return Fail(EscapeControl(answer->reason));
  }
  return AnswerJson(run, *answer);
}

}  // namespace morphbus::tools
