#include "logger/show/report_robots.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "compiler/base/text.h"
#include "logger/show/report_page.h"
#include "logger/show/robot_scenes.h"

namespace morphbus::logger {
namespace {

/// A docking that the robot declares, as one of its two modules' own.
struct Docked {
  const model::Docking* docking = nullptr;
  /// Whether the pair's modules are a and b of the docking, or the other way round.
  bool turned = false;
};

/// A connection between two roles that the robots make in unlike ways, or that only one makes.
struct Difference {
  std::string role_a, role_b;
  std::optional<Docked> in_a, in_b;
};

/// Every docking between the same two modules of a robot, by their indices in the model.
std::vector<Docked> Between(const model::Robot& robot, int module, int mate) {
  std::vector<Docked> found;
  for (const model::Docking& docking : robot.dockings) {
    if (docking.module_a == module && docking.module_b == mate) found.push_back({&docking, false});
    if (docking.module_a == mate && docking.module_b == module) found.push_back({&docking, true});
  }
  return found;
}

/// "m1.c2 – m2.c5, number 12".
std::string DockingText(const RunLog& log, const std::optional<Docked>& docked) {
  if (!docked) return "–";
  const model::Docking& d = *docked->docking;
  const model::Robot& robot = *log.robot;
  const std::string a = robot.modules[d.module_a].name + "." +
                        log.model->TypeOf(robot, d.module_a).connectors[d.connector_a].name;
  const std::string b = robot.modules[d.module_b].name + "." +
                        log.model->TypeOf(robot, d.module_b).connectors[d.connector_b].name;
  return fmt::format("{} – {}, number {}", docked->turned ? b : a, docked->turned ? a : b,
                     log.model->connection_types[d.connection_type].options[d.option].number);
}

/// The connectors by which the pair's modules are joined, and how the second then lies in the
/// first.
struct Joined {
  std::string own, other;
  model::Pose X;
};
Joined JoinedBy(const RunLog& log, const Docked& docked) {
  const model::Docking& d = *docked.docking;
  const auto name = [&](int module, int connector) {
    return log.model->TypeOf(*log.robot, module).connectors[connector].name;
  };
  const std::string a = name(d.module_a, d.connector_a);
  const std::string b = name(d.module_b, d.connector_b);
  const model::Pose& X_AB = log.model->connection_types[d.connection_type].options[d.option].X_AB;
  // A docking may be declared from either side.
  return docked.turned ? Joined{b, a, X_AB.inverse()} : Joined{a, b, X_AB};
}

/// Whether both robots join two roles by the same connectors in the same way.
bool SameDocking(const Joined& a, const Joined& b) {
  return a.own == b.own && a.other == b.other && a.X.isApprox(b.X, 1e-6);
}

/// Finds what two robots join in unlike ways: for each two roles that are joined in either.
std::vector<Difference> DockingDifferences(const RunLog& a, const RunLog& b,
                                           const Matching& matching) {
  std::vector<Difference> differences;
  for (size_t i = 0; i < matching.pairs.size(); ++i) {
    // Each two pairs once: a connection has no direction.
    for (size_t j = i + 1; j < matching.pairs.size(); ++j) {
      // Two roles in both robots, and every docking between those who play them.
      const ModulePair& one = matching.pairs[i];
      const ModulePair& other = matching.pairs[j];
      std::vector<Docked> in_a =
          Between(*a.robot, a.modules[one.a].model_index, a.modules[other.a].model_index);
      std::vector<Docked> in_b =
          Between(*b.robot, b.modules[one.b].model_index, b.modules[other.b].model_index);
      // What both have is taken away; what is left stands against each other.
      for (auto x = in_a.begin(); x != in_a.end();) {
        const auto same = std::find_if(in_b.begin(), in_b.end(), [&](const Docked& y) {
          return SameDocking(JoinedBy(a, *x), JoinedBy(b, y));
        });
        if (same == in_b.end()) {
          ++x;
          continue;
        }
        in_b.erase(same);
        x = in_a.erase(x);
      }
      // Where one robot has more dockings than the other, the rest stands against nothing.
      for (size_t k = 0; k < std::max(in_a.size(), in_b.size()); ++k) {
        Difference difference{one.role, other.role, {}, {}};
        if (k < in_a.size()) difference.in_a = in_a[k];
        if (k < in_b.size()) difference.in_b = in_b[k];
        differences.push_back(std::move(difference));
      }
    }
  }
  return differences;
}

/// One robot with what its pictures need.
struct RobotSide {
  const RunLog& log;
  const char* name;
  SimulatedPoses poses;
};

/// The robot at a time (sim time, µs), with its numbered connections.
Panel PanelOf(const RobotSide& side, int64_t time_us, const RoleColors& colors,
              const std::vector<Difference>& differences, std::optional<Docked> Difference::*own) {
  // A connection's number stands at the connector of its first module, where it was at that time.
  const size_t sample = WorldAt(side.log, time_us);
  Panel panel{SceneAt(side.log, side.poses, sample, colors), View::kThreeQuarter, ""};
  // Numbers stand for connections here, and names would hide them.
  panel.scene.names.clear();
  for (size_t i = 0; i < differences.size(); ++i) {
    const std::optional<Docked>& docked = differences[i].*own;
    if (!docked) continue;
    const model::Docking& d = *docked->docking;
    const model::Connector& connector =
        side.log.model->TypeOf(*side.log.robot, d.module_a).connectors[d.connector_a];
    const model::Pose X_WL = LinkPoseAt(side.log, side.poses, sample, d.module_a, connector.link);
    panel.scene.marks.push_back({std::to_string(i + 1), X_WL * connector.p_MoCo_M});
  }
  return panel;
}

/// What of a module differs first: a joint, a link, or the module as a whole.
struct Spot {
  int module = 0;  ///< Index in the model.
  std::optional<int> joint = {};
  int link = 0;
};

/// Where the first divergence is in both robots; nowhere if it is of none of their modules.
std::pair<std::optional<Spot>, std::optional<Spot>> FirstSpots(const RunLog& a, const RunLog& b,
                                                               const Comparison& comparison) {
  const Item& item = comparison.items[*comparison.first];
  std::pair<std::optional<Spot>, std::optional<Spot>> spots;
  // A module that only one robot has leaves the other without a spot.
  if (const auto module = a.robot->FindModule(item.module_a)) spots.first = Spot{*module};
  if (const auto module = b.robot->FindModule(item.module_b)) spots.second = Spot{*module};
  for (const ModulePair& pair : comparison.matching.pairs) {
    if (a.modules[pair.a].name != item.module_a || b.modules[pair.b].name != item.module_b) {
      continue;
    }
    for (const JointPair& joint : pair.joints) {
      if (joint.label != item.label) continue;
      spots.first->joint = joint.joint_a;
      spots.second->joint = joint.joint_b;
      return spots;
    }
    for (const LinkPair& link : pair.links) {
      if (link.label != item.label) continue;
      spots.first->link = link.link_a;
      spots.second->link = link.link_b;
    }
  }
  return spots;
}

/// Marks a spot of the robot in its picture.
void Mark(const RobotSide& side, int64_t time_us, const Spot& spot, Scene* scene) {
  const model::ModuleType& type = side.log.model->TypeOf(*side.log.robot, spot.module);
  // A joint is marked at its axis, on its first link; a link at its middle, and a module at that of
  // its first link.
  const int link = spot.joint ? type.joints[*spot.joint].link_a : spot.link;
  const Eigen::Vector3d p_M =
      spot.joint ? type.joints[*spot.joint].p_MoJo_M : LinkCentre(type.links[link]);
  const model::Pose X_WL =
      LinkPoseAt(side.log, side.poses, WorldAt(side.log, time_us), spot.module, link);
  scene->marks.push_back({"!", X_WL * p_M});
}

/// Both robots beside each other at one scale, at a time of each.
std::string Both(const RobotSide& a, const RobotSide& b, int64_t time_us, const RoleColors& colors,
                 const std::vector<Difference>& differences, const std::string& when,
                 const std::pair<std::optional<Spot>, std::optional<Spot>>& spots = {}) {
  // Each robot is in the middle of its picture, and both pictures show equally much.
  std::string html;
  Panel panels[] = {PanelOf(a, time_us, colors, differences, &Difference::in_a),
                    PanelOf(b, time_us, colors, differences, &Difference::in_b)};
  if (spots.first) Mark(a, time_us, *spots.first, &panels[0].scene);
  if (spots.second) Mark(b, time_us, *spots.second, &panels[1].scene);
  // One size for both, or one robot would look larger than the other.
  const Eigen::AlignedBox2d boxes[] = {ExtentOf(panels[0]), ExtentOf(panels[1])};
  const Eigen::Vector2d size = boxes[0].sizes().cwiseMax(boxes[1].sizes());
  for (int i = 0; i < 2; ++i) {
    panels[i].extent =
        Eigen::AlignedBox2d(boxes[i].center() - size / 2, boxes[i].center() + size / 2);
    Drawing drawing;
    drawing.panels = {panels[i]};
    drawing.panel_width_px = 560;
    const std::string text =
        fmt::format("{}, {} {}", (i == 0 ? a : b).name, (i == 0 ? a : b).log.robot->name, when);
    html += fmt::format(
        "<figure>{}<figcaption><span class='chip {}'>{}</span> {} {}</figcaption>"
        "</figure>",
        PictureHtml(drawing, text), i == 0 ? "A" : "B", i == 0 ? "A" : "B",
        EscapeHtml((i == 0 ? a : b).log.robot->name), EscapeHtml(when));
  }
  return html;
}

/// The connections that differ, numbered as in the pictures.
std::string DifferenceTable(const RunLog& a, const RunLog& b,
                            const std::vector<Difference>& differences) {
  if (differences.empty()) {
    return "<p class='dim'>Both robots are joined by the same connectors in the same ways.</p>";
  }
  std::string html = TableHead({"#no.", "between", "in A", "in B"});
  for (size_t i = 0; i < differences.size(); ++i) {
    const Difference& d = differences[i];
    html += fmt::format("<tr><td class='n'>{}</td><td>{} – {}</td><td>{}</td><td>{}</td></tr>",
                        i + 1, EscapeHtml(RoleName(d.role_a)), EscapeHtml(RoleName(d.role_b)),
                        EscapeHtml(DockingText(a, d.in_a)), EscapeHtml(DockingText(b, d.in_b)));
  }
  return html + kTableEnd;
}

}  // namespace

std::string RobotsHtml(const RunLog& a, const RunLog& b, const Comparison& comparison) {
  if (a.robot == nullptr || b.robot == nullptr || a.world.empty() || b.world.empty()) return "";
  const RobotSide side_a{a, "A", SimulatedPoses(a)};
  const RobotSide side_b{b, "B", SimulatedPoses(b)};
  const RoleColors colors = ColorsOf({&a, &b});
  const std::vector<Difference> differences = DockingDifferences(a, b, comparison.matching);
  // As they stand once all modules have roles, which the colors show; else at the start.
  int64_t cast_us = 0;
  for (const ModulePair& pair : comparison.matching.pairs) {
    cast_us = std::max({cast_us, pair.taken_a_us, pair.taken_b_us});
  }
  std::string html = "<section><h2>Both robots</h2><div class='plots'>";
  html += Both(side_a, side_b, cast_us, colors, differences,
               fmt::format("at {:.2f} s", Seconds(cast_us)));
  // Without a divergence there is only the first picture.
  if (comparison.first) {
    const int64_t time_us = comparison.items[*comparison.first].first_over_us;
    const auto spots = FirstSpots(a, b, comparison);
    const Item& item = comparison.items[*comparison.first];
    std::string when = fmt::format("at the first divergence, {:.2f} s", Seconds(time_us));
    if (spots.first || spots.second) {
      when += fmt::format("; ! is {} of {}{}{}", QuantityName(item.quantity), RoleName(item.role),
                          item.label.empty() ? "" : " ", item.label);
    }
    html += Both(side_a, side_b, time_us, colors, {}, when, spots);
  }
  html += "</div>";
  std::vector<std::string> roles = RolesAt(a, cast_us);
  for (const std::string& role : RolesAt(b, cast_us)) roles.push_back(role);
  html += RoleKeyHtml(colors, roles);
  html += "<h2>Connections that differ</h2>" + DifferenceTable(a, b, differences);
  return html + "</section>";
}

}  // namespace morphbus::logger
