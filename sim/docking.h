#pragma once
// Connectors while the robot runs: states of their variables, coming apart and joining.

#include <optional>
#include <vector>

#include "compiler/model/robot_model.h"
#include "sim/rigid_body_model.h"

namespace morphbus::sim {

/// How near two connectors must be to their ideal relative pose to snap together.
inline constexpr double kDockingDistance = 0.01;  // m
inline constexpr double kDockingAngle = 0.17;     // rad

/// Value of every free state variable: state[module][connector][variable], an index into the
/// variable's allowed values.
using ConnectorStates = std::vector<std::vector<std::vector<int>>>;

/// What the connectors of an assembled robot are in at first: the first allowed value, or what
/// their connections require where that does not allow them.
ConnectorStates InitialStates(const model::Model& model, const model::Robot& robot);

/// Index of the docking that holds this connector, if one does.
std::optional<size_t> FindDocking(const model::Robot& robot, int module, int connector);

/// Are both connectors of `docking` in one of the settings that it needs?
bool StatesAllow(const model::Model& model, const model::Robot& robot,
                 const ConnectorStates& states, const model::Docking& docking);

/// Sets the variables of both connectors to what `docking` needs, unless they allow it already.
void SetRequiredStates(const model::Model& model, const model::Robot& robot,
                       const model::Docking& docking, ConnectorStates* states);

/// The connection that this free connector can make with another free one where the links are now:
/// the nearest one within tolerance. With `states`: only where these allow it.
std::optional<model::Docking> FindMate(const model::Model& model, const model::Robot& robot,
                                       const LinkPoseTable& X_WL, int module, int connector,
                                       const ConnectorStates* states);

}  // namespace morphbus::sim
