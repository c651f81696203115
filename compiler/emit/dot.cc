#include "compiler/emit/back_ends.h"

#include <fmt/format.h>

namespace morphbus::emit {
namespace {

/// A name inside a quoted DOT string. Names of M3L are identifiers, but a model may also come from
/// a log, and then be anything.
std::string Escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

// How every graph of ours begins.
std::string Header(const std::string& name) {
  return fmt::format(
      "graph \"{}\" {{\n"
      "  graph [overlap=false, splines=true];\n"
      "  node [fontname=\"Helvetica\", fontsize=11];\n"
      "  edge [fontname=\"Helvetica\", fontsize=9];\n",
      Escaped(name));
}

/// A vertex of the assembly graph: the link that carries a connector.
std::string LinkNode(int module, int link) { return fmt::format("m{}_l{}", module, link); }

}  // namespace

std::string AssemblyGraphDot(const model::Model& model, const model::Robot& robot) {
  std::string out = Header(robot.name);
  for (int module = 0; module < std::ssize(robot.modules); ++module) {
    const model::ModuleType& type = model.TypeOf(robot, module);
    // A module is a cluster: its links, thick the one that carries the robot frame, and its joints.
    out += fmt::format("  subgraph \"cluster_{}\" {{\n    label=\"{} ({})\";\n", module,
                       Escaped(robot.modules[module].name), Escaped(type.name));
    for (int l = 0; l < std::ssize(type.links); ++l) {
      const bool root = module == robot.root_module && l == robot.root_link;
      out += fmt::format("    {} [shape=box, label=\"{}\"{}];\n", LinkNode(module, l),
                         Escaped(type.links[l].name), root ? ", penwidth=2" : "");
    }
    for (const model::Joint& joint : type.joints) {
      out += fmt::format("    {} -- {} [label=\"{}\", style={}];\n", LinkNode(module, joint.link_a),
                         LinkNode(module, joint.link_b), Escaped(joint.name),
                         joint.type == model::JointType::kFixed ? "bold" : "solid");
    }
    out += "  }\n";
  }
  for (const model::Docking& d : robot.dockings) {
    // A docking joins two links of different clusters; it has its number, and its connectors at its
    // ends.
    const model::Connector& a = model.EndA(robot, d);
    const model::Connector& b = model.EndB(robot, d);
    out +=
        fmt::format("  {} -- {} [label=\"{}\", taillabel=\"{}\", headlabel=\"{}\", penwidth=2];\n",
                    LinkNode(d.module_a, a.link), LinkNode(d.module_b, b.link),
                    model.OptionOf(d).number, Escaped(a.name), Escaped(b.name));
  }
  return out + "}\n";
}

std::string KinematicGraphDot(const model::Model& model, const model::Robot& robot,
                              const model::KinematicGraph& graph) {
  std::string out = Header(robot.name);
  // Without this the picture would seem to say that no joint is locked.
  if (!graph.locked_computed)
    out += "  label=\"locked joints: not computed, too many in one system of loops\";\n";
  for (size_t b = 0; b < graph.bodies.size(); ++b) {
    // A body lists its links; what is locked by loops is dashed.
    std::string label;
    for (const model::LinkRef& ref : graph.bodies[b].links) {
      label += Escaped(robot.modules[ref.module].name) + "." +
               Escaped(model.TypeOf(robot, ref.module).links[ref.link].name) + "\\n";
    }
    out += fmt::format("  b{} [shape=ellipse, label=\"{}degree {}\"];\n", b, label,
                       graph.bodies[b].degree);
  }
  // A joint is an edge between the two bodies that it moves.
  for (const model::GraphJoint& joint : graph.joints) {
    out += fmt::format("  b{} -- b{} [label=\"{}.{}\\n{} adjacent{}\"{}];\n", joint.body_a,
                       joint.body_b, Escaped(robot.modules[joint.module].name),
                       Escaped(model.TypeOf(robot, joint.module).joints[joint.joint].name),
                       joint.num_adjacent, joint.locked ? ", locked" : "",
                       joint.locked ? ", style=dashed" : "");
  }
  return out + "}\n";
}

}  // namespace morphbus::emit
