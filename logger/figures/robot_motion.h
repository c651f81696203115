#pragma once
// How a robot moved, tick by tick: what the figures of a run are computed from, and how that is
// gathered from messages, be they those of a log or of a run that keeps none.
//
// Frames: W world (north, up, east; ground at y = 0), R robot frame, L link, P a point's frame.

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <memory>
#include <morphbus/actuator_t.hpp>
#include <morphbus/body_pose_t.hpp>
#include <morphbus/contact_force_t.hpp>
#include <morphbus/docked_connector_t.hpp>
#include <morphbus/joint_command_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/world_t.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bridge/outward/link_places.h"
#include "compiler/model/robot_model.h"
#include "logger/log/tracked_body.h"

namespace morphbus::logger {

/// Where the robot was at the start of one tick (m, in W).
struct RobotSample {
  int64_t time_us = 0;
  /// The centre of mass of all links together.
  Eigen::Vector3d p_WCm = Eigen::Vector3d::Zero();
  /// The robot frame, as the root's body carries it.
  Eigen::Vector3d p_WR = Eigen::Vector3d::Zero();
  /// The trunk (tracked_body.h): its centre of mass, and how it is turned.
  Eigen::Vector3d p_WT = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_WT = Eigen::Quaterniond::Identity();
};

/// One joint, a value a tick; not a number where nothing was heard.
struct JointSeries {
  /// By index in the robot, and in the module's type.
  int module = 0;
  int joint = 0;
  model::JointType type = model::JointType::kRevolute;
  /// "m1.joint_1".
  std::string name = {};
  /// The last target that it was given (rad or m), in the actuator's sign; and the velocity at
  /// which it is told to turn on (rad/s or m/s), 0 while it has a target or holds.
  std::vector<double> target = {}, velocity = {};
  /// Where it was (rad or m), and what its motor exerted in the tick before (N m or N), by its
  /// sensors.
  std::vector<double> position = {}, effort = {};
};

/// What the ground and obstacles exerted on a link, over all ticks of which WORLD is known.
struct LinkLoad {
  int module = 0;
  int link = 0;
  /// "m1.passive_block".
  std::string name;
  /// The mean force (N, in W), and the largest magnitude of a tick's (N).
  Eigen::Vector3d mean_W = Eigen::Vector3d::Zero();
  double peak_n = 0.0;
};

/// A link that touched the ground, and when.
struct GroundContact {
  int module = 0;
  int link = 0;
  /// "m1.passive_block".
  std::string name;
  /// Stretches of RobotMotion::track in which it stood: first index, and the one behind the last.
  std::vector<std::pair<int, int>> stances;
};
/// A link whose lowest point is lower than this above the ground y = 0 touches it, m.
inline constexpr double kContactHeightM = 0.005;

/// A whole run.
struct RobotMotion {
  /// Length of a tick, µs of sim time; and whether it was a run in real time, in which commands may
  /// come late.
  int32_t tick_us = 0;
  bool realtime = false;
  /// In order of time; ticks at which it is not known of every link where it was are left out.
  /// Empty for a run without WORLD.
  std::vector<RobotSample> track;
  /// All joints that may move, by module and joint; index 0 of their rows is this sim time (µs).
  int64_t first_us = 0;
  std::vector<JointSeries> joints;
  /// By module and link.
  std::vector<GroundContact> contacts;
  /// By module and link; those of links that nothing pushed are left out.
  std::vector<LinkLoad> loads;
  /// What all links weigh together.
  double mass_kg = 0.0;
};

/// The link by which a module stands for the root: the robot's root link if the module is the
/// robot's root module, else its first link.
model::LinkRef RootLinkOf(const model::Robot& robot, int module);

/// Gathers a RobotMotion from what a run publishes. All messages that are there may be given, in
/// any order as long as none comes more than kMostLateTicks ticks behind another; of a message that
/// is repeated the first counts. It keeps a few numbers a tick, so a run needs no log:
///
///   MotionRecorder recorder(model, robot, {tick_us, realtime, RootLinkOf(robot, root)});
///   recorder.Take(sensors); recorder.Take(world); recorder.Take(actuator);   // as they come
///   const RunFigures figures = MeasureFigures(recorder.Finish());            // run_figures.h
class MotionRecorder {
 public:
  static constexpr int kMostLateTicks = 32;
  struct Options {
    /// Length of a tick (µs), above 0; without it joints are not followed.
    int32_t tick_us = 0;
    bool realtime = false;
    /// Which link stands for the root.
    model::LinkRef root;
  };
  /// `model` and its `robot` outlive the recorder.
  MotionRecorder(const model::Model& model, const model::Robot& robot, const Options& options);

