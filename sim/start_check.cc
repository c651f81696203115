#include "sim/start_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace morphbus::sim {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

// A way in which an obstacle can go, in words and as its file has it (z up, x north, y west). Not
// upwards, where nothing would hold it.
struct Way {
  Vector3d direction_W;
  const char* words;
};
const Way kWays[] = {{Vector3d::UnitX(), "north (+x in its file)"},
                     {-Vector3d::UnitX(), "south (-x in its file)"},
                     {-Vector3d::UnitY(), "down (-z in its file)"},
                     {Vector3d::UnitZ(), "east (-y in its file)"},
                     {-Vector3d::UnitZ(), "west (+y in its file)"}};

// How far the boxes are in each other along a direction: by so much the obstacle must go.
double WayOut(const AlignedBox3d& robot, const AlignedBox3d& obstacle, const Vector3d& direction) {
  double robot_end = 0.0;
  double obstacle_end = 0.0;
  for (int k = 0; k < 3; ++k) {
    // The end of the robot that lies farthest along the direction, and that of the obstacle which
    // lies least far along it.
    robot_end += direction(k) * (direction(k) > 0.0 ? robot.max()(k) : robot.min()(k));
    obstacle_end += direction(k) * (direction(k) > 0.0 ? obstacle.min()(k) : obstacle.max()(k));
  }
  return robot_end - obstacle_end;
}

// "0.26 m north (+x in its file)": the shortest way that takes the obstacle past the robot. A plane
// without end has to go by the deepest overlap, along its normal.
std::string WayOutText(const World& world, const World::Overlap& deepest) {
  constexpr double kEndless = 1e6;
  double shortest = kEndless;
  const Way* best = nullptr;
  const bool plane = world.options().obstacles[deepest.obstacle].shape == world::Shape::kPlane;
  for (const Way& way : kWays) {
    // The plane goes against the way on which the link would get out; in another direction it has
    // to go farther, by one over the cosine between the two.
    const double along = -deepest.outward_W.dot(way.direction_W);
    const double metres =
        !plane ? WayOut(world.RobotBox(), world.ObstacleBox(deepest.obstacle), way.direction_W)
        : along > 1e-3 ? deepest.depth_m / along
                       : kEndless;
    if (metres >= shortest) continue;
    shortest = metres;
    best = &way;
  }
  if (best == nullptr) return "elsewhere";
  // Rounded up, so that it is enough.
  return fmt::format("{:.3f} m {}", std::ceil(shortest * 1e3) / 1e3, best->words);
}

}  // namespace

Result<void> CheckStart(World* world, const model::Model& model, const model::Robot& robot) {
  if (world->options().obstacles.empty()) return {};
  const std::vector<World::Overlap> overlaps = world->FindOverlaps(kMostStartOverlap);
  if (overlaps.empty()) return {};
  // A clause for each obstacle, with the link that is deepest in it; of many only the first ones.
  constexpr int kMostTold = 3;
  std::string text;
  int told = 0;
  int obstacles = 0;
  for (size_t i = 0; i < overlaps.size(); ++i) {
    const World::Overlap& overlap = overlaps[i];
    // They are sorted by obstacle and depth: the first one of an obstacle is its deepest.
    if (i > 0 && overlaps[i - 1].obstacle == overlap.obstacle) continue;
    if (++obstacles > kMostTold) continue;
    ++told;
    const auto links = std::count_if(overlaps.begin(), overlaps.end(), [&](const auto& other) {
      return other.obstacle == overlap.obstacle;
    });
    const model::ModuleType& type = model.TypeOf(robot, overlap.link.module);
    text += fmt::format("{}{}.{}{} lies {:.3f} m deep in {}: move that {}", told == 1 ? "" : "; ",
                        robot.modules[overlap.link.module].name, type.links[overlap.link.link].name,
                        links > 1 ? fmt::format(" (and {} more links)", links - 1) : "",
                        overlap.depth_m, world->options().obstacles[overlap.obstacle].name,
                        WayOutText(*world, overlap));
  }
  if (obstacles > told) text += fmt::format("; and {} more obstacles", obstacles - told);
  return Fail("the robot starts inside an obstacle: " + text);
}

}  // namespace morphbus::sim
