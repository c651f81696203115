#include "logger/compare/module_rerun.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <morphbus/actuator_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>
#include <optional>
#include <vector>

#include "bridge/description/run_model.h"
#include "bridge/lockstep/module/tick_inputs.h"
#include "bridge/module/vm_controller.h"
#include "bridge/observe/run_message.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/vm_codec.h"
#include "logger/compare/kinematic_tracks.h"
#include "logger/log/event_log.h"
#include "logger/log/run_log.h"
#include "vm/image/image_texts.h"
#include "vm/run/stepping.h"

namespace morphbus::logger {
namespace {

using bridge::Topic;
using MessageBytes = std::vector<uint8_t>;

// As modules do.
using bridge::kOldestUsefulTicks;
/// By so many ticks a message may stand too late in the file: what was lost on the way to the
/// recorder has come later.
constexpr int64_t kLatestTicks = 64;
/// Commands that differ by less are the same (rad or m): doubles of the wire.
constexpr double kSameAgain = 1e-9;

/// Shows a visitor the steps of one tick.
class StepShower final : public vm::StepObserver {
 public:
  StepShower(const RerunVisitors& visitors, const bridge::VmController& controller,
             const vm::VerifiedKinematics& kinematics, const vm::TickInput& input)
      : visitors_(visitors), controller_(controller), kinematics_(kinematics), input_(input) {}

  void BeforeInstruction(const vm::Task& task) override { Show(task, nullptr); }
  void AfterRun(const vm::Task& task, const vm::RunResult& result) override { Show(task, &result); }

 private:
  void Show(const vm::Task& task, const vm::RunResult* ended) {
    visitors_.step({controller_.program(), kinematics_, input_, controller_.state(), task, ended});
  }

  const RerunVisitors& visitors_;
  const bridge::VmController& controller_;
  const vm::VerifiedKinematics& kinematics_;
  const vm::TickInput& input_;
};

/// One module, fed with a log's messages.
class Rerun : private bridge::RunMessageHandler {
 public:
  Rerun(const RunLog& log, const ModuleSeries& module, const RerunVisitors& visitors,
        int64_t last_tick)
      : log_(log),
        described_(*log.described),
        module_(module),
        visitors_(visitors),
        last_tick_(last_tick) {}

  /// Finds the images; fails if the log lacks one.
  Result<void> Prepare() {
    const std::string& type = log_.model->TypeOf(*log_.robot, module_.model_index).name;
    if (!described_.images_problem.empty()) return Fail(described_.images_problem);
    kinematics_ = described_.images.FindKinematics(type);
    if (kinematics_ == nullptr) return Fail("the log has no kinematics image of " + type);
    return {};
  }

  /// Reads the file until the last tick has been computed.
  Result<RerunSummary> Read() {
    auto reader = EventLogReader::Open(log_.facts.path);
    if (!reader) return tl::unexpected(reader.error());
    LogEvent event;
    while (next_tick_ <= last_tick_ && (*reader)->Next(&event)) {
      Take(event);
      ComputeWhatIsWhole(false);
    }
    ComputeWhatIsWhole(true);
    return summary_;
  }

 private:
  /// What the log holds of one tick of the module.
  struct Tick {
    std::optional<vm::TickInput> input;
    std::vector<morphbus::deploy_piece_t> pieces;
    bool inspected = false;  ///< It was asked to tell what it held.
    uint32_t incarnation = 0;
    MessageBytes transform, actuator;
    int64_t status_count = 0;  ///< STATUS that the module had published by then, as it says.
    std::vector<MessageBytes> status;
  };

  /// Keeps what the module sensed, heard or said.
  void Take(const LogEvent& event) {
    const auto message = bridge::OpenMessage(event.channel, event.data.data(), event.data.size());
    if (!message || message->name.run != log_.facts.run) return;
    const Topic topic = message->name.topic;
    const int64_t tick = message->header.tick;
    // After END nothing is missing that could still have been written.
    if (topic == Topic::kEnd) newest_said_ = std::numeric_limits<int64_t>::max();
    if (!IsOwn(*message)) {
      const bool wanted = topic == Topic::kSensors     ? tick >= next_tick_
                          : topic == Topic::kTransform ? tick >= OldestUseful()
                                                       : false;
      if (wanted) bridge::ReadMessage(*message, this);
    } else if (tick >= next_tick_) {
      newest_tick_ = std::max(newest_tick_, tick);
      newest_said_ = std::max(newest_said_, tick);
      bridge::ReadMessage(*message, this);
    }
  }

