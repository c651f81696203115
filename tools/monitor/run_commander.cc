#include "tools/monitor/run_commander.h"

#include <signal.h>

#include "bridge/control/control_service.h"
#include "compiler/base/text.h"
#include "tools/base/files.h"
#include "tools/launch/control_script.h"

namespace morphbus::tools {

RunCommander::RunCommander(ControlledRun run, std::unique_ptr<bridge::Bus> bus, ProgramTexts* texts)
    : run_(std::move(run)), bus_(std::move(bus)), texts_(*texts) {
  // Signals are for the thread that waits for them.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { Work(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

RunCommander::~RunCommander() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  // The thread wakes, drops what still waits, and ends.
  given_.notify_all();
  thread_.join();
}

void RunCommander::Give(MonitorCommand command) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(std::move(command));
  given_.notify_all();
}

void RunCommander::Work() {
  while (true) {
    MonitorCommand next;
    {
      std::unique_lock lock(mutex_);
      // One command at a time: the next one waits until the run has answered.
      given_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
      if (stop_) return;
      next = std::move(waiting_.front());
      waiting_.pop_front();
    }
    const Result<Json> answer = Do(next);
    next.done(answer ? *answer : Json(), answer ? "" : answer.error().message);
  }
}

Result<Json> RunCommander::Do(const MonitorCommand& given) {
  Result<bridge::ControlCommand> command = bridge::ParseControl(given.text);
  if (!command) return Fail(command.error().message);
  // A program is laid where the sim finds it; the command names it by its hash.
  if (command->kind == bridge::ControlKind::kDeploy) {
    const Result<ProgramTexts::Compiled> program = texts_.Compile(command->program, given.program);
    if (!program) return Fail(program.error().message);
    command->program_hash = program->hash;
    const Result<void> written =
        WriteFile(ImagePath(run_.entry.folder, program->hash), program->image);
    if (!written) return Fail(written.error().message);
  }
  // The canonical words, as CLOCK will name them.
  const std::string text = ControlText(*command);
  // The run adds the time of a deployment that names none.
  constexpr size_t kTimeBytes = 16;
  if (text.size() + kTimeBytes > bridge::kLongestText) return Fail("the command is too long");
  const bridge::Sender sender = {run_.entry.name, "TOOL", run_.plan.description.model_hash(), 0};
  // The answer comes on the bus, which may take seconds; a monitor that ends does not wait for it.
  const Result<bridge::ControlAnswer> answer = bridge::GiveCommand(
      bus_.get(), bridge::MonotonicTime(), sender, run_.key, text, kControlPatienceUs, [this] {
        const std::lock_guard lock(mutex_);
        return stop_;
      });
  if (!answer) return Fail(answer.error().message);
  // What `control --json` prints; a refusal is the caller's to word.
  using State = bridge::ControlAnswer::State;
  if (answer->state == State::kRefused) return Fail(EscapeControl(answer->reason));
  const Result<bridge::ControlCommand> done = bridge::ParseControl(answer->effect);
  Json object = {{"run", run_.entry.name},
                 {"command", done && done->at ? answer->effect : text},
                 {"tick", answer->tick},
                 {"seconds", Seconds(answer->tick * run_.plan.description.tick_us())},
                 {"pending", answer->state == State::kLater},
                 {"refused", nullptr}};
  if (done && done->at) object["switch_seconds"] = *done->at;
  return object;
}

}  // namespace morphbus::tools
