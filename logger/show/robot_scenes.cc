#include "logger/show/robot_scenes.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <set>

#include "bridge/description/run_model.h"
#include "compiler/base/base64.h"
#include "logger/show/svg_plot.h"
#include "vm/image/image_texts.h"

namespace morphbus::logger {

RoleColors ColorsOf(const std::vector<const RunLog*>& logs) {
  RoleColors colors;
  for (const RunLog* log : logs) {
    // A program that cannot be read has no names.
    // All roles that modules can play have a colour, in the program's order, whether one plays them
    // or not, so that two runs of it look alike.
    const bool has_names = log->described != nullptr && log->described->images_problem.empty();
    colors.Add(has_names ? vm::PlayableRoles(log->described->images.program()) : RolesIn(*log));
  }
  return colors;
}

std::vector<std::string> RolesIn(const RunLog& log) {
  std::set<std::string> roles;
  for (const ModuleSeries& module : log.modules) {
    for (const StatusSample& sample : module.status) roles.insert(sample.status.role_name);
  }
  return {roles.begin(), roles.end()};
}

std::vector<LegendEntry> RoleLegend(const RoleColors& colors,
                                    const std::vector<std::string>& roles) {
  // Sorted by name; the empty one, which stands for none, comes first.
  const std::set<std::string> unique(roles.begin(), roles.end());
  std::vector<LegendEntry> legend;
  for (const std::string& role : unique) {
    legend.push_back({role.empty() ? "(no role)" : role, colors.Of(role)});
  }
  return legend;
}

std::vector<std::string> RolesAt(const RunLog& log, int64_t time_us) {
  std::vector<std::string> roles;
  for (const model::ModuleInstance& instance : log.robot->modules) {
    // The last STATUS before the time says which role a module has.
    const ModuleSeries* series = log.FindModule(instance.name);
    std::string role;
    for (size_t i = 0; series != nullptr && i < series->status.size(); ++i) {
      // A module that the log has no messages of has no role, and is drawn in grey.
      if (series->status[i].time_us <= time_us) role = series->status[i].status.role_name;
    }
    roles.push_back(std::move(role));
  }
  return roles;
}

size_t WorldAt(const RunLog& log, int64_t time_us) {
  // Samples are in order of time; that of the time itself counts, too.
  const auto after = std::ranges::upper_bound(log.world, time_us, {}, &WorldSample::time_us);
  const auto at = after == log.world.begin() ? after : after - 1;
  return static_cast<size_t>(at - log.world.begin());
}

model::Pose LinkPoseAt(const RunLog& log, const SimulatedPoses& poses, size_t sample, int module,
                       int link) {
  const std::optional<model::Pose> seen = poses.X_WL(sample, module, link);
  return seen ? *seen : log.described->X_RL_start[module][link];
}

Scene SceneAt(const RunLog& log, const SimulatedPoses& poses, size_t sample,
              const RoleColors& colors) {
  // What no body carries is drawn as it lies in the robot frame at the start.
  std::vector<std::vector<model::Pose>> X_WL = log.described->X_RL_start;
  for (int m = 0; m < static_cast<int>(X_WL.size()); ++m) {
    for (int l = 0; l < static_cast<int>(X_WL[m].size()); ++l) {
      X_WL[m][l] = poses.X_WL(sample, m, l).value_or(X_WL[m][l]);
    }
  }
  std::vector<Color> by_role;
  for (const std::string& role : RolesAt(log, log.world[sample].time_us)) {
    by_role.push_back(colors.Of(role));
  }
  Scene scene = SceneOf(*log.model, *log.robot, X_WL, by_role);
  AddObstacles(log.described->obstacles, &scene);
  return scene;
}

void AddObstacles(const std::vector<world::Obstacle>& obstacles, Scene* scene) {
  constexpr double kPlate_m = 2.0;
  // An owner that no module is: names and roles are of modules.
  constexpr int kNobody = -1;
  for (world::Obstacle obstacle : obstacles) {
    if (obstacle.shape == world::Shape::kPlane) {
      // A plane without end would make the picture's scale too small to see the robot.
      obstacle.size = obstacle.size.cwiseMin(kPlate_m);
    }
    SceneHull& hull = scene->hulls.emplace_back(
        SceneHull{world::CornersOf(obstacle), obstacle.X_WO, {0.55, 0.55, 0.55}, kNobody});
    // A mesh is not its hull.
    if (obstacle.mesh) hull.triangles = obstacle.mesh->triangles;
  }
}

std::string RoleKeyHtml(const RoleColors& colors, const std::vector<std::string>& roles) {
  std::string html = "<p class='keys'>";
  for (const LegendEntry& entry : RoleLegend(colors, roles)) {
    html += fmt::format("<span><i style='background:{}'></i>{}</span>", CssColor(entry.color),
                        EscapeHtml(entry.text));
  }
  return html + "</p>";
}

std::string PictureHtml(Drawing drawing, const std::string& alt) {
  // Both pictures are in the page, and the browser shows the one of its own scheme: there is no
  // script to draw anew. Paper is light in any case.
  drawing.dark = false;
  const Result<std::string> light = RenderPicture(drawing, "picture.png");
  drawing.dark = true;
  const Result<std::string> dark = RenderPicture(drawing, "picture.png");
  if (!light || !dark) return "";
  return fmt::format(
      "<picture><source media='screen and (prefers-color-scheme:dark)' "
      "srcset='data:image/png;base64,{}'>"
      "<img alt='{}' src='data:image/png;base64,{}'></picture>",
      Base64(*dark), EscapeHtml(alt), Base64(*light));
}

}  // namespace morphbus::logger
