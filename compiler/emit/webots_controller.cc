// The controller that the modules of a Webots world run: files that are the same for all module
// types (webots_controller/), and a table of what one of them is made of, by names of the model.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "compiler/emit/kinematics.h"
#include "compiler/emit/numbers.h"
#include "compiler/emit/shipped_sources.h"
#include "compiler/emit/webots.h"

namespace morphbus::emit {
namespace {

/// A row of the table is what a macro is called with; C defines the macros of the rows it wants.
using Rows = std::vector<std::string>;

/// The rows of one kind. `columns` says to people what stands in them.
std::string Section(const char* macro, const char* columns, const Rows& rows) {
  std::string text = fmt::format("\n/* {} */\n#ifdef {}\n", columns, macro);
  for (const std::string& row : rows) text += fmt::format("{}({})\n", macro, row);
  return text + fmt::format("#undef {}\n#endif\n", macro);
}

Rows JointRows(const model::ModuleType& module) {
  // By model::JointType.
  constexpr const char* kKinds[] = {"TURNS", "TURNS", "SLIDES", "FIXED"};
  Rows rows;
  for (const model::Joint& joint : module.joints) {
    rows.push_back(
        fmt::format("{}, {}, {}", joint.name, kKinds[static_cast<int>(joint.type)], joint.speed));
  }
  return rows;
}

Rows SensorRows(const model::ModuleType& module) {
  // By model::SensorType, each with how many values it has (vm::TickInput::sensor_values).
  constexpr const char* kKinds[] = {"MEASURES_DISTANCE, 1", "FEELS, 1", "MEASURES_UP, 3"};
  Rows rows;
  for (const model::Sensor& sensor : module.sensors) {
    rows.push_back(fmt::format("{}, {}, {}", sensor.name, kKinds[static_cast<int>(sensor.type)],
                               Number(sensor.range_m)));
  }
  return rows;
}

/// At least 1: C has no empty arrays.
size_t MostStates(const model::ModuleType& module) {
  size_t most = 1;
  for (const model::Connector& c : module.connectors) most = std::max(most, c.states.size());
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
      const auto found = std::ranges::find(state.values, asked.value);
      if (found != state.values.end()) own[s] = static_cast<int>(found - state.values.begin());
    }
  }
  return own;
}

/// The settings of connectors' own states in which connections hold them, each once and in the
/// order of the connections. A module knows nothing of its mate's states. Settings that ask for
/// none of a connector's own are left out.
Rows LockRows(const model::ModuleType& module, const std::vector<DockWay>& ways) {
  Rows rows;
  for (const DockWay& way : ways) {
    const model::Connector& own = module.connectors[way.own.connector];
    const auto add = [&](const model::StateSetting& setting) {
      std::vector<int> values = OwnValues(own, setting, !way.is_member_b);
      if (std::ranges::all_of(values, [](int value) { return value < 0; })) return;
      // Rows are equally long, as C wants its arrays.
      values.resize(MostStates(module), -1);
      std::string row = fmt::format("{}, {}", own.name, fmt::join(values, ", "));
      if (std::ranges::find(rows, row) == rows.end()) rows.push_back(std::move(row));
    };
    add(way.option->states);
    std::ranges::for_each(way.option->other_states, add);
  }
  return rows;
}