  [[nodiscard]] bool IsOwn(const bridge::RunMessage& message) const {
    return message.name.process == module_.name;
  }
  static MessageBytes BytesOf(const bridge::RunMessage& message) {
    return {message.data, message.data + message.size};
  }

  /// The module's own reading, and what was asked of it with it.
  void OnSensors(const bridge::RunMessage& /*message*/, morphbus::sensors_t&& sensors) override {
    newest_tick_ = std::max(newest_tick_, sensors.header.tick);
    for (const morphbus::module_sensors_t& reading : sensors.modules) {
      if (reading.name != module_.name) continue;
      vm::TickInput input;
      if (!bridge::FromSensors(reading, kinematics_->num_joints(), kinematics_->num_connectors(),
                               kinematics_->num_sensor_values(), &input)) {
        continue;
      }
      input.tick = sensors.header.tick;
      input.sim_time_us = sensors.header.sim_time_us;
      Tick& tick = ticks_[input.tick];
      // What came before with this tick is replaced: SENSORS may have been sent again.
      module_id_ = static_cast<uint16_t>(reading.module_id);
      tick.inspected = bridge::FromOrders(sensors, module_id_, &input, &tick.pieces);
      tick.input = input;
    }
  }

  /// The module's own TRANSFORM, or another's, which it may have heard.
  void OnTransform(const bridge::RunMessage& message, morphbus::transform_t&& transform) override {
    const int64_t tick = message.header.tick;
    if (!IsOwn(message)) {
      // As long as others are heard the log goes on, and lacks what a lost module does not say.
      newest_said_ = std::max(newest_said_, tick);
      heard_[static_cast<uint16_t>(transform.module_id)].insert_or_assign(tick,
                                                                          std::move(transform));
      return;
    }
    ticks_[tick].transform = BytesOf(message);
    ticks_[tick].incarnation = static_cast<uint32_t>(transform.incarnation);
  }

  void OnActuator(const bridge::RunMessage& message, morphbus::actuator_t&& actuator) override {
    ticks_[message.header.tick].actuator = BytesOf(message);
    ticks_[message.header.tick].status_count = actuator.status_count;
  }

  void OnStatus(const bridge::RunMessage& message, morphbus::status_t&& /*status*/) override {
    // Sent again, it is the same.
    std::vector<MessageBytes>& known = ticks_[message.header.tick].status;
    const MessageBytes bytes = BytesOf(message);
    if (std::find(known.begin(), known.end(), bytes) == known.end()) known.push_back(bytes);
  }

  /// Whether all STATUS of a tick have come. A module that begins anew counts anew.
  [[nodiscard]] bool HasAllStatus(const Tick& tick) const {
    const bool anew = tick.status_count < status_count_;
    const int64_t expected = anew ? tick.status_count : tick.status_count - status_count_;
    return static_cast<int64_t>(tick.status.size()) >= expected;
  }

  /// Computes ticks in their order, as soon as all is there that belongs to them; what is late for
  /// too long, and at the end of the file whatever is missing, is done without.
  void ComputeWhatIsWhole(bool at_end) {
    const int64_t before = next_tick_;
    while (!ticks_.empty()) {
      const int64_t tick = ticks_.begin()->first;
      Tick& next = ticks_.begin()->second;
      if (tick > last_tick_) break;
      const bool whole = next.input && !next.transform.empty() && !next.actuator.empty() &&
                         HasAllStatus(next) && CountUnheard(*next.input) == 0;
      if (!whole && !at_end && newest_tick_ < tick + kLatestTicks) break;
      // Only the module's own TRANSFORM says in which incarnation it was, so no tick is computed
      // without it. At the end of the file a reading that no module has answered is where the log
      // breaks off, and was not skipped.
      if (next.input && !next.transform.empty()) {
        Compute(tick, &next);
      } else if (next.input && (!at_end || tick < newest_said_)) {
        ++summary_.skipped;
      }
      // The count of STATUS goes on from tick to tick: what the next tick adds is told by the
      // difference.
      if (!next.actuator.empty()) status_count_ = next.status_count;
      next_tick_ = tick + 1;
      ticks_.erase(ticks_.begin());
    }
    if (next_tick_ == before) return;
    for (auto& [mate, messages] : heard_) {
      messages.erase(messages.begin(), messages.lower_bound(OldestUseful()));
    }
  }

