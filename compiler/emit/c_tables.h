#pragma once
// The kinematics image of a module type as C constants (vm/image/kinematics_c.h): features of
// links, joints and connectors, and each connection with its transform, from either side.

#include <cstdint>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "compiler/emit/exported.h"
#include "compiler/model/robot_model.h"

namespace morphbus::emit {

/// The tables of one module type as text, for the C back end to put together.
struct CTables {
  /// The #include of the types, for the top of the header.
  std::string include;
  /// Declarations of the constants, for the header.
  std::string declarations;
  /// The constants themselves, for the source.
  std::string definitions;
  /// The header with the types (KinematicsTypesInC), which lies beside the others.
  std::vector<CompanionFile> companions;
};

/// The tables of module type `type` (an index), named `prefix`_kinematics, for `stem`.h. Their
/// numbers are read back from the verified image, so that they cannot differ from it; centres and
/// sub-points of the connectors, which no image has, come from the model. Fails as KinematicsImage
/// does.
Result<CTables> TablesInC(const model::Model& model, int type, uint64_t model_hash,
                          const std::string& prefix, const std::string& stem);

/// Name and text of the header that declares the types, the same for all module types.
CompanionFile KinematicsTypesInC();

}  // namespace morphbus::emit
