#pragma once
// Writes kinematics images (vm/kinematics_image.h). For the compiler and for tests: uses the heap,
// and is a library of its own (morphbus_vm_encode) that no module process links.

#include <cstdint>
#include <string>
#include <vector>

#include "vm/kinematics_image.h"

namespace morphbus::vm {

/// What an image says, with owned names. Angles in radians, lengths in metres.
struct KinematicsTables {
  struct Joint {
    std::string name;
    JointKind kind = JointKind::kRevolute;
    int link_a = 0, link_b = 0;
    Vec3 origin_m;
    Vec3 axis;                    ///< Unit.
    double lower = 0, upper = 0;  ///< Infinite where unlimited.
    double speed = 0;
  };
  struct State {
    std::string name;
    int num_values = 2;
  };
  struct Connector {
    std::string name;
    int link = 0;
    std::vector<State> states;
  };

  std::string type_name;
  uint64_t model_hash = 0;
  std::vector<std::string> links;
  std::vector<Joint> joints;
  std::vector<Connector> connectors;
  std::vector<KinConnection> connections;  ///< In any order.
};

/// The image's bytes; `error` says in one sentence why there are none (a capacity of vm/limits.h is
/// exceeded, or the tables contradict each other). The result has passed VerifyKinematics.
std::vector<uint8_t> EncodeKinematics(const KinematicsTables& tables, std::string* error);

}  // namespace morphbus::vm
