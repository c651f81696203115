#include "logger/compare/module_rerun.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <morphbus/actuator_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/transform_t.hpp>
#include <optional>
#include <vector>

#include "bridge/module/module_instance.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/vm_codec.h"
#include "logger/compare/kinematic_tracks.h"
#include "logger/log/description.h"
#include "logger/log/event_log.h"
#include "vm/vm.h"

namespace morphbus::logger {
namespace {

using bridge::Topic;

/// In real time a neighbour's message of so many ticks ago is still taken (as modules do).
constexpr int64_t kOldestUseful = 3;
constexpr uint16_t kRealtimeGraceTicks = 3;
/// Commands that differ by less are the same (rad or m): doubles of the wire.
constexpr double kSameAgain = 1e-9;

/// One module in the VM, fed with a log's messages in the order of the file.
class Rerun {
 public:
  Rerun(const RunLog& log, const ModuleSeries& module, int joint, int64_t last_tick)
      : log_(log), module_(module), joint_(joint), last_tick_(last_tick) {}

  /// Finds the images; fails if the log lacks one.
  Result<void> Prepare() {
    const std::string& type = log_.model->TypeOf(*log_.robot, module_.model_index).name;
    Result<void> loaded = LoadImages(log_.description, &images_);
    if (!loaded) return loaded;
    // The images are those of the run, as its description has them.
    kinematics_ = images_.FindKinematics(type);
    if (kinematics_ == nullptr) return Fail("the log has no kinematics image of " + type);
    program_ = &images_.program();
    if (joint_ >= kinematics_->num_joints()) return Fail("the module has no such joint");
    return {};
  }

  /// Shows every tick of the module to `visit` as soon as it is computed.
  void ShowTo(const TickVisitor* visit) { visit_ = visit; }

  /// Reads the file until the module's ACTUATOR of the last tick has come.
  Result<void> Read() {
    auto reader = EventLogReader::Open(log_.facts.path);
    if (!reader) return tl::unexpected(reader.error());
    LogEvent event;
    while (!done_ && error_.empty() && (*reader)->Next(&event)) Take(event);
    if (!error_.empty()) return Fail(error_);
    if (!done_) return Fail(fmt::format("the log lacks messages up to tick {}", last_tick_));
    return {};
  }

  /// What the VM's state says of who commanded the joint.
  [[nodiscard]] Result<CommandingCall> Call() const {
    const vm::JointState& joint = state_->joints[joint_];
    if (joint.function < 0) return Fail("no call of the program has commanded the joint yet");
    const vm::Text name = program_->function_name(joint.function);
    const vm::Text source = program_->source_name();
    return CommandingCall{program_->hash(),
                          {source.data, source.size},
                          {name.data, name.size},
                          program_->LineOf(joint.function, joint.pc)};
  }

 private:
  /// A neighbour's last messages, each at the place that is its tick's remainder by four.
  struct Heard {
    std::array<int64_t, 4> ticks = {-1, -1, -1, -1};
    std::array<std::unique_ptr<vm::NeighbourMessage>, 4> messages;
  };

  /// A message that the module has heard or said.
  void Take(const LogEvent& event) {
    const std::optional<bridge::ChannelName> name = bridge::ParseChannel(event.channel);
    if (!name || name->run != log_.facts.run) return;
    // SENSORS opens a tick, the module's own TRANSFORM has it computed, its ACTUATOR is what is
    // compared.
    const bool own = name->process == module_.name;
    if (name->topic == Topic::kSensors) {
      TakeSensors(event);
    } else if (name->topic == Topic::kTransform) {
      TakeTransform(event, own);
    } else if (name->topic == Topic::kActuator && own) {
      TakeActuator(event);
    }
  }

