#include <fmt/format.h>
#include <morphbus/run/run.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <system_error>

#include "bridge/lockstep/participant.h"
#include "sim/arithmetic.h"
#include "tools/base/print.h"
#include "tools/launch/inproc_run.h"
#include "tools/libraries/model_content.h"
#include "tools/libraries/program_content.h"
#include "tools/machine/run_registry.h"
#include "vm/image/image_texts.h"

namespace morphbus {
namespace {

/// What commands print as errors, without what stands before it on a terminal.
std::string ErrorIn(const std::string& said) {
  constexpr std::string_view kPrefix = "morphbus: error: ";
  std::string text = said;
  for (size_t at = text.find(kPrefix); at != std::string::npos; at = text.find(kPrefix)) {
    text.erase(at, kPrefix.size());
  }
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

/// The options as the planner takes them.
tools::RunOptions ToInternal(const RunOptions& options, const std::string& robot) {
  tools::RunOptions told;
  told.robot = robot;
  told.seconds = options.seconds;
  told.run = options.name;
  for (const auto& [name, value] : options.settings) told.set.push_back(name + "=" + value);
  told.world = options.world;
  told.friction = options.friction;
  told.ground = options.ground;
  told.still = options.still;
  told.loss = options.loss;
  told.seed = options.seed;
  told.random_seed = options.random_seed;
  told.noise_seed = options.noise_seed;
  told.inproc = true;
  return told;
}

/// The plan of a run. Throws Failure where it makes no sense.
tools::RunPlan Plan(const Robot& robot, const Program& program, const RunOptions& options) {
  const tools::HeldSaying said;
  const tools::RunOptions told = ToInternal(options, robot.name());
  model::Model model = robot.content()->of_model->model;
  // A variant is no robot of its model yet.
  if (model.FindRobot(robot.name()) == nullptr) model.robots.push_back(robot.content()->robot);
  std::optional<tools::RunPlan> plan;
  if (tools::CheckNumbers(told)) {
    plan = tools::PlanCompiled(told, std::move(model), {program.image(), program.hash()});
  }
  if (!plan) throw Failure(ErrorIn(said.text()));
  plan->description.set_started(tools::WallTime());
  return std::move(*plan);
}

/// Where the messages of the run go.
tools::RunRecord RecordTo(const std::string& log) {
  if (!log.empty()) {
    const tools::HeldSaying said;
    std::error_code wrong;
    const std::filesystem::path path = std::filesystem::absolute(log, wrong);
    if (wrong) throw Failure("cannot write " + log + ": " + wrong.message());
    std::optional<tools::RunRecord> file =
        tools::RunRecord::ToLog(path.lexically_normal(), false, {});
    if (!file) throw Failure(ErrorIn(said.text()));
    return std::move(*file);
  }
  Result<tools::RunRecord> record = tools::RunRecord::InMemory();
  if (!record) throw Failure(record.error().message);
  return std::move(*record);
}

/// A key that nobody needs to know: all of the run is in this process.
bridge::RunKey NewKey() {
  const Result<bridge::RunKey> key = bridge::RunKey::Random();
  if (!key) throw Failure(key.error().message);
  return *key;
}

}  // namespace

class MORPHBUS_HIDDEN Run::Content {
 public:
  Content(const Robot& robot, const Program& program, const RunOptions& options)
      : robot_(robot),
        plan_(Plan(robot, program, options)),
        record_(RecordTo(options.log)),
        has_log_(!options.log.empty()),
        run_(plan_, record_, NewKey()) {
    if (Result<void> built = run_.Build(); !built) throw Failure(built.error().message);
    run_.desk().OnAnswer([this](const bridge::ControlAnswer& answer) {
      const bool refused = answer.state == bridge::ControlAnswer::State::kRefused ||
                           answer.state == bridge::ControlAnswer::State::kOvertaken;
      if (refused) refusals_ += (refusals_.empty() ? "" : "\n") + answer.reason;
    });
    roles_.resize(run_.modules().instances.size(), -1);
    for (size_t m = 0; m < roles_.size(); ++m) {
      run_.modules().instances[m]->controller().OnTick(
          [this, m](const vm::TickInput& /*input*/, vm::TickOutput* output) {
            roles_[m] = output->status.role;
            DriveJoints(static_cast<int>(m), output);
          });
    }
    over_ = !run_.GoOnTo(0);
    ThrowIfFailed();
  }

