#pragma once
// Models: types of modules, the connections between them, and robots that are made of them.
//
// Library morphbus-model. A model comes from the compiler (morphbus/m3l/m3l.h), from a log
// (morphbus/observe/log.h) or from bytes. Objects are immutable and small: copies share what they
// refer to, and any number of threads may use them at once. Units are SI: m, kg, rad, N, N m, s.
// The robot frame R has x north, y up and z east.

#include <morphbus/export.h>
#include <morphbus/failure.h>
#include <morphbus/model/robot.h>
#include <morphbus/pose.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace morphbus {

/// A type of module, by the names of its parts, in the order in which M3L declares them.
struct ModuleType {
  std::string name;
  std::vector<std::string> links;
  std::vector<std::string> joints;
  std::vector<std::string> connectors;
  std::vector<std::string> sensors;
};

/// One of the numbered ways in which a connection joins two modules.
struct ConnectionOption {
  /// The number by which M3L names it, from 1.
  int number = 0;
  /// The names of the connectors that meet: of the first module and of the second.
  std::string connector_a;
  std::string connector_b;
  /// The pose of the second module's frame in the first one's, where the joints of both are at 0.
  Pose X_AB;
};

/// A connection between two types of modules, solved.
struct ConnectionType {
  std::string name;
  /// The names of the two types; they may be the same.
  std::string type_a;
  std::string type_b;
  /// All ways to join them; the number of options[i] is i + 1.
  std::vector<ConnectionOption> options;
};

/// A compiled model.
class MORPHBUS_EXPORT Model {
 public:
  /// Reads what Bytes() wrote. Throws Failure for anything else, with the place that is wrong; the
  /// bytes may come from anywhere.
  static Model FromBytes(std::string_view bytes);
  /// The model as a message of Protocol Buffers (docs/data.md). The same model gives the same
  /// bytes.
  [[nodiscard]] std::string Bytes() const;
  /// The hash by which messages, run descriptions and logs name the model.
  [[nodiscard]] uint64_t Hash() const;

  /// All types of modules and connections, in the order of the source.
  [[nodiscard]] const std::vector<ModuleType>& module_types() const;
  [[nodiscard]] const std::vector<ConnectionType>& connection_types() const;
  /// The names of the robots, in the order of the source.
  [[nodiscard]] std::vector<std::string> RobotNames() const;
  /// The robot of that name; with an empty one the model's only robot. Throws Failure, with the
  /// nearest name, where there is none, or there are several.
  [[nodiscard]] Robot robot(std::string_view name = {}) const;

  /// For the other libraries of Morphbus: what is inside.
  class Content;
  explicit Model(std::shared_ptr<const Content> content);
  [[nodiscard]] const std::shared_ptr<const Content>& content() const { return content_; }

 private:
  std::shared_ptr<const Content> content_;
};

}  // namespace morphbus
