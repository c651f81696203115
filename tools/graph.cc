// morphbus graph: the kinematic graph of a robot (paper, Sec. IV and Fig. 6).

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "compiler/emit/dot.h"
#include "compiler/model/kinematic_graph.h"
#include "tools/commands.h"

namespace morphbus::tools {
namespace {

struct Options {
  std::string file;
  std::string robot;
  std::string dot;
  bool json = false;
};

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
  Json joints = Json::array();
  for (const model::GraphJoint& joint : graph.joints) {
    joints.push_back(
        {{"name",
          robot.modules[static_cast<size_t>(joint.module)].name + "." +
              model.TypeOf(robot, joint.module).joints[static_cast<size_t>(joint.joint)].name},
         {"adjacent", joint.adjacent.size()},
         {"locked", joint.locked},
         {"axis", VectorJson(joint.axis_R)}});
  }
  return {{"bodies", bodies}, {"joints", joints}, {"mobility", graph.mobility}};
}

void PrintGraph(const model::Robot& robot, const Json& graph, bool locked_computed) {
  fmt::print("robot {}: {} bodies, {} joints, mobility {}\n", robot.name, graph["bodies"].size(),
             graph["joints"].size(), graph["mobility"].get<int>());
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
               !locked_computed ? "?" : (joint["locked"].get<bool>() ? "yes" : "no"),
               axis[0].get<double>(), axis[1].get<double>(), axis[2].get<double>(),
               joint["name"].get<std::string>());
  }
}

int Graph(const Options& options) {
  const std::optional<model::Model> model = LoadModel({options.file});
  if (!model) return kUnusable;
  const model::Robot* robot = PickRobot(*model, options.robot);
  if (robot == nullptr) return kUnusable;
  const model::KinematicGraph graph = model::BuildKinematicGraph(*model, *robot);
  if (!options.dot.empty()) {
    const Result<void> written =
        WriteFile(options.dot, emit::KinematicGraphDot(*model, *robot, graph));
    if (!written) return Unusable(written.error().message);
    if (options.dot == "-") return kDone;
  }
  const Json json = GraphJson(*model, *robot, graph);
  if (options.json) {
    PrintJson(json);
  } else {
    PrintGraph(*robot, json, graph.locked_computed);
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