  /// A run that nobody closed is closed as well as may be.
  ~Content() {
    try {
      Close();
    } catch (const std::exception&) {
      // Nobody is left who could be told.
    }
  }
  Content(const Content&) = delete;
  Content& operator=(const Content&) = delete;

  void Step(int64_t ticks) {
    if (result_) throw Failure("the run is closed");
    if (ticks < 0) throw Failure("a run does not go back");
    const tools::HeldSaying said;
    const int64_t now = run_.sim().tick();
    if (!over_) over_ = !run_.GoOnTo(ticks < bridge::kNever - now ? now + ticks : bridge::kNever);
    if (refusals_.empty()) return;
    throw Failure(std::exchange(refusals_, std::string()));
  }

  void Command(std::string_view text) {
    if (result_ || over_) throw Failure("the run is over, and takes no commands");
    const Result<bridge::ControlCommand> command = bridge::ParseControl(text);
    if (!command) throw Failure(command.error().message);
    Give(*command);
  }

  void Give(const bridge::ControlCommand& command) {
    using bridge::ControlKind;
    for (const ControlKind kind :
         {ControlKind::kPause, ControlKind::kResume, ControlKind::kStep, ControlKind::kSpeed}) {
      if (command.kind == kind) throw Failure("a run that is stepped holds by itself");
    }
    const bool warm = command.kind == ControlKind::kRestart && !command.cold;
    if (command.kind == ControlKind::kKill || warm) {
      throw Failure("all modules of this run are in one process, which cannot be killed");
    }
    if (command.kind == ControlKind::kDeploy) {
      throw Failure("programs are deployed to runs on the bus (morphbus control)");
    }
    const tools::HeldSaying said;
    run_.desk().Give(++commands_, command);
    if (!refusals_.empty()) throw Failure(std::exchange(refusals_, std::string()));
  }

  void Drive(int joint, std::optional<vm::JointCommand> command) {
    const std::vector<Joint>& joints = robot_.joints();
    if (result_ || over_) throw Failure("the run is over, and drives nothing");
    if (joint < 0 || joint >= static_cast<int>(joints.size())) {
      throw Failure(fmt::format("there is no joint number {} in robot {}", joint, robot_.name()));
    }
    if (!command) {
      driven_.erase(joint);
      return;
    }
    const Joint& of = joints[joint];
    const bool reachable = command->target >= of.lower && command->target <= of.upper;
    if (!std::isfinite(command->target) || !reachable) {
      throw Failure(fmt::format("{} goes from {} to {}, and not to {}", of.name, of.lower, of.upper,
                                command->target));
    }
    if (!(std::isfinite(command->speed) && command->speed >= 0)) {
      throw Failure("a joint's speed is a number, 0 or more");
    }
    if (command->speed == 0) command->speed = of.speed;
    driven_[joint] = *command;
  }

