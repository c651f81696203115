#include "compiler/emit/scenery.h"

#include <cctype>
#include <set>
#include <utility>

#include "compiler/emit/names.h"
#include "compiler/emit/robot_tree.h"

namespace morphbus::emit {

std::vector<world::Obstacle> FreelyNamed(std::vector<world::Obstacle> obstacles,
                                         const std::function<bool(const std::string&)>& taken) {
  std::set<std::string> used;
  for (world::Obstacle& obstacle : obstacles) {
    // Every format takes letters, digits and these.
    for (char& c : obstacle.name) {
      const bool fits = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.';
      if (!fits) c = '_';
    }
    // What was replaced may have made two names one.
    obstacle.name = FreeName(obstacle.name, [&](const std::string& tried) {
      return taken(tried) || used.count(tried) > 0;
    });
    used.insert(obstacle.name);
  }
  return obstacles;
}

std::vector<world::Obstacle> InZUp(const std::vector<world::Obstacle>& obstacles, double floor,
                                   const std::function<bool(const std::string&)>& taken) {
  // Our world lies as the robot frame does, with its floor at height 0.
  model::Pose X_ZW = RobotFrameInZUp();
  X_ZW.translation().z() = floor;
  std::vector<world::Obstacle> turned = FreelyNamed(obstacles, taken);
  for (world::Obstacle& obstacle : turned) obstacle.X_WO = X_ZW * obstacle.X_WO;
  return turned;
}

}  // namespace morphbus::emit
