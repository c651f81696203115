#pragma once
// Names for what the messages of a run give as numbers, by the run's description.

#include <cstdint>
#include <memory>
#include <morphbus/fault_t.hpp>
#include <string>
#include <string_view>

#include "bridge/description/run_model.h"

namespace morphbus::tools {

/// The names of one run's modules, their parts, and the roles of its program. Without a description
/// there are none. A name is empty where the number names nothing, as in a damaged message; modules
/// are counted as in messages (module_id), parts in order of declaration.
class RunNames {
 public:
  RunNames() = default;
  /// `run` may be null, or without a robot.
  explicit RunNames(std::shared_ptr<const bridge::RunModel> run) : run_(std::move(run)) {}

  /// The same if messages of this model are meant (header_t.model_hash), else no names: the bus may
  /// have another run of the same name by now.
  [[nodiscard]] RunNames Of(int64_t model_hash) const;

  /// The number of the module of this name; -1 if there is none.
  [[nodiscard]] int NumberOf(std::string_view module) const;
  [[nodiscard]] std::string Module(int module) const;
  [[nodiscard]] std::string Joint(int module, int joint) const;
  [[nodiscard]] std::string Link(int module, int link) const;
  [[nodiscard]] std::string Connector(int module, int connector) const;
  /// A state variable of a connector, and a value of it as M3L writes it.
  [[nodiscard]] std::string State(int module, int connector, int state) const;
  [[nodiscard]] std::string StateValue(int module, int connector, int state, int value) const;
  /// A value of the module's sensors, of which a tilt sensor has three: "eye", "level.x".
  [[nodiscard]] std::string SensorValue(int module, int value) const;
  /// A `connection` definition of the model.
  [[nodiscard]] std::string Connection(int connection) const;
  /// A role of the program with this hash.
  [[nodiscard]] std::string Role(int64_t program_hash, int role) const;
  /// A fault of a module of this type that ran the program with this hash, on one line, with
  /// numbers for what has no name.
  [[nodiscard]] std::string Fault(int64_t program_hash, const std::string& type,
                                  const morphbus::fault_t& fault) const;
  /// A line that a module says of the program with this hash: "legs.dyn:7", or "line 7" where the
  /// file is not known.
  [[nodiscard]] std::string Line(int64_t program_hash, int line) const;

 private:
  /// The type of a module; null if there is no such module.
  [[nodiscard]] const model::ModuleType* TypeOf(int module) const;
  /// The state variable; null if there is none.
  [[nodiscard]] const model::StateVariable* FindState(int module, int connector, int state) const;

  std::shared_ptr<const bridge::RunModel> run_;
};

}  // namespace morphbus::tools
