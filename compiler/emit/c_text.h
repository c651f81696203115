#pragma once
// What the C back ends share: names and numbers as C writes them.

#include <string>
#include <vector>

namespace morphbus::emit {

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
