// What modules say of themselves: commands, roles, faults, ledgers.

#include <sstream>

#include "bridge/observe/ledger_counts.h"
#include "bridge/outward/converter.h"
#include "bridge/wire/status_codec.h"
#include "compiler/base/text.h"
#include "vm/image/fault_text.h"

namespace morphbus::bridge {
namespace {

/// Programs whose text is kept; no run deploys so many.
constexpr size_t kMostPrograms = 64;

/// The mode of a command; one that nobody knows is told as one to hold.
morphbus::JointOrder::Mode ModeOf(int mode) {
  using morphbus::joint_command_t;
  if (mode == joint_command_t::MODE_POSITION) return morphbus::JointOrder::POSITION;
  if (mode == joint_command_t::MODE_VELOCITY) return morphbus::JointOrder::VELOCITY;
  return morphbus::JointOrder::HOLD;
}

/// Line number `number`, from 1; empty if there are fewer.
std::string LineOf(const std::string& text, int number) {
  std::istringstream stream(text);
  std::string line;
  for (int i = 0; i < number; ++i) {
    if (!std::getline(stream, line)) return "";
  }
  return line;
}

}  // namespace

void Converter::OnActuator(const RunMessage& message, morphbus::actuator_t&& actuator) {
  const int module = message.module;
  // A process that is none of the robot's modules has no joints to tell of.
  if (module < 0) return;
  const model::ModuleType& type = run_->TypeOf(module);
  // Sender, channel and type must agree.
  if (actuator.module_id != module || actuator.joints.size() != type.joints.size()) return;
  if (!BeginGathering(actuator.header, &actuators_, &Converter::SendCommands)) return;
  if (!actuators_.have.insert(module).second) return;
  // Joints: every one gets an order in every tick.
  const std::string& name = run_->robot->modules[module].name;
  for (size_t j = 0; j < type.joints.size(); ++j) {
    const morphbus::joint_command_t& command = actuator.joints[j];
    morphbus::JointOrder& order = *commands_.add_joints();
    order.set_module(name);
    order.set_joint(type.joints[j].name);
    order.set_mode(ModeOf(command.mode));
    order.set_target(command.target_si);
    order.set_speed(command.speed_si);
    // A joint that is to hold keeps the target that it had.
    if (command.mode == morphbus::joint_command_t::MODE_POSITION) {
      target_[module][j] = command.target_si;
    } else if (command.mode == morphbus::joint_command_t::MODE_VELOCITY) {
      target_[module][j].reset();
    }
  }
  // Connectors: only what is to change.
  for (const morphbus::connector_command_t& command : actuator.connectors) {
    // Numbers beyond what the type has are of no module of ours.
    const int c = command.connector;
    if (!IsIndex(c, type.connectors.size())) continue;
    const model::Connector& connector = type.connectors[c];
    const int s = command.state;
    if (!IsIndex(s, connector.states.size())) continue;
    const model::StateVariable& state = connector.states[s];
    const int v = command.value;
    if (!IsIndex(v, state.values.size())) continue;
    morphbus::ConnectorOrder& order = *commands_.add_connectors();
    order.set_module(name);
    order.set_connector(connector.name);
    order.set_state(state.name);
    order.set_value(model::ValueText(state.values[v]));
  }
  if (static_cast<int>(actuators_.have.size()) >= NumLiving()) SendCommands();
}

void Converter::SendCommands() {
  // All commands of a tick go out together, whole or not.
  if (actuators_.tick < 0 || actuators_.have.empty()) return;
  SetTime(actuators_.time_us, commands_.mutable_timestamp());
  commands_.set_tick(actuators_.tick);
  actuators_.have.clear();
  Send(OutwardTopic::kCommands, actuators_.time_us, commands_);
  commands_.Clear();
  // A module says its STATUS before its ACTUATOR, so all that changed in the tick is known.
  SendModules();
}

void Converter::OnStatus(const RunMessage& message, morphbus::status_t&& status) {
  const int module = message.module;
  if (module < 0 || status.module_id != module) return;
  const model::ModuleType& type = run_->TypeOf(module);
  morphbus::ModuleState state;
  // Texts come from the bus, and may hold anything.
  state.set_module(run_->robot->modules[module].name);
  state.set_role(EscapeControl(status.role_name));
  state.set_color(CssColor(colors_.Of(status.role_name)));
  state.set_frozen(status.frozen);
  state.set_has_pose(status.has_pose);
  state.set_pose_stale(status.pose_stale);
  state.set_incarnation(static_cast<uint32_t>(status.incarnation));
  state.set_program_hash(static_cast<uint64_t>(status.header.program_hash));
  state.set_lost(states_[module].lost());
  // Labels and signs, with the names of what they are of.
  for (const morphbus::label_t& label : status.labels) {
    const int index = label.index;
    const bool is_joint = label.kind == morphbus::label_t::KIND_JOINT;
    if (!IsIndex(index, is_joint ? type.joints.size() : type.links.size())) continue;
    morphbus::Label& out = *state.add_labels();
    out.set_name(EscapeControl(label.name));
    if (is_joint) {
      out.set_joint(type.joints[index].name);
    } else {
      out.set_link(type.links[index].name);
    }
  }
  for (size_t j = 0; j < type.joints.size() && j < status.joint_sign.size(); ++j) {
    // The next joint values carry the sign, by which viewers turn them into the program's degrees.
    sign_[module][j] = status.joint_sign[j];
    // A joint without a convention has no sign to tell.
    if (status.joint_sign[j] == 0) continue;
    morphbus::JointSign& sign = *state.add_signs();
    sign.set_joint(type.joints[j].name);
    sign.set_sign(status.joint_sign[j]);
  }
  // Tasks, by kind and by where they are in the program.
  for (const morphbus::task_t& task : status.tasks) {
    morphbus::Task& out = *state.add_tasks();
    out.set_kind(vm::TaskKindName(static_cast<vm::TaskKind>(task.kind)));
    out.set_function(EscapeControl(task.function_name));
    const auto hash = static_cast<uint64_t>(status.header.program_hash);
    const vm::SourcePlace place = words_.Place(hash, std::max<int>(0, task.line));
    out.set_line(static_cast<uint32_t>(place.line));
    // The program's own file goes without saying.
    if (place.line != task.line) out.set_file(EscapeControl(place.file));
  }
  state.set_ended_behaviors(static_cast<uint32_t>(std::max<int>(0, status.ended_behaviors)));
  state.set_startup_ended(status.startup_ended);
  // A STATUS comes every 50 ticks anyhow; viewers are told what is new.
  if (state.SerializeAsString() != states_[module].SerializeAsString()) {
    states_[module] = std::move(state);
    modules_changed_ = true;
  }
  for (const morphbus::fault_t& fault : status.faults) SendFault(status, fault, module);
  for (const morphbus::print_t& print : status.prints) {
    if (!IsTrace(print)) SendPrint(status, print, module);
  }
  SendTraces(status, module);
}

void Converter::SendModules() {
  if (!modules_changed_) return;
  modules_changed_ = false;
  morphbus::Modules modules;
  SetTime(clock_.time_us(), modules.mutable_timestamp());
  // All modules in every message, so that who subscribes late lacks none.
  for (const morphbus::ModuleState& state : states_) *modules.add_modules() = state;
  Send(OutwardTopic::kModules, clock_.time_us(), modules);
}

std::string Converter::SourceLine(uint64_t hash, const ReportWords& words) {
  // Line 0 is that of faults that have no place in the source.
  if (!text_ || words.place.line < 1) return "";
  auto found = source_texts_.find(hash);
  if (found == source_texts_.end()) {
    // Hashes come from messages, of which somebody may invent any number.
    if (source_texts_.size() >= kMostPrograms) return "";
    auto texts = std::make_shared<const SourceTexts>(text_(words_.SourceHash(hash), words.program));
    found = source_texts_.emplace(hash, std::move(texts)).first;
  }
  if (words.place.file == words.program) return LineOf(found->second->own, words.place.line);
  for (const auto& [file, text] : found->second->imported) {
    const bool is_it = words.place.file == file || words.place.file.ends_with("/" + file);
    if (is_it) return LineOf(text, words.place.line);
  }
  return "";
}

void Converter::SendFault(const morphbus::status_t& status, const morphbus::fault_t& wire,
                          int module) {
  const vm::Fault fault = FromFault(wire);
  const auto hash = static_cast<uint64_t>(status.header.program_hash);
  const ReportWords words = words_.Fault(hash, run_->TypeOf(module).name, fault);
  // What happened and where, in words that need no image to be understood.
  morphbus::Fault out;
  SetTime(status.header.sim_time_us, out.mutable_timestamp());
  out.set_module(run_->robot->modules[module].name);
  out.set_role(EscapeControl(status.role_name));
  out.set_name(vm::FaultName(fault.code));
  out.set_text(EscapeControl(words.text));
  out.set_function(EscapeControl(words.function));
  out.set_file(EscapeControl(words.place.file));
  out.set_line(static_cast<uint32_t>(words.place.line));
  out.set_source_line(SourceLine(hash, words));
  Send(OutwardTopic::kFaults, status.header.sim_time_us, out);
  SendLog(status.header.sim_time_us, foxglove::Log::ERROR, out.module(), out.text(),
          {out.file(), out.line()});
}

void Converter::SendPrint(const morphbus::status_t& status, const morphbus::print_t& wire,
                          int module) {
  const vm::PrintReport print = FromPrint(wire);
  const auto hash = static_cast<uint64_t>(status.header.program_hash);
  // The message only says which text of the program's image it is.
  const ReportWords words = words_.Print(hash, run_->TypeOf(module).name, print);
  morphbus::Print out;
  SetTime(status.header.sim_time_us, out.mutable_timestamp());
  out.set_module(run_->robot->modules[module].name);
  out.set_role(EscapeControl(status.role_name));
  out.set_text(EscapeControl(words.text));
  out.set_file(EscapeControl(words.place.file));
  out.set_line(static_cast<uint32_t>(words.place.line));
  Send(OutwardTopic::kPrints, status.header.sim_time_us, out);
  SendLog(status.header.sim_time_us, foxglove::Log::INFO, out.module(), out.text(),
          {out.file(), out.line()});
}

void Converter::SendTraces(const morphbus::status_t& status, int module) {
  morphbus::Traces out;
  for (const morphbus::print_t& print : status.prints) {
    if (!IsTrace(print)) continue;
    const TracedValue value = words_.Trace(static_cast<uint64_t>(status.header.program_hash),
                                           status.role, FromTrace(print));
    morphbus::TracedField& field = *out.add_fields();
    field.set_name(EscapeControl(value.field));
    field.set_value(value.value);
  }
  if (out.fields_size() == 0) return;
  SetTime(status.header.sim_time_us, out.mutable_timestamp());
  out.set_module(run_->robot->modules[module].name);
  out.set_role(EscapeControl(status.role_name));
  Send(OutwardTopic::kTraces, status.header.sim_time_us, out);
}

void Converter::SendLog(int64_t time_us, foxglove::Log::Level level, const std::string& who,
                        const std::string& text, const SourcePlace& where) {
  foxglove::Log log;
  SetTime(time_us, log.mutable_timestamp());
  log.set_level(level);
  log.set_name(who);
  log.set_message(EscapeControl(text));
  // Viewers show file and line beside the text.
  log.set_file(where.file);
  log.set_line(where.line);
  Send(OutwardTopic::kLog, time_us, log);
}

void Converter::OnHealth(const RunMessage& /*message*/, morphbus::health_t&& health) {
  morphbus::Health out;
  SetTime(clock_.time_us(), out.mutable_timestamp());
  // What the process used, and its counts by name, of which later versions may have more.
  out.set_process(EscapeControl(health.process));
  out.set_wall_time_us(health.wall_time_us);
  out.set_cpu_us(health.cpu_us);
  out.set_max_rss_kb(health.max_rss_kb);
  for (const LedgerCount& count : kLedgerCounts) {
    morphbus::Count& told = *out.add_counts();
    told.set_name(count.name);
    told.set_value(health.*count.value);
  }
  out.set_first_refused(EscapeControl(health.first_refused));
  // Only the simulator tells of modules that were late, and only in real time.
  for (const morphbus::lateness_t& lateness : health.lateness) {
    morphbus::Lateness& late = *out.add_lateness();
    late.set_module(EscapeControl(lateness.module_name));
    late.set_missed(lateness.missed);
    late.set_late(lateness.late);
    late.set_worst_us(lateness.worst_us);
  }
  Send(OutwardTopic::kHealth, clock_.time_us(), out);
}

}  // namespace morphbus::bridge