  /// Messages of a run; modules are named in them by their index in the robot.
  void Take(const morphbus::sensors_t& sensors);
  void Take(const morphbus::actuator_t& actuator);
  void Take(const morphbus::world_t& world);

  // The same in parts; `module` is an index in the robot, and so are the modules that bodies and
  // dockings name. What the robot does not have is passed over.
  void TakeSensed(int64_t time_us, int module, const std::vector<double>& position,
                  const std::vector<morphbus::docked_connector_t>& docked,
                  const std::vector<float>& effort = {});
  void TakeCommands(int64_t time_us, int module,
                    const std::vector<morphbus::joint_command_t>& joints);
  void TakeBodies(int64_t time_us, const std::vector<morphbus::body_pose_t>& bodies,
                  const std::vector<morphbus::contact_force_t>& contacts = {});

  /// All of it. The recorder is empty then.
  RobotMotion Finish();

 private:
  /// A body of the present layout: mass (kg), first moment in the frame of the link that stands for
  /// it (kg m).
  struct BodyMass {
    double kg = 0.0;
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  };
  /// Where a link's lowest point may be: its hull, and a ball around it, in L.
  struct LinkShape {
    const std::vector<Eigen::Vector3d>* hull = nullptr;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double radius = 0.0;
    double kg = 0.0;
    Eigen::Vector3d p_LoLcm = Eigen::Vector3d::Zero();
  };

  /// Index of a sim time in the joints' rows; none if it is no time that the run can have.
  std::optional<size_t> Slot(int64_t time_us);
  /// The joint's row; null for a fixed joint, or one that the robot lacks.
  JointSeries* RowOf(int module, int joint);
  /// What WORLD said of one tick.
  struct WorldAtTick {
    std::vector<morphbus::body_pose_t> bodies;
    std::vector<morphbus::contact_force_t> contacts;
  };
  /// Takes a tick of which all has come: places the robot, and notes what pushed it.
  void TakeWhole(int64_t time_us, WorldAtTick world);
  void Place(int64_t time_us, std::vector<morphbus::body_pose_t> bodies);
  void NoteLoads(const std::vector<morphbus::contact_force_t>& contacts);
  /// Finds which links the bodies carry, and what they weigh.
  void LayOut(const std::vector<std::pair<int, int>>& bodies);
  [[nodiscard]] std::string NameOfLink(int module, int link) const;
  void NoteContacts(const std::vector<bridge::LinkPose>& X_WB);

  const model::Model& model_;
  const model::Robot& robot_;
  Options options_;
  TrackedBody root_, trunk_;
  std::vector<std::vector<LinkShape>> shapes_;  ///< By module and link.
  RobotMotion motion_;
  std::vector<std::vector<int>> row_of_;  ///< Index in motion_.joints, by module and joint; or -1.
  size_t num_slots_ = 0;
  /// WORLD whose tick may not be complete yet, and dockings that changed, by sim time.
  std::map<int64_t, WorldAtTick> worlds_;
  std::map<int64_t, std::map<int, std::vector<morphbus::docked_connector_t>>> changed_dockings_;
  std::vector<std::optional<std::vector<morphbus::docked_connector_t>>> sensed_dockings_;
  bridge::Dockings dockings_;
  /// The bodies of the present layout, and where all links are in them.
  std::vector<std::pair<int, int>> bodies_;
  std::vector<std::vector<bridge::LinkPlace>> places_;
  std::vector<BodyMass> masses_;
  bool complete_ = false;  ///< Whether every link has its place.
  /// By module and link: index in motion_.contacts, or -1.
  std::vector<std::vector<int>> contact_of_;
  /// The loads so far, with sums in the place of means, and the ticks that they are of.
  std::map<std::pair<int, int>, LinkLoad> loads_;
  int64_t num_worlds_ = 0;
};

}  // namespace morphbus::logger