  /// The module's own reading, and what was asked of it with it.
  void TakeSensors(const LogEvent& event) {
    morphbus::sensors_t sensors;
    if (!bridge::Decode(event.data.data(), event.data.size(), {}, &sensors)) return;
    for (const morphbus::module_sensors_t& reading : sensors.modules) {
      if (reading.name != module_.name) continue;
      vm::TickInput input;
      if (!bridge::FromSensors(reading, kinematics_->num_joints(), kinematics_->num_connectors(),
                               kinematics_->num_sensor_values(), &input)) {
        continue;
      }
      input.tick = sensors.header.tick;
      input.sim_time_us = sensors.header.sim_time_us;
      for (const morphbus::invoke_request_t& request : sensors.requests) {
        if (request.module_id != reading.module_id) continue;
        bridge::FromRequest(request, &input.requests[input.num_requests++]);
      }
      for (const morphbus::root_pose_t& pose : sensors.root_poses) {
        if (pose.module_id == reading.module_id) bridge::FromRootPose(pose, &input);
      }
      module_id_ = static_cast<uint16_t>(reading.module_id);
      input_ = input;
    }
  }

  /// A TRANSFORM of another module is heard; the module's own says under which program, and in
  /// which of its lives, it computed the tick, which is then computed again.
  void TakeTransform(const LogEvent& event, bool own) {
    morphbus::transform_t transform;
    if (!bridge::Decode(event.data.data(), event.data.size(), {}, &transform)) return;
    const int64_t tick = transform.header.tick;
    if (!own) {
      Heard& heard = heard_[static_cast<uint16_t>(transform.module_id)];
      // Four ticks are kept, more than any neighbour may be behind.
      const auto slot = static_cast<size_t>(tick & 3);
      if (tick <= heard.ticks[slot]) return;
      if (!heard.messages[slot]) heard.messages[slot] = std::make_unique<vm::NeighbourMessage>();
      *heard.messages[slot] = vm::NeighbourMessage();
      bridge::FromTransform(transform, heard.messages[slot].get());
      heard.ticks[slot] = tick;
      return;
    }
    if (tick <= computed_tick_ || !input_ || input_->tick != tick) return;
    Compute(static_cast<uint32_t>(transform.incarnation),
            static_cast<uint64_t>(transform.header.program_hash));
  }

  /// The tick once more, with what the module had heard by then.
  void Compute(uint32_t incarnation, uint64_t program_hash) {
    // A program that was deployed comes from SENSORS; one that the log lacks cannot be run.
    if (program_hash != program_->hash() && !ChangeProgram(program_hash)) return;
    if (vm_ == nullptr || incarnation != incarnation_) Begin(incarnation);
    // What the neighbours said in the tick before.
    for (int c = 0; c < kinematics_->num_connectors(); ++c) {
      const vm::ConnectorReading& connector = input_->connectors[c];
      const bool mate = connector.docked && connector.mate_module != module_id_;
      input_->messages[c] = mate ? MessageOf(connector.mate_module, input_->tick - 1) : nullptr;
    }
    vm_->Tick(*input_, output_.get());
    if (visit_ != nullptr) (*visit_)({config_, *program_, *kinematics_, *input_, *output_});
    computed_tick_ = input_->tick;
  }

  /// A module that begins, or begins anew.
  void Begin(uint32_t incarnation) {
    incarnation_ = incarnation;
    vm::VmConfig& config = config_;
    config = vm::VmConfig();
    config.module_id = module_id_;
    config.incarnation = incarnation;
    config.random_seed = log_.facts.random_seed;
    config.grace_ticks = log_.facts.mode == "realtime" ? kRealtimeGraceTicks : uint16_t{0};
    config.is_root = module_.name == log_.facts.root_module;
    // Only the robot's own root module says which of its links is meant.
    const int link = module_.model_index == log_.robot->root_module ? log_.robot->root_link : 0;
    config.root_link = static_cast<uint8_t>(link);
    config.X_RL_root = ToVmPose(RestPosesOf(log_)[module_.model_index][link]);
    vm_ = std::make_unique<vm::Vm>(config, *kinematics_, *program_, state_.get());
  }

  /// Goes over to a program that was deployed; false, with an error, if the log does not hold it.
  bool ChangeProgram(uint64_t hash) {
    const auto image = log_.deployed.find(hash);
    auto images = std::make_unique<bridge::ModuleImages>();
    if (image == log_.deployed.end() ||
        !images->AddProgram("program", {image->second.begin(), image->second.end()})) {
      error_ = "the log does not hold the program that was deployed";
      return false;
    }
    deployed_.push_back(std::move(images));
    program_ = &deployed_.back()->program();
    if (vm_ != nullptr) vm_->ReplaceProgram(*program_);
    return true;
  }

