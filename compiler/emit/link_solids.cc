#include "compiler/emit/link_solids.h"

namespace morphbus::emit {

// Each is worked out when it is first asked for.
const std::vector<std::vector<Eigen::Vector3d>>& LinkSolids::Parts(int type, int link) {
  const auto [entry, is_new] = parts_.try_emplace({type, link});
  if (is_new) entry->second = model::SolidParts(model_.module_types[type], link);
  return entry->second;
}

const std::vector<model::ConvexHull>& LinkSolids::Faces(int type, int link) {
  const auto [entry, is_new] = faces_.try_emplace({type, link});
  // Faces cost more than corners, and most formats want no faces.
  if (is_new) {
    for (const auto& part : Parts(type, link)) entry->second.push_back(model::ComputeHull(part));
  }
  return entry->second;
}

const std::vector<LookMesh>& LinkSolids::Looks(int type, int link) {
  const auto [entry, is_new] = looks_.try_emplace({type, link});
  if (is_new) entry->second = LooksOf(model_, type, link);
  return entry->second;
}

}  // namespace morphbus::emit
