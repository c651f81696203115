// morphbus graph: the kinematic graph of a robot (paper, Sec. IV and Fig. 6).

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "compiler/emit/dot.h"
#include "compiler/model/kinematic_graph.h"
#include "tools/commands.h"
#include "tools/output_path.h"

namespace morphbus::tools {
namespace {

struct Options {
  std::string file;
  std::string robot;
  std::string dot;
  bool json = false;
};

const char* RelationText(model::AxisRelation relation) {
  switch (relation) {
    case model::AxisRelation::kParallel:
      return "parallel";
    case model::AxisRelation::kOrthogonal:
      return "orthogonal";
    case model::AxisRelation::kSkew:
      return "skew";
    case model::AxisRelation::kCoplanar:
      return "coplanar";
  }
  return "";
}

Json GraphJson(const model::Model& model, const model::Robot& robot,
               const model::KinematicGraph& graph) {
  const auto link_name = [&](const model::LinkRef& ref) {
    return robot.modules[static_cast<size_t>(ref.module)].name + "." +
           model.TypeOf(robot, ref.module).links[static_cast<size_t>(ref.link)].name;
  };
  Json bodies = Json::array();
  for (const model::Body& body : graph.bodies) {
    Json links = Json::array();
    for (const model::LinkRef& ref : body.links) links.push_back(link_name(ref));
    bodies.push_back({{"links", links}, {"degree", body.degree}});
  }
  const auto joint_name = [&](const model::GraphJoint& joint) {
    return robot.modules[static_cast<size_t>(joint.module)].name + "." +
           model.TypeOf(robot, joint.module).joints[static_cast<size_t>(joint.joint)].name;
  };
  Json joints = Json::array();
  for (const model::GraphJoint& joint : graph.joints) {
    // What was not computed is null: a reader must not take it for an answer.
    Json axes = graph.adjacency_listed ? Json::object() : Json();
    for (size_t i = 0; i < joint.adjacent.size(); ++i) {
      const model::GraphJoint& other = graph.joints[static_cast<size_t>(joint.adjacent[i])];
      axes[joint_name(other)] = RelationText(joint.adjacent_axes[i]);
    }
    joints.push_back({{"name", joint_name(joint)},
                      {"adjacent", joint.num_adjacent},
                      {"locked", graph.locked_computed ? Json(joint.locked) : Json()},
                      {"axis", VectorJson(joint.axis_R)},
                      {"adjacent_axes", axes}});
  }
  return {{"bodies", bodies},
          {"joints", joints},
          {"mobility", graph.mobility ? Json(*graph.mobility) : Json()}};
}

void PrintAxes(const Json& joints) {
  fmt::print("\njoint                 its axis is\n");
  for (const Json& joint : joints) {
    // "parallel to m2.joint_1, m2.joint_2; orthogonal to m5.joint_1".
    std::string text;
    for (const char* relation : {"parallel", "orthogonal", "coplanar", "skew"}) {
      std::string names;
      for (const auto& [name, value] : joint["adjacent_axes"].items()) {
        if (value == relation) names += (names.empty() ? "" : ", ") + name;
      }
      if (names.empty()) continue;
      const bool with = relation == std::string("coplanar");
      text += fmt::format("{}{} {} {}", text.empty() ? "" : "; ", relation, with ? "with" : "to",
                          names);
    }
    if (!text.empty()) fmt::print("{:<20}  {}\n", joint["name"].get<std::string>(), text);
  }
}

void PrintGraph(const model::Robot& robot, const model::KinematicGraph& computed,
                const Json& graph) {
  fmt::print("robot {}: {} bodies, {} joints, {}\n", robot.name, graph["bodies"].size(),
             graph["joints"].size(), MobilityText(computed));
  fmt::print("\ndegree  body\n");
  for (const Json& body : graph["bodies"]) {
    std::string links;
    for (const Json& link : body["links"]) {
      links += (links.empty() ? "" : " + ") + link.get<std::string>();
    }
    fmt::print("{:>6}  {}\n", body["degree"].get<int>(), links);
  }
  fmt::print("\nadjacent  locked  axis (north, up, east)        joint\n");
  for (const Json& joint : graph["joints"]) {
    const Json& axis = joint["axis"];
    fmt::print("{:>8}  {:<6}  {:8.4f} {:8.4f} {:8.4f}    {}\n", joint["adjacent"].get<int>(),
               joint["locked"].is_null() ? "?" : (joint["locked"].get<bool>() ? "yes" : "no"),
               axis[0].get<double>(), axis[1].get<double>(), axis[2].get<double>(),
               joint["name"].get<std::string>());
  }
  if (computed.adjacency_listed) {
    PrintAxes(graph["joints"]);
  } else {
    fmt::print("\nhow axes lie to those of adjacent joints: not listed (over {} pairs)\n",
               model::kMaxAdjacencies);
  }
}

int Graph(const Options& options) {
  if (options.json && IsStdout(options.dot)) {
    return Unusable("--dot - and --json both write to standard output: give --dot a file");
  }
  std::vector<std::string> files;
  const std::optional<model::Model> model = LoadModel({options.file}, &files);
  if (!model || !SparesInputs(options.dot, files)) return kUnusable;
  const model::Robot* robot = PickRobot(*model, options.robot);
  if (robot == nullptr) return kUnusable;
  const model::KinematicGraph graph = model::BuildKinematicGraph(*model, *robot);
  if (!options.dot.empty()) {
    const Result<void> written =
        WriteFile(options.dot, emit::KinematicGraphDot(*model, *robot, graph));
    if (!written) return Unusable(written.error().message);
    if (IsStdout(options.dot)) return kDone;
  }
  const Json json = GraphJson(*model, *robot, graph);
  if (options.json) {
    PrintJson(json);
  } else {
    PrintGraph(*robot, graph, json);
  }
  return kDone;
}

}  // namespace

void AddGraph(CLI::App& app, Action* action) {
  CLI::App* sub =
      app.add_subcommand("graph", "Bodies, joints, degrees, adjacency and mobility of a robot");
  auto options = std::make_shared<Options>();
  sub->add_option("FILE", options->file, "M3L file")->required();
  sub->add_option("--robot", options->robot, "The robot's name (default: the only one)");
  sub->add_option("--dot", options->dot,
                  "Also write the graph for Graphviz ('-': only that, on stdout)");
  sub->add_flag("--json", options->json, "One JSON object on stdout");
  sub->footer(
      "Examples:\n  morphbus graph models/mtran.m3l --robot quadruped\n"
      "  morphbus graph models/mtran.m3l --robot quadruped --dot - | dot -Tsvg -o graph.svg");
  sub->callback([options, action] { *action = [options] { return Graph(*options); }; });
}

}  // namespace morphbus::tools