  /// The tick once more, with what the module had heard by then.
  void Compute(int64_t tick, Tick* at) {
    Begin(at->incarnation);
    summary_.unheard += CountUnheard(*at->input);
    // What the neighbours said in the tick before, connector by connector. The VM reads it during
    // its tick, so that the decoded messages live until then.
    std::vector<std::unique_ptr<vm::NeighbourMessage>> messages;
    for (int c = 0; c < kinematics_->num_connectors(); ++c) {
      const vm::ConnectorReading& connector = at->input->connectors[c];
      at->input->messages[c] = nullptr;
      const morphbus::transform_t* said =
          IsMate(connector) ? HeardFrom(connector.mate_module, tick - 1) : nullptr;
      if (said == nullptr) continue;
      messages.push_back(std::make_unique<vm::NeighbourMessage>());
      bridge::FromTransform(*said, messages.back().get());
      at->input->messages[c] = messages.back().get();
    }
    // As in the run, pieces of programs are taken before the tick that they came with.
    for (const morphbus::deploy_piece_t& piece : at->pieces) controller_->TakePiece(piece);
    StepShower shower(visitors_, *controller_, *kinematics_, *at->input);
    controller_->vm().Observe(visitors_.step ? &shower : nullptr);
    controller_->Tick(*at->input, output_.get());
    controller_->vm().Observe(nullptr);
    if (summary_.ticks++ == 0) summary_.first_tick = tick;
    summary_.last_tick = tick;
    if (visitors_.tick) {
      visitors_.tick({config_, controller_->program(), *kinematics_, *at->input, *output_,
                      controller_->state()});
    }
    Compare(tick, *at);
  }

  /// A module that begins, or begins anew.
  void Begin(uint32_t incarnation) {
    if (controller_ != nullptr && incarnation == config_.incarnation) return;
    // The module's process had its options from the launcher; here they come from the log's
    // description.
    config_ = vm::VmConfig();
    config_.module_id = module_id_;
    config_.incarnation = incarnation;
    config_.random_seed = log_.facts.random_seed;
    config_.grace_ticks = realtime() ? kOldestUsefulTicks : 0;
    config_.is_root = module_.name == log_.facts.root_module;
    const int link = bridge::RootLinkOf(*log_.robot, module_.model_index).link;
    config_.root_link = static_cast<uint8_t>(link);
    config_.X_RL_root = ToVmPose(described_.X_RL_start[module_.model_index][link]);
    controller_ =
        std::make_unique<bridge::VmController>(config_, *kinematics_, described_.images.program());
  }

  /// What the module says now, beside what it said then.
  void Compare(int64_t tick, const Tick& at) {
    // Now and then, and when asked, the process published STATUS though nothing had changed. The
    // log holds one then, and it is made here, too.
    std::vector<morphbus::status_t> status;
    if (output_->status.changed || !at.status.empty()) {
      status = controller_->Describe(output_->status, at.inspected);
    }
    for (size_t i = 0; i < std::max(status.size(), at.status.size()); ++i) {
      Show(Topic::kStatus, tick, i < at.status.size() ? at.status[i] : MessageBytes(),
           i < status.size() ? &status[i] : nullptr);
    }
    morphbus::transform_t transform;
    bridge::ToTransform(output_->message, &transform);
    Show(Topic::kTransform, tick, at.transform, &transform);
    morphbus::actuator_t actuator;
    bridge::ToActuator(*output_, module_id_, kinematics_->num_joints(), 0, &actuator);
    // How many STATUS there were only the process knew.
    actuator.status_count = at.status_count;
    Show(Topic::kActuator, tick, at.actuator, &actuator);
  }

  /// Shows a message beside the logged one, whose header it gets; `again` null: there is none.
  template <class Message>
  void Show(Topic topic, int64_t tick, const MessageBytes& logged, Message* again) {
    ++summary_.messages;
    if (!visitors_.message) return;
    const auto decoded = bridge::DecodeAs<Message>(logged);
    MessageBytes bytes;
    if (again != nullptr) {
      again->header = decoded ? decoded->header : morphbus::header_t();
      bridge::Encode(*again, &bytes);
    }
    visitors_.message({topic, tick, tick * log_.facts.tick_us, logged, bytes});
  }

  [[nodiscard]] bool realtime() const { return log_.facts.mode == "realtime"; }
  [[nodiscard]] bool IsMate(const vm::ConnectorReading& connector) const {
    return connector.docked && connector.mate_module != module_id_;
  }

  /// How many of the neighbours' messages that belong to the tick have not come.
  [[nodiscard]] int CountUnheard(const vm::TickInput& input) const {
    int unheard = 0;
    for (int c = 0; c < kinematics_->num_connectors() && input.tick > 0; ++c) {
      const vm::ConnectorReading& connector = input.connectors[c];
      unheard += IsMate(connector) && HeardFrom(connector.mate_module, input.tick - 1) == nullptr;
    }
    return unheard;
  }