/// As the simulator's sensors tell them: with this module as member a where the model has it so.
/// Where two connections join the same faces in the same way, the one declared first counts.
Rows WayRows(const model::Model& model, const DockFaces& faces, std::vector<DockWay> ways) {
  std::ranges::stable_sort(ways, {}, &DockWay::is_member_b);
  const double offset = DockScaleOf(model).emitter_offset;
  Rows rows;
  std::vector<std::pair<const DockWay*, model::Pose>> told;
  for (const DockWay& way : ways) {
    // A module hears from a mate its type and connector and where its emitter is; ways that look
    // alike by that are one.
    const model::Pose X_CD = MateFace(faces, way);
    const auto looks_like_it = [&](const auto& other) {
      return other.first->own == way.own && other.first->mate == way.mate &&
             other.second.isApprox(X_CD, 1e-6);
    };
    if (std::ranges::any_of(told, looks_like_it)) continue;
    told.emplace_back(&way, X_CD);
    // The controller compares the direction in which it hears the mate's emitter.
    const Eigen::Vector3d at = X_CD * (offset * Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d to = at.norm() > 1e-6 * offset ? Eigen::Vector3d(at.normalized()) : at;
    rows.push_back(fmt::format("{}, {}, {}, {}, {}, {:d}, {{{:.6f}, {:.6f}, {:.6f}}}",
                               model.module_types[way.own.type].connectors[way.own.connector].name,
                               way.mate.type, way.mate.connector, way.connection_type,
                               way.option->number, way.is_member_b, to.x(), to.y(), to.z()));
  }
  return rows;
}

/// What the files that are the same for all module types read of this one.
std::string ModuleTable(const model::Model& model, const DockFaces& faces, int type) {
  // Rows of macros (X-macros), which the C files include several times with another meaning each.
  const model::ModuleType& module = model.module_types[type];
  const std::vector<DockWay> ways = DockWaysOf(model, type);
  Rows connectors;
  for (const model::Connector& connector : module.connectors) connectors.push_back(connector.name);
  return fmt::format(
             "/* What module type {} is made of, for morphbus_module.h and .c. Written by morphbus "
             "export, not by hand. */\n",
             module.name) +
         Section("MODULE", "The number of the type, and the most states of a connector.",
                 {fmt::format("{}, {}", type, MostStates(module))}) +
         Section("JOINT", "Name, how it moves, greatest speed (rad/s, m/s).", JointRows(module)) +
         Section("CONNECTOR", "Name.", connectors) +
         Section("SENSOR", "Name, what it does, how many values it has, range (m).",
                 SensorRows(module)) +
         Section("LOCK", "Connector, and a value of each of its states, -1 for any.",
                 LockRows(module, ways)) +
         Section("WAY",
                 "Connector; mate's type and connector; connection and number, of which it is "
                 "member b; to the mate's emitter.",
                 WayRows(model, faces, ways));
}

/// Bytes as the initializers of a C array, aligned for the tables that are read straight out of it.
std::string ByteArray(const char* name, const std::string& bytes) {
  std::string text = fmt::format("\nalignas(8) inline constexpr unsigned char {}[] = {{", name);
  for (size_t i = 0; i < bytes.size(); ++i) {
    const int byte = static_cast<unsigned char>(bytes[i]);
    text += fmt::format("{}{},", i % 24 == 0 ? "\n    " : " ", byte);
  }
  return text + "};\n";
}

/// Eight hexadecimal digits (FNV-1a).
std::string ShortHash(const std::vector<CompanionFile>& files) {
  uint32_t hash = 2166136261U;
  for (const CompanionFile& file : files) {
    for (const char c : file.bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  }
  return fmt::format("{:08x}", hash);
}

}  // namespace

Result<WebotsProgram> WebotsController(const model::Model& model, const DockFaces& faces, int type,
                                       const std::string& program, uint64_t model_hash) {
  const auto shipped = [](const std::string& file) {
    return std::string(ShippedSource("compiler/emit/webots_controller/" + file));
  };
  std::vector<CompanionFile> files = {{"morphbus_module.def", ModuleTable(model, faces, type)},
                                      {"morphbus_module.h", shipped("morphbus_module.h")},
                                      {"morphbus_module.c", shipped("morphbus_module.c")},
                                      {"Makefile", shipped("Makefile")}};
  std::string main = "main.c";
  if (!program.empty()) {
    const Result<std::string> kinematics = KinematicsImage(model, type, model_hash);
    if (!kinematics) return Fail(kinematics.error().message);
    files.push_back({"morphbus_images.h",
                     "// The program, and what the module knows of itself, for the virtual "
                     "machine. Written by morphbus export,\n// not by hand.\n#pragma once\n" +
                         ByteArray("kProgramImage", program) +
                         ByteArray("kKinematicsImage", *kinematics)});
    MergedVm vm = MergeVm("morphbus_vm.h");
    files.push_back({"morphbus_vm.h", std::move(vm.header)});
    files.push_back({"morphbus_vm.cc", std::move(vm.source)});
    main = "vm_main.cc";
  }
  files.push_back({main, shipped(main)});
  // Their text is part of the controller's name, so that worlds with unlike models or programs can
  // share a folder. The main file is called like it.
  const std::string name =
      fmt::format("morphbus_{}_{}", model.module_types[type].name, ShortHash(files));
  files.back().path = name + main.substr(main.find('.'));
  return WebotsProgram{name, std::move(files)};
}

}  // namespace morphbus::emit
