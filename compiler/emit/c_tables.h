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
  /// The header with the types (vm/image/kinematics_c.h), which lies beside the others.
  std::vector<CompanionFile> companions;
};

/// The tables of module type `type` (an index), named `prefix`_kinematics, for `stem`.h. Their
/// numbers are read back from the verified image, so that they cannot differ from it; centres and
/// sub-points of the connectors, which no image has, come from the model. Fails as KinematicsImage
/// does.
Result<CTables> TablesInC(const model::Model& model, int type, uint64_t model_hash,
                          const std::string& prefix, const std::string& stem);

// Names and numbers as C writes them, for all back ends of C.

/// A single-precision constant, the shortest that reads back the same: "0.5f".
std::string CFloat(double value);

/// A name of M3L, or several joined by what no identifier holds ("m1.joint_1"), as an identifier.
std::string CIdentifier(std::string name);

/// What the names of a module type called `name` begin with; "morphbus_" for one called "morphbus",
/// whose tables would be called like their type (vm/image/kinematics_c.h).
std::string CModulePrefix(const std::string& name);

/// `names` as enumerators PREFIX_KIND_name, with the number of them at the end. Names that would be
/// one identifier stay apart.
std::string CEnumeration(const std::string& prefix, const std::string& kind,
                         const std::vector<std::string>& names);

}  // namespace morphbus::emit
