#pragma once
// Models as the command line reads them, and their parts as it prints them.

#include <optional>
#include <string>
#include <vector>

#include "compiler/m3l/compile.h"
#include "compiler/model/kinematic_graph.h"
#include "tools/base/json.h"
#include "tools/base/messages.h"

namespace morphbus::tools {

/// Where a model is written.
struct ModelSource {
  /// The files that were read, imports included.
  source::SourceSet sources;
  /// modules[robot][module]: the place of the name of each module of the model's robots.
  std::vector<std::vector<source::Span>> modules;

  /// The names of the files: none of them may be written over.
  [[nodiscard]] std::vector<std::string> Files() const;
};

/// Compiles M3L files and prints what there is to say about them. Empty if there were errors.
/// `source`, if given, gets where the model is written, as far as files could be read.
std::optional<model::Model> LoadModel(const std::vector<std::string>& paths,
                                      ModelSource* source = nullptr);

/// Why none of `names` is the `what` ("robot", which --robot chooses) called `name`, with the
/// nearest name. An empty `name` stands for the only one of them: there are several then, or none.
/// The sentence has no option in front of it and no full stop at its end.
std::string WhyNoneOf(const std::vector<std::string>& names, const std::string& name,
                      const std::string& what);
/// The one of `all` that is called `name`, or the only one if `name` is empty. If there is none,
/// says so on stderr as above and returns nullptr. What it returns lives as long as `all`, which
/// is a vector of things that have a name.
template <class Named>
const Named* PickByName(const std::vector<Named>& all, const std::string& name,
                        const std::string& what) {
  std::vector<std::string> names;
  for (const Named& one : all) {
    if (one.name == name || (name.empty() && all.size() == 1)) return &one;
    names.push_back(one.name);
  }
  Unusable(WhyNoneOf(names, name, what));
  return nullptr;
}
/// The same for the robots of a model: the one that --robot names, else the model's only one.
inline const model::Robot* PickRobot(const model::Model& model, const std::string& name) {
  return PickByName(model.robots, name, "robot");
}

/// The place in the robot of the module called `name`; the error suggests the nearest name.
Result<int> FindModule(const model::Robot& robot, const std::string& name);

/// "m1.joint_1": the name of a joint on the command line. `at` has the index of its module in the
/// robot, `at.module`, and its own among the joints of that module's type, `at.joint`.
template <class JointPlace>
std::string JointName(const model::Model& model, const model::Robot& robot, const JointPlace& at) {
  return robot.modules[at.module].name + "." + model.TypeOf(robot, at.module).joints[at.joint].name;
}

/// A pose as `{"p":[x,y,z],"q":[w,x,y,z]}`, metres; w >= 0 and no negative zeros.
Json PoseJson(const model::Pose& X);
/// `[x,y,z]` without negative zeros, in whatever unit and frame the vector has: the key under which
/// it stands says that.
Json VectorJson(const Eigen::Vector3d& v);
/// The numbers of a JSON array, for tables; `fmt::join` writes them with one format. The array must
/// hold numbers alone, as those above do.
std::vector<double> Numbers(const Json& array);
/// The value of an attribute or a state variable as a JSON bool, number or string, by its type.
Json AttributeJson(const model::AttributeValue& value);

/// "mobility 16", or that it was not computed, and why: above a number of joints in one system of
/// loops it would take too long.
std::string MobilityText(const model::KinematicGraph& graph);

}  // namespace morphbus::tools
