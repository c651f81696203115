// morphbus graph: the kinematic graph of a robot (paper, Sec. IV and Fig. 6).

#include <fmt/format.h>

#include <map>

#include "compiler/base/text.h"
#include "compiler/congruence/congruence.h"
#include "compiler/emit/back_ends.h"
#include "compiler/model/kinematic_graph.h"
#include "tools/base/output_path.h"
#include "tools/base/print.h"
#include "tools/commands/commands.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus graph`.
struct GraphOptions {
  std::string file;
  std::string robot;
  std::string dot;
  bool force = false;
  bool json = false;
};

/// The word that "adjacent_axes" has for a relation of two axes.
const char* RelationText(model::AxisRelation relation) {
  using model::AxisRelation;
  static const std::map<AxisRelation, const char*> words = {
      {AxisRelation::kParallel, "parallel"},
      {AxisRelation::kOrthogonal, "orthogonal"},
      {AxisRelation::kSkew, "skew"},
      {AxisRelation::kCoplanar, "coplanar"}};
  return words.at(relation);
}

/// The graph as docs/cli.md has it. Frames: axes in the robot frame at the start values.
Json GraphJson(const model::Model& model, const model::Robot& robot,
               const model::KinematicGraph& graph) {
  // Bodies are the links that connections hold together.
  Json bodies = Json::array();
  for (const model::Body& body : graph.bodies) {
    Json links = Json::array();
    for (const model::LinkRef& ref : body.links) {
      links.push_back(robot.modules[ref.module].name + "." +
                      model.TypeOf(robot, ref.module).links[ref.link].name);
    }
    bodies.push_back({{"links", links}, {"degree", body.degree}});
  }
  // Joints with those next to them: adjacent joints share a body.
  Json joints = Json::array();
  for (const model::GraphJoint& joint : graph.joints) {
    // What was not computed is null: a reader must not take it for an answer.
    Json axes = graph.adjacency_listed ? Json::object() : Json();
    for (size_t i = 0; i < joint.adjacent.size(); ++i) {
      const model::GraphJoint& other = graph.joints[joint.adjacent[i]];
      axes[JointName(model, robot, other)] = RelationText(joint.adjacent_axes[i]);
    }
    joints.push_back({{"name", JointName(model, robot, joint)},
                      {"adjacent", joint.num_adjacent},
                      {"locked", graph.locked_computed ? Json(joint.locked) : Json()},
                      {"axis", VectorJson(joint.axis_R)},
                      {"adjacent_axes", axes}});
  }
  return {{"bodies", bodies},
          {"joints", joints},
          {"mobility", graph.mobility ? Json(*graph.mobility) : Json()},
          {"congruence_hash", Hex(congruence::CongruenceHash(model, robot))}};
}

/// How each joint lies to its adjacent ones, grouped by relation.
void PrintAxes(const Json& joints) {
  Print("\njoint                 its axis is\n");
  for (const Json& joint : joints) {
    // "parallel to m2.joint_1, m2.joint_2; orthogonal to m5.joint_1".
    std::string text;
    for (const char* relation : {"parallel", "orthogonal", "coplanar", "skew"}) {
      std::string names;
      for (const auto& [name, value] : joint["adjacent_axes"].items()) {
        if (value == relation) names += (names.empty() ? "" : ", ") + name;
      }
      if (names.empty()) continue;
      // English says "parallel to", but "coplanar with".
      const bool with = relation == std::string("coplanar");
      text += fmt::format("{}{} {} {}", text.empty() ? "" : "; ", relation, with ? "with" : "to",
                          names);
    }
    if (!text.empty()) Print("{:<20}  {}\n", joint["name"].get<std::string>(), text);
  }
}

/// Bodies with their degrees, joints with their axes, then PrintAxes.
void PrintGraph(const model::Robot& robot, const model::KinematicGraph& computed,
                const Json& graph) {
  Print("robot {}: {} bodies, {} joints, {}, congruence hash {}\n", robot.name,
        graph["bodies"].size(), graph["joints"].size(), MobilityText(computed),
        graph["congruence_hash"].get<std::string>());
  // The degree of a body is the number of joints at it.
  Print("\ndegree  body\n");
  for (const Json& body : graph["bodies"]) {
    std::string links;
    for (const Json& link : body["links"]) {
      links += (links.empty() ? "" : " + ") + link.get<std::string>();
    }
    Print("{:>6}  {}\n", body["degree"].get<int>(), links);
  }
  // A question mark stands where it was not computed whether loops lock a joint.
  Print("\nadjacent  locked  axis (north, up, east)        joint\n");
  for (const Json& joint : graph["joints"]) {
    Print("{:>8}  {:<6}  {:8.4f}    {}\n", joint["adjacent"].get<int>(),
          joint["locked"].is_null() ? "?" : (joint["locked"].get<bool>() ? "yes" : "no"),
          fmt::join(Numbers(joint["axis"]), " "), joint["name"].get<std::string>());
  }
  // A star of thousands of joints has too many pairs to list.
  if (computed.adjacency_listed) {
    PrintAxes(graph["joints"]);
  } else {
    Print("\nhow axes lie to those of adjacent joints: not listed (over {} pairs)\n",
          model::kMaxAdjacencies);
  }
}

/// Writes the graph for Graphviz if asked to, and prints it as text or JSON.
int Graph(const GraphOptions& options) {
  if (options.json && IsStdout(options.dot)) {
    return Unusable("--dot - and --json both write to standard output: give --dot a file");
  }
  // The robot's graph at its start values.
  ModelSource source;
  const std::optional<model::Model> model = LoadModel({options.file}, &source);
  if (!model || !MayWrite(options.dot, outputs::kDot, options.force, source.Files()))
    return kUnusable;
  const model::Robot* robot = PickRobot(*model, options.robot);
  if (robot == nullptr) return kUnusable;
  const model::KinematicGraph graph = model::BuildKinematicGraph(*model, *robot);
  // With "-" the graph is all that goes to stdout.
  if (!options.dot.empty()) {
    const Result<void> written =
        WriteFile(options.dot, emit::KinematicGraphDot(*model, *robot, graph));
    if (!written) return Unusable(written.error().message);
    if (IsStdout(options.dot)) return kDone;
  }
  const Json json = GraphJson(*model, *robot, graph);
  // Text and JSON are printed from the same object, so they agree.
  if (options.json) {
    PrintJson(json);
  } else {
    PrintGraph(*robot, graph, json);
  }
  return kDone;
}

}  // namespace

void AddGraph(CommandLine* line) {
  Subcommand sub = line->Add("graph", "Bodies, joints, degrees, adjacency and mobility of a robot");
  auto options = std::make_shared<GraphOptions>();
  sub.Add("FILE.m3l", &options->file, "M3L file").Required();
  sub.Robot(&options->robot);
  sub.Add("--dot", &options->dot, "Also write the graph for Graphviz ('-': only that, on stdout)")
      .TypeName("FILE");
  sub.Force(&options->force);
  sub.Json(&options->json);
  sub.Footer(
      "Examples:\n  morphbus graph models/mtran.m3l --robot quadruped\n"
      "  morphbus graph models/mtran.m3l --robot quadruped --dot - | dot -Tsvg -o graph.svg");
  sub.Do([options] { return Graph(*options); });
}

}  // namespace morphbus::tools