  /// The oldest tick of which a neighbour's message can still be taken: by the next tick to be
  /// computed, for which those of the tick before it are wanted.
  [[nodiscard]] int64_t OldestUseful() const { return next_tick_ - 1 - kOldestUsefulTicks; }

  /// What a neighbour said at `tick`; in real time an older message will do.
  [[nodiscard]] const morphbus::transform_t* HeardFrom(uint16_t mate, int64_t tick) const {
    const auto messages = heard_.find(mate);
    if (messages == heard_.end()) return nullptr;
    const int64_t oldest = realtime() ? tick - kOldestUsefulTicks : tick;
    for (int64_t t = tick; t >= std::max<int64_t>(0, oldest); --t) {
      const auto found = messages->second.find(t);
      if (found != messages->second.end()) return &found->second;
    }
    return nullptr;
  }

  const RunLog& log_;
  const bridge::RunModel& described_;
  const ModuleSeries& module_;
  const RerunVisitors& visitors_;
  const int64_t last_tick_;
  const vm::VerifiedKinematics* kinematics_ = nullptr;
  std::unique_ptr<bridge::VmController> controller_;
  vm::VmConfig config_;
  /// It is large, so that it is no local.
  std::unique_ptr<vm::TickOutput> output_ = std::make_unique<vm::TickOutput>();
  uint16_t module_id_ = 0;
  /// By tick, those that have not been computed yet; the next of them; the newest that the log has
  /// come to, and of which any module said anything.
  std::map<int64_t, Tick> ticks_;
  int64_t next_tick_ = 0, newest_tick_ = -1, newest_said_ = -1;
  int64_t status_count_ = 0;  ///< By the last tick that was computed.
  /// TRANSFORM of other modules, by their number and tick.
  std::map<uint16_t, std::map<int64_t, morphbus::transform_t>> heard_;
  RerunSummary summary_;
};

/// Whether a joint is commanded alike.
bool CommandsAlike(const MessageAgain& message, int joint) {
  const auto then = bridge::DecodeAs<morphbus::actuator_t>(message.logged);
  const auto now = bridge::DecodeAs<morphbus::actuator_t>(message.again);
  if (!then || !now || joint >= std::min<int>(then->num_joints, now->num_joints)) return false;
  const morphbus::joint_command_t& a = then->joints[joint];
  const morphbus::joint_command_t& b = now->joints[joint];
  return a.mode == b.mode && std::abs(a.target_si - b.target_si) <= kSameAgain &&
         std::abs(a.speed_si - b.speed_si) <= kSameAgain;
}

}  // namespace

Result<RerunSummary> RerunModule(const RunLog& log, int module, const RerunVisitors& visitors,
                                 int64_t last_tick) {
  if (log.model == nullptr || log.modules[module].model_index < 0) {
    return Fail("the log does not hold the module's model");
  }
  Rerun rerun(log, log.modules[module], visitors, last_tick);
  if (const Result<void> ready = rerun.Prepare(); !ready) return tl::unexpected(ready.error());
  return rerun.Read();
}

Result<CommandingCall> FindCommandingCall(const RunLog& log, int module, int joint, int64_t tick) {
  Result<CommandingCall> call = Fail("no call of the program has commanded the joint yet");
  bool alike = false;
  RerunVisitors visitors;
  // The VM keeps for every joint the call that last told it anything, which is looked up after the
  // tick in question.
  visitors.tick = [&](const ComputedTick& computed) {
    if (computed.input.tick != tick || joint >= computed.kinematics.num_joints()) return;
    const vm::JointState& state = computed.state.joints[joint];
    if (state.function < 0) return;
    const vm::VerifiedProgram& program = computed.program;
    call = CommandingCall{program.hash(), vm::SourceFiles(program),
                          ToString(program.function_name(state.function)),
                          program.LineOf(state.function, state.pc)};
  };
  // A rerun that commands something else would name a line that has nothing to do with it.
  visitors.message = [&](const MessageAgain& message) {
    if (message.topic != Topic::kActuator || message.tick != tick) return;
    alike = CommandsAlike(message, joint);
  };
  const Result<RerunSummary> done = RerunModule(log, module, visitors, tick);
  if (!done) return tl::unexpected(done.error());
  if (done->last_tick != tick) {
    return Fail(fmt::format("the log lacks messages up to tick {}", tick));
  }
  if (!alike) {
    return Fail(fmt::format("{} does not command again what the log has at tick {}",
                            log.modules[module].name, tick));
  }
  return call;
}

}  // namespace morphbus::logger