  [[nodiscard]] Observation Observe() const {
    Observation seen;
    seen.tick = run_.sim().tick();
    seen.time_s = static_cast<double>(seen.tick * plan_.description.tick_us()) / 1e6;
    // Once the run is over, the robot is one tick further than what was told of it last.
    const auto readings = over_ ? run_.SenseNow() : run_.sim().readings().modules();
    for (const morphbus::module_sensors_t& module : readings) {
      seen.position.insert(seen.position.end(), module.joint_position_si.begin(),
                           module.joint_position_si.end());
      seen.velocity.insert(seen.velocity.end(), module.joint_velocity_si.begin(),
                           module.joint_velocity_si.end());
      seen.effort.insert(seen.effort.end(), module.joint_effort_si.begin(),
                         module.joint_effort_si.end());
      seen.sensors.emplace_back(module.sensor_value.begin(), module.sensor_value.end());
    }
    const Robot::Content& content = *robot_.content();
    for (size_t l = 0; l < content.links.size(); ++l) {
      const int module = content.links[l].module;
      const int link = static_cast<int>(l) - content.first_link[module];
      seen.X_WL.push_back(ToPublic(run_.robot().LinkPose(module, link)));
    }
    for (size_t m = 0; m < roles_.size(); ++m) {
      const vm::VerifiedProgram& program = run_.modules().instances[m]->controller().program();
      // A program that has just taken the place of another one may have fewer roles.
      const bool none = roles_[m] < 0 || roles_[m] >= program.num_roles();
      seen.roles.push_back(none ? "" : ToString(program.role(roles_[m]).name));
    }
    return seen;
  }

  const RunResult& Close() {
    if (result_) return *result_;
    const tools::HeldSaying said;
    if (!over_) {
      run_.sim().RequestStop("closed");
      run_.GoOnTo(bridge::kNever);
      over_ = true;
    }
    outcome_ = run_.Finish();
    result_ = {outcome_.hash, run_.sim().outcome().ticks, outcome_.reason, outcome_.error,
               has_log_ ? outcome_.log : ""};
    return *result_;
  }

  [[nodiscard]] bool over() const { return over_; }

  [[nodiscard]] std::string SummaryJson() const {
    if (!result_) throw Failure("the run is not closed");
    const tools::HeldSaying said;
    return tools::JsonText(tools::SummaryJson(tools::Summarize(plan_, outcome_)), 2);
  }

 private:
  /// Throws Failure with what has ended the run before its first tick.
  void ThrowIfFailed() {
    if (!over_) return;
    const std::string error = Close().error;
    if (!error.empty()) throw Failure(error);
  }

  /// Puts the targets of Drive in the place of what the program says.
  void DriveJoints(int module, vm::TickOutput* output) const {
    const int first = robot_.content()->first_joint[module];
    const int last =
        first + static_cast<int>(plan_.model.TypeOf(plan_.robot(), module).joints.size());
    for (auto at = driven_.lower_bound(first); at != driven_.end() && at->first < last; ++at) {
      output->joints[at->first - first] = at->second;
    }
  }

  Robot robot_;
  tools::RunPlan plan_;
  tools::RunRecord record_;
  bool has_log_;
  tools::InprocRun run_;
  bool over_ = false;
  int64_t commands_ = 0;
  /// Why commands were refused of which nobody has been told yet, a line each.
  std::string refusals_;
  /// The role of each module after the last tick that it computed; -1 where it has none.
  std::vector<int> roles_;
  /// What joints are told, by their places in the robot.
  std::map<int, vm::JointCommand> driven_;
  tools::RunOutcome outcome_;
  std::optional<RunResult> result_;
};

std::string ArithmeticFingerprint() { return sim::ArithmeticFingerprint(); }

Run::Run(const Robot& robot, const Program& program, const RunOptions& options)
    : content_(std::make_unique<Content>(robot, program, options)) {}
Run::~Run() = default;
Run::Run(Run&& other) noexcept = default;
Run& Run::operator=(Run&& other) noexcept = default;

void Run::Step(int64_t ticks) { content_->Step(ticks); }
bool Run::over() const { return content_->over(); }
Observation Run::Observe() const { return content_->Observe(); }
void Run::Command(std::string_view text) { content_->Command(text); }

void Run::Set(std::string_view parameter, double value) {
  // The text of a number is read back as the same one.
  content_->Command(fmt::format("set {} {}", parameter, value));
}

void Run::Drive(int joint, double target, double speed) {
  content_->Drive(joint, vm::JointCommand{vm::ActuatorMode::kPosition, target, speed});
}
void Run::Release(int joint) { content_->Drive(joint, std::nullopt); }

const RunResult& Run::Close() { return content_->Close(); }
std::string Run::SummaryJson() const { return content_->SummaryJson(); }

}  // namespace morphbus
