#pragma once
// The kinematics image of a module type: what the virtual machine on the host knows of the module
// it runs in (vm/image/kinematics_image.h).

#include <cstdint>
#include <string>

#include "compiler/base/result.h"
#include "compiler/model/robot_model.h"
#include "vm/image/kinematics_encoder.h"

namespace morphbus::emit {

/// The tables of module type `type` (an index): its links, joints and connectors, and each option
/// of each connection it can take part in, from either side. `model_hash` is model::ModelHash of
/// the serialized model. Fails where the VM's numbers do not reach (over 255 connection types,
/// numbers over 65535).
Result<vm::KinematicsTables> KinematicsTablesOf(const model::Model& model, int type,
                                                uint64_t model_hash);

/// The tables as verified bytes. Fails with a sentence that names the capacity that is exceeded.
Result<std::string> KinematicsImage(const model::Model& model, int type, uint64_t model_hash);

}  // namespace morphbus::emit
