#include "compiler/emit/link_solids.h"

namespace morphbus::emit {

// Each is worked out when it is first asked for.
const model::LinkMass& LinkSolids::Mass(int type, int link) {
  const auto [entry, is_new] = masses_.try_emplace({type, link});
  if (is_new) entry->second = model::ComputeLinkMass(model_.module_types[type], link);
  return entry->second;
}

const std::vector<Eigen::Vector3d>& LinkSolids::Hull(int type, int link) {
  const auto [entry, is_new] = hulls_.try_emplace({type, link});
  if (is_new) entry->second = model::SolidHull(model_.module_types[type], link);
  return entry->second;
}

const model::ConvexHull& LinkSolids::Faces(int type, int link) {
  const auto [entry, is_new] = faces_.try_emplace({type, link});
  // Faces cost more than corners, and most formats want no faces.
  if (is_new) entry->second = model::ComputeHull(Hull(type, link));
  return entry->second;
}

}  // namespace morphbus::emit
