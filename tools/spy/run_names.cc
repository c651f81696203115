#include "tools/spy/run_names.h"

#include "bridge/description/link_places.h"
#include "bridge/description/program_words.h"
#include "bridge/wire/status_codec.h"
#include "vm/image/fault_text.h"
#include "vm/image/source_places.h"

namespace morphbus::tools {
namespace {

/// The name of a list's element; empty if it has none of this number.
template <class Part>
std::string NameIn(const std::vector<Part>& parts, int i) {
  return bridge::IsIndex(i, parts.size()) ? parts[i].name : "";
}

}  // namespace

RunNames RunNames::Of(int64_t model_hash) const {
  // Each model has another order of parts, so that numbers of one would name what they do not mean.
  const bool same = run_ != nullptr && run_->model_hash == static_cast<uint64_t>(model_hash);
  return same ? *this : RunNames();
}

const model::ModuleType* RunNames::TypeOf(int module) const {
  if (run_ == nullptr || run_->robot == nullptr) return nullptr;
  return bridge::IsIndex(module, run_->robot->modules.size()) ? &run_->TypeOf(module) : nullptr;
}

int RunNames::NumberOf(std::string_view module) const {
  if (run_ == nullptr || run_->robot == nullptr) return -1;
  return run_->robot->FindModule(std::string(module)).value_or(-1);
}

std::string RunNames::Module(int module) const {
  return TypeOf(module) == nullptr ? "" : run_->robot->modules[module].name;
}

std::string RunNames::Joint(int module, int joint) const {
  const model::ModuleType* type = TypeOf(module);
  return type == nullptr ? "" : NameIn(type->joints, joint);
}

std::string RunNames::Link(int module, int link) const {
  const model::ModuleType* type = TypeOf(module);
  return type == nullptr ? "" : NameIn(type->links, link);
}

std::string RunNames::Connector(int module, int connector) const {
  const model::ModuleType* type = TypeOf(module);
  return type == nullptr ? "" : NameIn(type->connectors, connector);
}

const model::StateVariable* RunNames::FindState(int module, int connector, int state) const {
  const model::ModuleType* type = TypeOf(module);
  if (type == nullptr || !bridge::IsIndex(connector, type->connectors.size())) return nullptr;
  const std::vector<model::StateVariable>& states = type->connectors[connector].states;
  return bridge::IsIndex(state, states.size()) ? &states[state] : nullptr;
}

std::string RunNames::State(int module, int connector, int state) const {
  const model::StateVariable* variable = FindState(module, connector, state);
  return variable == nullptr ? "" : variable->name;
}

std::string RunNames::StateValue(int module, int connector, int state, int value) const {
  const model::StateVariable* variable = FindState(module, connector, state);
  if (variable == nullptr || !bridge::IsIndex(value, variable->values.size())) return "";
  return model::ValueText(variable->values[value]);
}

std::string RunNames::SensorValue(int module, int value) const {
  const model::ModuleType* type = TypeOf(module);
  if (type == nullptr) return "";
  // A direction is three values, everything else is one.
  for (const model::Sensor& sensor : type->sensors) {
    // All values of a module's sensors are numbered through, in the order of declaration.
    const int values = sensor.type == model::SensorType::kTilt ? 3 : 1;
    if (value < values) return values == 1 ? sensor.name : sensor.name + "." + "xyz"[value];
    value -= values;
  }
  return "";
}

std::string RunNames::Connection(int connection) const {
  return run_ == nullptr ? "" : NameIn(run_->model.connection_types, connection);
}

std::string RunNames::Role(int64_t program_hash, int role) const {
  if (run_ == nullptr || !run_->has_program) return "";
  // A program that was deployed since has other roles, and the spy has not its image.
  const vm::VerifiedProgram& program = run_->images.program();
  if (program.hash() != static_cast<uint64_t>(program_hash) || role < 0 ||
      role >= program.num_roles()) {
    return "";
  }
  const vm::Text name = program.role(role).name;
  return std::string(name.data, name.size);
}

std::string RunNames::Fault(int64_t program_hash, const std::string& type,
                            const morphbus::fault_t& fault) const {
  const vm::Fault heard = bridge::FromFault(fault);
  const bridge::ReportWords words =
      bridge::ProgramWords(run_).Fault(static_cast<uint64_t>(program_hash), type, heard);
  return vm::FaultLine(words.place.file, words.place.line, words.text, words.function);
}

std::string RunNames::Line(int64_t program_hash, int line) const {
  return vm::PlaceText(bridge::ProgramWords(run_).Place(static_cast<uint64_t>(program_hash), line));
}

}  // namespace morphbus::tools
