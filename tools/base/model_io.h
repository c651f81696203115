#pragma once
// Models as the command line reads them, and their parts as it prints them.

#include <optional>
#include <string>
#include <vector>

#include "compiler/m3l/compile.h"
#include "compiler/model/kinematic_graph.h"
#include "tools/base/json.h"

namespace morphbus::tools {

/// Compiles M3L files and prints what there is to say about them. Empty if there were errors.
/// `read`, if given, gets the files that this read, imports included.
std::optional<model::Model> LoadModel(const std::vector<std::string>& paths,
                                      std::vector<std::string>* read = nullptr);

/// The robot called `name` (the only one if `name` is empty); if there is none, says so on stderr
/// with the nearest name and returns nullptr.
const model::Robot* PickRobot(const model::Model& model, const std::string& name);

/// A pose as `{"p":[x,y,z],"q":[w,x,y,z]}`, metres; w >= 0 and no negative zeros.
Json PoseJson(const model::Pose& X);
/// `[x,y,z]` without negative zeros.
Json VectorJson(const Eigen::Vector3d& v);
/// The value of an attribute or a state variable as a JSON bool, number or string, by its type.
Json AttributeJson(const model::AttributeValue& value);

/// "mobility 16", or that it was not computed, and why.
std::string MobilityText(const model::KinematicGraph& graph);

}  // namespace morphbus::tools
