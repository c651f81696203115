#include "sim/connections.h"

#include <algorithm>
#include <utility>

namespace morphbus::sim {
namespace {

// What a module reads of one docking: its own connector, the mate's, and which of the numbered ways
// of connecting it is, told so that this module is member a.
morphbus::docked_connector_t Reading(const model::Model& model, const model::Docking& docking,
                                     bool seen_from_a) {
  const std::vector<model::ConnectionOption>& options =
      model.connection_types[docking.connection_type].options;
  morphbus::docked_connector_t reading;
  reading.connection_type = static_cast<int8_t>(docking.connection_type);
  int option = docking.option;
  if (seen_from_a) {
    reading.connector = static_cast<int8_t>(docking.connector_a);
    reading.mate_connector = static_cast<int8_t>(docking.connector_b);
    reading.mate_module = static_cast<int16_t>(docking.module_b);
  } else {
    reading.connector = static_cast<int8_t>(docking.connector_b);
    reading.mate_connector = static_cast<int8_t>(docking.connector_a);
    reading.mate_module = static_cast<int16_t>(docking.module_a);
    // A connection of unlike types has no mirror image; its number is then the mate's.
    option = model::MirrorOption(model, docking).value_or(option);
  }
  // The wire carries the number that people know, from 1.
  reading.number = static_cast<int16_t>(options[option].number);
  return reading;
}

// The value of a list at an index that came from outside, or null.
template <class T>
const T* At(const std::vector<T>& list, int i) {
  return i >= 0 && i < static_cast<int>(list.size()) ? &list[i] : nullptr;
}

}  // namespace

Connections::Connections(std::shared_ptr<const model::Model> model, const model::Robot& robot)
    : model_(std::move(model)), robot_(robot), states_(InitialStates(*model_, robot_)) {
  NoteReadings();
}

void Connections::NoteReadings() {
  readings_.clear();
  for (const model::Docking& docking : robot_.dockings) {
    readings_.emplace_back(docking.module_a, Reading(*model_, docking, true));
    readings_.emplace_back(docking.module_b, Reading(*model_, docking, false));
  }
  // Sorted, so that their order does not tell that of the model.
  std::stable_sort(readings_.begin(), readings_.end(), [](const auto& a, const auto& b) {
    return std::pair(a.first, a.second.connector) < std::pair(b.first, b.second.connector);
  });
}

void Connections::Sense(std::vector<morphbus::module_sensors_t>* out) const {
  for (morphbus::module_sensors_t& sensors : *out) sensors.docked.clear();
  for (const auto& [module, reading] : readings_) (*out)[module].docked.push_back(reading);
  // The message holds the length of its list in a field of its own.
  for (morphbus::module_sensors_t& sensors : *out) {
    sensors.num_docked = static_cast<int8_t>(sensors.docked.size());
  }
}

bool Connections::Command(int module, const morphbus::connector_command_t& command,
                          const LinkPosesNow& link_poses) {
  // Modules may command anything; only what there is counts.
  const model::Connector* connector =
      At(model_->TypeOf(robot_, module).connectors, command.connector);
  const model::StateVariable* variable =
      connector == nullptr ? nullptr : At(connector->states, command.state);
  if (variable == nullptr || At(variable->values, command.value) == nullptr) return false;
  // Commands come again every tick, and mostly change nothing.
  int& value = states_[module][command.connector][command.state];
  if (value == command.value) return false;
  value = command.value;
  // A variable that takes a new value can end a docking or make one.
  if (const std::optional<size_t> docking = FindDocking(robot_, module, command.connector)) {
    // A connector that is mated comes apart if its states no longer allow it, and stays otherwise.
    if (StatesAllow(*model_, robot_, states_, robot_.dockings[*docking])) return false;
    Undock(*docking);
    return true;
  }
  // A free one looks for a mate whose states allow the connection, too.
  const std::optional<model::Docking> mate =
      FindMate(*model_, robot_, link_poses(), module, command.connector, &states_);
  if (mate) Dock(*mate);
  return mate.has_value();
}

// A connector by the names that people use.
Result<Connections::End> Connections::FindEnd(const std::string& module,
                                              const std::string& connector) const {
  const std::optional<int> m = robot_.FindModule(module);
  if (!m) return Fail("the robot has no module " + module);
  const std::optional<int> c = model_->TypeOf(robot_, *m).FindConnector(connector);
  if (!c) return Fail("module " + module + " has no connector " + connector);
  return End{*m, *c};
}

Result<void> Connections::Disconnect(const std::string& module, const std::string& connector) {
  const Result<End> end = FindEnd(module, connector);
  if (!end) return Fail(end.error().message);
  const std::optional<size_t> docking = FindDocking(robot_, end->module, end->connector);
  if (!docking) return Fail(module + "." + connector + " is not connected");
  Undock(*docking);
  return {};
}

Result<void> Connections::Connect(const std::string& module, const std::string& connector,
                                  const LinkPosesNow& link_poses, const std::string& mate_module,
                                  const std::string& mate_connector) {
  const Result<End> end = FindEnd(module, connector);
  if (!end) return Fail(end.error().message);
  if (FindDocking(robot_, end->module, end->connector)) {
    return Fail(module + "." + connector + " is connected already");
  }
  // The states of both are set as the connection needs them, so none of them forbids it.
  const std::optional<model::Docking> mate =
      FindMate(*model_, robot_, link_poses(), end->module, end->connector, nullptr);
  if (!mate) return Fail("no free connector is near enough to " + module + "." + connector);
  // Of a docking either end may be the first.
  if (!mate_module.empty()) {
    const Result<End> wanted = FindEnd(mate_module, mate_connector);
    if (!wanted) return Fail(wanted.error().message);
    const bool a = mate->module_a == wanted->module && mate->connector_a == wanted->connector;
    const bool b = mate->module_b == wanted->module && mate->connector_b == wanted->connector;
    if (!a && !b) {
      return Fail(mate_module + "." + mate_connector + " is not the one that " + module + "." +
                  connector + " meets");
    }
  }
  Dock(*mate);
  return {};
}

void Connections::Undock(size_t docking) {
  robot_.dockings.erase(robot_.dockings.begin() + static_cast<std::ptrdiff_t>(docking));
  NoteReadings();
}

void Connections::Dock(const model::Docking& docking) {
  robot_.dockings.push_back(docking);
  NoteReadings();
  SetRequiredStates(*model_, robot_, docking, &states_);
}

}  // namespace morphbus::sim
