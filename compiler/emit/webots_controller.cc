// The controller that the modules of a Webots world run: C99, by names of the model.

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <tuple>
#include <type_traits>
#include <utility>

#include "compiler/emit/numbers.h"
#include "compiler/emit/vm_sources.h"
#include "compiler/emit/webots.h"
#include "compiler/emit/webots_templates.h"

namespace morphbus::emit {
namespace {

using model::AttributeValue;

std::string Filled(std::string text,
                   const std::vector<std::pair<std::string, std::string>>& values) {
  for (const auto& [key, value] : values) {
    // What was put in is not searched again.
    const std::string mark = "@" + key + "@";
    for (size_t at = text.find(mark); at != std::string::npos; at = text.find(mark, at)) {
      text.replace(at, mark.size(), value);
      at += value.size();
    }
  }
  return text;
}

/// JOINT_joint_1 = 0, …; the names keep their case, so that none clash.
template <typename T>
std::string Enumerators(const std::vector<T>& items, const std::string& prefix) {
  std::string text;
  for (size_t i = 0; i < items.size(); ++i) {
    text += fmt::format("{}_{} = {}, ", prefix, items[i].name, i);
  }
  return text;
}

/// The names as C strings; fixed joints have neither motor nor sensor, and get 0.
template <typename T>
std::string Quoted(const std::vector<T>& items, const std::string& suffix) {
  std::string text;
  for (const T& item : items) {
    bool named = true;
    if constexpr (std::is_same_v<T, model::Joint>) named = item.type != model::JointType::kFixed;
    text += named ? fmt::format("\"{}{}\", ", item.name, suffix) : "0, ";
  }
  return text;
}

/// At least 1: C has no empty arrays.
size_t MostStates(const model::ModuleType& type) {
  size_t most = 1;
  for (const model::Connector& c : type.connectors) most = std::max(most, c.states.size());
  return most;
}

/// What a setting asks of the state variables of one of the two members' connectors: the index of a
/// value for each, -1 where it asks for none.
std::vector<int> OwnValues(const model::Connector& connector, const model::StateSetting& setting,
                           bool of_a) {
  std::vector<int> own(connector.states.size(), -1);
  for (const model::StateRequirement& asked : setting) {
    for (size_t s = 0; s < own.size(); ++s) {
      const model::StateVariable& state = connector.states[s];
      if (asked.of_a != of_a || asked.variable != state.name) continue;
      const auto found = std::find(state.values.begin(), state.values.end(), asked.value);
      if (found != state.values.end()) own[s] = static_cast<int>(found - state.values.begin());
    }
  }
  return own;
}

/// The settings of a connector's own states in which connections hold it, each once and in the
/// order of the connections. A module knows nothing of its mate's states. Those that ask for none
/// of this connector's are left out.
std::vector<std::vector<int>> LockSettings(const model::Model& model, int type, int connector) {
  const model::Connector& own = model.module_types[type].connectors[connector];
  std::vector<std::vector<int>> settings;
  const auto add = [&](const model::StateSetting& setting, bool of_a) {
    const std::vector<int> values = OwnValues(own, setting, of_a);
    const bool asks = std::any_of(values.begin(), values.end(), [](int v) { return v >= 0; });
    const bool known = std::find(settings.begin(), settings.end(), values) != settings.end();
    if (asks && !known) settings.push_back(values);
  };
  for (const model::ConnectionType& connection : model.connection_types) {
    for (const model::ConnectionOption& option : connection.options) {
      for (const bool of_a : {true, false}) {
        const bool is_it = of_a ? connection.type_a == type && option.connector_a == connector
                                : connection.type_b == type && option.connector_b == connector;
        if (!is_it) continue;
        add(option.states, of_a);
        for (const model::StateSetting& setting : option.other_states) add(setting, of_a);
      }
    }
  }
  return settings;
}

std::string LockRows(const model::Model& model, int type) {
  const model::ModuleType& module = model.module_types[type];
  std::string rows;
  for (int c = 0; c < std::ssize(module.connectors); ++c) {
    for (std::vector<int> values : LockSettings(model, type, c)) {
      // Rows are equally long, as C wants its arrays.
      values.resize(MostStates(module), -1);
      rows += fmt::format("{{{}, {{{}}}}}, ", c, fmt::join(values, ", "));
    }
  }
  return rows;
}

/// A way of docking, from one module's side.
struct Way {
  int connector, mate_type, mate_connector, connection_type, number;
  bool is_member_b;
  model::Pose X_CD;  ///< The mate's face in ours.
};

/// Whether a module cannot tell two ways to dock the same connectors apart: the mate's face is at
/// the same place, and so its emitter.
bool LookAlike(const Way& a, const Way& b) { return a.X_CD.isApprox(b.X_CD, 1e-6); }

/// As the simulator's sensors tell them: with this module as member a where the model has it so.
/// Where two connections join the same faces in the same way, the one declared first counts.
std::vector<Way> WaysOf(const model::Model& model, const DockFaces& faces, int type) {
  // A module hears from a mate its type and connector and where its emitter is; ways that look
  // alike by that are one.
  std::vector<Way> ways;
  using Mates = std::tuple<int, int, int>;  // Connector, mate's type and connector.
  std::map<Mates, std::vector<size_t>> known;
  const auto add = [&](const Way& way) {
    std::vector<size_t>& others = known[{way.connector, way.mate_type, way.mate_connector}];
    const auto alike = [&](size_t other) { return LookAlike(way, ways[other]); };
    if (std::any_of(others.begin(), others.end(), alike)) return;
    others.push_back(ways.size());
    ways.push_back(way);
  };
  // First those where this type is member a, then those where it is member b.
  for (const bool as_b : {false, true}) {
    for (size_t c = 0; c < model.connection_types.size(); ++c) {
      const model::ConnectionType& connection = model.connection_types[c];
      if ((as_b ? connection.type_b : connection.type_a) != type) continue;
      for (const model::ConnectionOption& option : connection.options) {
        const model::Pose X_CD = FaceInFace(faces, connection, option);
        add({as_b ? option.connector_b : option.connector_a,
             as_b ? connection.type_a : connection.type_b,
             as_b ? option.connector_a : option.connector_b, static_cast<int>(c), option.number,
             as_b, as_b ? X_CD.inverse() : X_CD});
      }
    }
  }
  return ways;
}

std::string Rows(const std::vector<Way>& ways, double emitter_offset) {
  std::string rows;
  for (const Way& way : ways) {
    // The controller compares the direction in which it hears the mate's emitter.
    const Eigen::Vector3d at = way.X_CD * (emitter_offset * Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d direction =
        at.norm() > 1e-6 * emitter_offset ? Eigen::Vector3d(at.normalized()) : at;
    rows +=
        fmt::format("  {{{}, {}, {}, {}, {}, {}, {{{:.6f}, {:.6f}, {:.6f}}}}},\n", way.connector,
                    way.mate_type, way.mate_connector, way.connection_type, way.number,
                    way.is_member_b ? 1 : 0, direction.x(), direction.y(), direction.z());
  }
  return rows;
}

/// How many values a sensor has (vm::TickInput::sensor_values).
int NumValues(const model::Sensor& sensor) {
  return sensor.type == model::SensorType::kTilt ? 3 : 1;
}

/// What the controller knows of the module's sensors.
struct SensorTables {
  std::string enumerators;  ///< SENSOR_front = 0, …: where the values of each begin.
  std::string rows;         ///< Name, kind, first value and range of each.
  int num_values = 0;
};

SensorTables SensorTablesOf(const model::ModuleType& module) {
  SensorTables tables;
  for (const model::Sensor& sensor : module.sensors) {
    tables.enumerators += fmt::format("SENSOR_{} = {}, ", sensor.name, tables.num_values);
    static constexpr const char* kKinds[] = {"MEASURES_DISTANCE", "FEELS", "MEASURES_UP"};
    tables.rows += fmt::format("{{\"{}.sensor\", {}, {}, {}}}, ", sensor.name,
                               kKinds[static_cast<int>(sensor.type)], tables.num_values,
                               Number(sensor.range_m));
    tables.num_values += NumValues(sensor);
  }
  return tables;
}

/// Bytes as the initializers of a C array.
std::string Bytes(const std::string& image) {
  std::string text;
  for (size_t i = 0; i < image.size(); ++i) {
    const int byte = static_cast<unsigned char>(image[i]);
    text += fmt::format("{}{},", i % 24 == 0 ? "\n    " : " ", byte);
  }
  return text;
}

/// Both images, aligned for the tables that are read straight out of them.
std::string ImagesHeader(const std::string& program, const std::string& kinematics) {
  return fmt::format(
      "// The program and what the module knows of itself, for the virtual machine. Written by "
      "morphbus export, not\n// by hand.\n#pragma once\n\n"
      "alignas(8) inline constexpr unsigned char kProgramImage[] = {{{}}};\n\n"
      "alignas(8) inline constexpr unsigned char kKinematicsImage[] = {{{}}};\n",
      Bytes(program), Bytes(kinematics));
}

/// Eight hexadecimal digits (FNV-1a).
std::string ShortHash(const std::string& text) {
  uint32_t hash = 2166136261U;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  return fmt::format("{:08x}", hash);
}

}  // namespace

WebotsProgram WebotsController(const model::Model& model, const DockFaces& faces, int type,
                               const WebotsImages* images) {
  // The marks of the templates in webots_controller/, and what takes their places.
  const model::ModuleType& module = model.module_types[type];
  std::string speeds, slides;
  for (const model::Joint& joint : module.joints) {
    speeds += fmt::format("{}, ", joint.speed);
    slides += joint.type == model::JointType::kPrismatic ? "1, " : "0, ";
  }
  const SensorTables sensors = SensorTablesOf(module);
  const std::vector<std::pair<std::string, std::string>> values = {
      {"TYPE", module.name},
      {"SENSORS", sensors.enumerators},
      {"NUM_SENSOR_VALUES", std::to_string(sensors.num_values)},
      {"MODULE_SENSORS", sensors.rows},
      {"JOINTS", Enumerators(module.joints, "JOINT")},
      {"NUM_JOINTS", std::to_string(module.joints.size())},
      {"CONNECTORS", Enumerators(module.connectors, "CONNECTOR")},
      {"NUM_CONNECTORS", std::to_string(module.connectors.size())},
      {"MODULE_TYPE", std::to_string(type)},
      {"MAX_STATES", std::to_string(MostStates(module))},
      {"JOINT_NAMES", Quoted(module.joints, "")},
      {"SENSOR_NAMES", Quoted(module.joints, ".sensor")},
      {"SPEEDS", speeds},
      {"SLIDES", slides},
      {"CONNECTOR_NAMES", Quoted(module.connectors, "")},
      {"EMITTER_NAMES", Quoted(module.connectors, ".emitter")},
      {"RECEIVER_NAMES", Quoted(module.connectors, ".receiver")},
      {"LOCK_SETTINGS", LockRows(model, type)},
      {"WAYS", Rows(WaysOf(model, faces, type), DockScaleOf(model).emitter_offset)},
  };
  // The wrapper, and the main program with what it needs.
  const std::string header = Filled(kWebotsModuleHeader, values);
  const std::string source = Filled(kWebotsModuleSource, values);
  const std::string main = Filled(images != nullptr ? kWebotsVmMain : kWebotsMain, values);
  std::vector<CompanionFile> files = {{"morphbus_module.h", header}, {"morphbus_module.c", source}};
  if (images != nullptr) {
    MergedVm vm = MergeVm("morphbus_vm.h");
    files.push_back({"morphbus_images.h", ImagesHeader(images->program, images->kinematics)});
    files.push_back({"morphbus_vm.h", std::move(vm.header)});
    files.push_back({"morphbus_vm.cc", std::move(vm.source)});
  }
  // Their text is part of the controller's name, so that worlds with unlike models or programs can
  // share a folder.
  std::string all = header + source + main;
  for (size_t i = 2; i < files.size(); ++i) all += files[i].bytes;
  const std::string name = fmt::format("morphbus_{}_{}", module.name, ShortHash(all));
  files.push_back({name + (images != nullptr ? ".cc" : ".c"), main});
  const std::string sources =
      images != nullptr ? fmt::format(
                              "C_SOURCES = morphbus_module.c\nCXX_SOURCES = {}.cc morphbus_vm.cc\n"
                              "USE_C_API = true\nCXX += -std=c++20 -ffp-contract=off\n",
                              name)
                        : fmt::format("C_SOURCES = {}.c morphbus_module.c\n", name);
  files.push_back({"Makefile", Filled(kWebotsMakefile, {{"SOURCES", sources}})});
  return {name, std::move(files)};
}

}  // namespace morphbus::emit
