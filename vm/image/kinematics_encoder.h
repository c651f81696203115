#pragma once
// Writes kinematics images (vm/image/kinematics_image.h). For the compiler and for tests: uses the
// heap, and is a library of its own (morphbus_vm_encode) that no module process links.

#include <cstdint>
#include <string>
#include <vector>

#include "vm/image/kinematics_image.h"

namespace morphbus::vm {

/// What an image says, with names of its own. Angles are in radians and lengths in metres. The
/// compiler fills it in from a model, and the encoder does not keep it.
struct KinematicsTables {
  /// A joint, as in KinJoint, with limits that may be infinite.
  struct Joint {
    std::string name;
    JointKind kind = JointKind::kRevolute;
    /// The links that it joins, by index: +q turns A relative to B.
    int link_a = 0, link_b = 0;
    /// A point on the axis (m) and its unit direction, in the module frame.
    Vec3 origin_m;
    Vec3 axis;
    /// The limits (rad or m), infinite where there is none.
    double lower = 0, upper = 0;
    /// The greatest speed (rad/s or m/s).
    double speed = 0;
  };
  /// A state variable of a connector; a bool has two values.
  struct State {
    std::string name;
    int num_values = 2;
  };
  /// A connector, as in KinConnector.
  struct Connector {
    std::string name;
    /// The index of the link that carries it.
    int link = 0;
    std::vector<State> states;
  };

  /// A sensor, as in KinSensor.
  struct Sensor {
    std::string name;
    SensorKind kind = SensorKind::kDistance;
    /// The index of the link that carries it.
    int link = 0;
    /// Unit, in the module frame.
    Vec3 direction;
    double range_m = 0;
  };

  /// The name of the module type in the model.
  std::string type_name;
  /// The hash of the model that the tables come from (compiler/model/model_proto.h).
  uint64_t model_hash = 0;
  /// The names of the links, in the order of their declaration.
  std::vector<std::string> links;
  /// The joints and connectors, in the order of their declaration, which gives them their numbers.
  std::vector<Joint> joints;
  std::vector<Connector> connectors;
  std::vector<Sensor> sensors = {};
  /// The connections in any order; the encoder sorts them.
  std::vector<KinConnection> connections;
};

/// The image's bytes; `error` says in one sentence why there are none (a capacity of vm/limits.h is
/// exceeded, or the tables contradict each other). The result has passed VerifyKinematics.
std::vector<uint8_t> EncodeKinematics(const KinematicsTables& tables, std::string* error);

}  // namespace morphbus::vm
