#pragma once
// About what `rot=` counts turns: the outward normal of member a's connector. Internal to
// check_docking.cc and check_module.cc.

#include <optional>
#include <vector>

#include "compiler/m3l/checker.h"
#include "compiler/model/mating_turn.h"

namespace morphbus::m3l::internal {

/// The outward normal of connector `index`: its `normal=`; else the normal of the plane of its
/// sub-points (with its centre if they lie on one line); if they span no plane (a key on the axis,
/// say), the axis about which the first of `options` that differ by a turn of the connector alone
/// do so. It points away from the middle of the hull of its link, or where that lies in the plane,
/// from the mean of all points of the link, or else of the module. Nothing if there is no line.
/// `options` are ways to mate the connector as member a's.
std::optional<model::FaceNormal> NormalOf(
    const CheckedModule& module, int index,
    const std::vector<const model::ConnectionOption*>& options);

}  // namespace morphbus::m3l::internal
