#pragma once
// A logged robot at one time, ready to be drawn: links where the simulator had them, coloured by
// the roles that the modules then play.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "compiler/world/obstacle.h"
#include "logger/compare/kinematic_tracks.h"
#include "logger/log/run_log.h"
#include "logger/show/drawing.h"

namespace morphbus::logger {

/// Colors of the roles of the logs' programs, of which the first that names a role decides. Of a
/// log without a program: of the roles that its modules had, in the order of their names.
RoleColors ColorsOf(const std::vector<const RunLog*>& logs);

/// Every role that some module had at some time, by name, with the empty one for none.
std::vector<std::string> RolesIn(const RunLog& log);

/// A row a role, each once; "(no role)" for the empty one.
std::vector<LegendEntry> RoleLegend(const RoleColors& colors,
                                    const std::vector<std::string>& roles);

/// The legend as a paragraph of a page.
std::string RoleKeyHtml(const RoleColors& colors, const std::vector<std::string>& roles);

/// The role that each module has at `time_us` (sim time, µs), in the order of Robot::modules.
std::vector<std::string> RolesAt(const RunLog& log, int64_t time_us);

/// Index into RunLog::world of the sample at `time_us` or the last one before it; of an earlier
/// time the first. The log must have one.
size_t WorldAt(const RunLog& log, int64_t time_us);

/// The robot at RunLog::world[sample]. What no body carries lies as at rest.
Scene SceneAt(const RunLog& log, const SimulatedPoses& poses, size_t sample,
              const RoleColors& colors);

/// Adds what stands in the world beside the robot, in grey; planes as plates of at most 2 m.
void AddObstacles(const std::vector<world::Obstacle>& obstacles, Scene* scene);

/// Where a link is in the world at that sample; at rest in the robot frame if no body carries it.
model::Pose LinkPoseAt(const RunLog& log, const SimulatedPoses& poses, size_t sample, int module,
                       int link);

/// A <picture> element with the drawing in it (PNG), so that a page needs no other file: once light
/// and once dark (Drawing::dark), of which browsers show what the reader prefers. `alt` says what
/// it shows. Empty if it cannot be drawn.
std::string PictureHtml(Drawing drawing, const std::string& alt);

}  // namespace morphbus::logger