  /// What a neighbour said at `tick`; in real time an older message will do.
  const vm::NeighbourMessage* MessageOf(uint16_t mate, int64_t tick) {
    const auto found = heard_.find(mate);
    if (found == heard_.end() || tick < 0) return nullptr;
    const int64_t oldest = log_.facts.mode == "realtime" ? tick - kOldestUseful + 1 : tick;
    for (int64_t t = tick; t >= std::max<int64_t>(0, oldest); --t) {
      const auto slot = static_cast<size_t>(t & 3);
      if (found->second.ticks[slot] == t) return found->second.messages[slot].get();
    }
    return nullptr;
  }

  /// The last tick's command as the log has it: the VM must say the same.
  void TakeActuator(const LogEvent& event) {
    morphbus::actuator_t actuator;
    if (!bridge::Decode(event.data.data(), event.data.size(), {}, &actuator)) return;
    if (actuator.header.tick < last_tick_ || computed_tick_ < last_tick_) return;
    done_ = true;
    morphbus::actuator_t again;
    bridge::ToActuator(*output_, module_id_, kinematics_->num_joints(), 0, &again);
    // A rerun that commands something else would name a line that has nothing to do with it.
    const bool known = joint_ < static_cast<int>(actuator.joints.size());
    if (!known || actuator.header.tick != last_tick_ ||
        actuator.joints[joint_].mode != again.joints[joint_].mode ||
        std::abs(actuator.joints[joint_].target_si - again.joints[joint_].target_si) > kSameAgain ||
        std::abs(actuator.joints[joint_].speed_si - again.joints[joint_].speed_si) > kSameAgain) {
      error_ = fmt::format("{} does not command again what the log has at tick {}", module_.name,
                           last_tick_);
    }
  }

  const RunLog& log_;
  const ModuleSeries& module_;
  int joint_;
  int64_t last_tick_;
  bridge::ModuleImages images_;
  std::vector<std::unique_ptr<bridge::ModuleImages>> deployed_;
  const vm::VerifiedKinematics* kinematics_ = nullptr;
  const vm::VerifiedProgram* program_ = nullptr;
  /// State and output are large, so that they are no locals.
  std::unique_ptr<vm::VmState> state_ = std::make_unique<vm::VmState>();
  std::unique_ptr<vm::TickOutput> output_ = std::make_unique<vm::TickOutput>();
  std::unique_ptr<vm::Vm> vm_;
  vm::VmConfig config_;
  const TickVisitor* visit_ = nullptr;
  uint16_t module_id_ = 0;
  uint32_t incarnation_ = 0;
  int64_t computed_tick_ = -1;
  std::optional<vm::TickInput> input_;
  std::map<uint16_t, Heard> heard_;
  bool done_ = false;
  std::string error_;
};

}  // namespace

Result<CommandingCall> FindCommandingCall(const RunLog& log, int module, int joint, int64_t tick) {
  if (log.model == nullptr || log.modules[module].model_index < 0) {
    return Fail("the log does not hold the module's model");
  }
  Rerun rerun(log, log.modules[module], joint, tick);
  if (const Result<void> ready = rerun.Prepare(); !ready) return tl::unexpected(ready.error());
  if (const Result<void> read = rerun.Read(); !read) return tl::unexpected(read.error());
  return rerun.Call();
}

Result<void> RerunModule(const RunLog& log, int module, int64_t tick, const TickVisitor& visit) {
  if (log.model == nullptr || log.modules[module].model_index < 0) {
    return Fail("the log does not hold the module's model");
  }
  Rerun rerun(log, log.modules[module], 0, tick);
  if (Result<void> ready = rerun.Prepare(); !ready) return ready;
  rerun.ShowTo(&visit);
  return rerun.Read();
}

}  // namespace morphbus::logger
