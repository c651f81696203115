#pragma once
// Graphs as pictures: Graphviz DOT.

#include <string>

#include "compiler/model/kinematic_graph.h"
#include "compiler/model/robot_model.h"

namespace morphbus::emit {

/// The assembly (paper, Fig. 5): a box a module with its links and joints, an edge a connection,
/// labelled with connectors and number.
std::string AssemblyGraphDot(const model::Model& model, const model::Robot& robot);

/// The kinematic graph of the robot, `graph` (paper, Fig. 6): a vertex a body with its links and
/// degree, an edge a joint with its number of adjacent joints; locked joints dashed.
std::string KinematicGraphDot(const model::Model& model, const model::Robot& robot,
                              const model::KinematicGraph& graph);

}  // namespace morphbus::emit
