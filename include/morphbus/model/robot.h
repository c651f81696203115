#pragma once
// A robot: modules that connections hold together, and its kinematics.
//
// Library morphbus-model; see morphbus/model/model.h for units, frames and threads.

#include <morphbus/export.h>
#include <morphbus/pose.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace morphbus {

class Model;

/// How a joint moves. A continuous one turns without limits, a prismatic one slides.
enum class JointType { kRevolute, kContinuous, kPrismatic, kFixed };

/// A module of a robot.
struct Module {
  std::string name;
  /// The name of its type (Model::module_types).
  std::string type;
};

/// A link of one of a robot's modules: a rigid body.
struct Link {
  /// The module's name and the link's: "m1.link_a".
  std::string name;
  /// The place of its module in Robot::modules.
  int module = 0;
  double mass_kg = 0;
};

/// A joint of one of a robot's modules. Where it is prismatic, values are in m, rates in m/s and
/// effort in N; else in rad, rad/s and N m.
struct Joint {
  /// The module's name and the joint's: "m1.joint_1".
  std::string name;
  /// The place of its module in Robot::modules.
  int module = 0;
  JointType type = JointType::kRevolute;
  /// The places in Robot::links of the two links. A positive value turns or moves A against B.
  int link_a = 0;
  int link_b = 0;
  /// Its limits; infinite where it is continuous.
  double lower = 0;
  double upper = 0;
  /// The greatest effort and speed of its motor.
  double effort = 0;
  double speed = 0;
  /// Its value when the robot starts.
  double start = 0;
};

/// Two connectors of a robot that hold each other.
struct Connection {
  /// The places of the two modules in Robot::modules.
  int module_a = 0;
  int module_b = 0;
  /// The names of their connectors.
  std::string connector_a;
  std::string connector_b;
  /// The name of the connection and its number (Model::connection_types).
  std::string connection;
  int number = 0;
};

/// Where all links are at one set of joint values.
struct LinkPoses {
  /// The pose X_RL of each link L in the robot frame R, in the order of Robot::links.
  std::vector<Pose> X_RL;
  /// The largest gap between connectors that close a loop, by which the values are impossible: its
  /// distance (m) and its angle (rad). 0 for a robot without loops.
  double closure_m = 0;
  double closure_rad = 0;
};

/// The geometric Jacobian of a link: how fast its frame moves for the joints' rates.
struct Jacobian {
  /// Six rows of as many numbers as the robot has joints, row by row: the velocity of the origin of
  /// the link's frame (x, y, z; m/s), then the link's angular velocity (x, y, z; rad/s), all in the
  /// robot frame R, per unit of each joint's rate.
  std::vector<double> values;
  /// How many joints there are: the length of a row.
  size_t columns = 0;

  [[nodiscard]] double At(size_t row, size_t joint) const { return values[row * columns + joint]; }
};

/// The kinematic graph (docs/graph.md) at the start values: bodies are links that cannot move
/// against each other.
struct KinematicGraph {
  /// The links of each body, as places in Robot::links.
  std::vector<std::vector<int>> bodies;
  /// A joint that can move, by its type.
  struct Edge {
    /// Its place in Robot::joints.
    int joint = 0;
    /// The bodies of its links A and B.
    int body_a = 0;
    int body_b = 0;
    /// The unit direction of its axis and a point on it (m), in the robot frame R.
    std::array<double, 3> axis_R = {};
    std::array<double, 3> point_R = {};
    /// Whether loops keep it from moving. Nothing where that was not computed (over 500 joints in
    /// one system of loops).
    std::optional<bool> locked;
  };
  std::vector<Edge> joints;
  /// How many of them can be moved independently, without the robot's own six. Nothing, likewise.
  std::optional<int> mobility;
};

/// Whether two robots are kinematically congruent, which means that they can move alike
/// (docs/congruence.md), and how.
struct Congruence {
  /// False where the question was given up: too many of their bodies look alike.
  bool decided = true;
  bool congruent = false;
  /// In how many ways; where `complete` is false there may be more.
  int64_t ways = 0;
  bool complete = true;
  /// Why they are not: the first body or joint without a counterpart. Empty if they are.
  std::string reason;

  // Of the first way, if there is one; it keeps the robot frame if any does.
  bool keeps_frame = false;
  /// For each module of the first robot the place of its counterpart in the second one; -1 where
  /// its joints go to several.
  std::vector<int> modules;
  /// The counterpart of a joint: its value there is sign * value + offset.
  struct JointImage {
    /// The places in Robot::joints of the first robot and of the second.
    int from = 0;
    int to = 0;
    int sign = 1;
    double offset = 0;
  };
  std::vector<JointImage> joints;
  /// Whether masses, centres of mass and inertias of the bodies are alike, too; and their hulls.
  bool masses_equal = false;
  bool hulls_equal = false;
};

/// A robot of a model. Joint values are given in the order of joints(), in rad, or in m where a
/// joint slides.
class MORPHBUS_EXPORT Robot {
 public:
  [[nodiscard]] const std::string& name() const;
  /// The model that it belongs to.
  [[nodiscard]] Model model() const;
  // Its parts, in the order of the source; links and joints module by module.
  [[nodiscard]] const std::vector<Module>& modules() const;
  [[nodiscard]] const std::vector<Link>& links() const;
  [[nodiscard]] const std::vector<Joint>& joints() const;
  [[nodiscard]] const std::vector<Connection>& connections() const;
  /// The place in links() or joints() of the one that is so called: "m1.joint_1". Throws Failure,
  /// with the nearest name, where there is none.
  [[nodiscard]] int FindLink(std::string_view name) const;
  [[nodiscard]] int FindJoint(std::string_view name) const;

  /// The values of all joints when the robot starts.
  [[nodiscard]] std::vector<double> StartValues() const;
  /// Where the links are. Limits are not applied. Throws Failure for another number of values than
  /// there are joints.
  [[nodiscard]] LinkPoses ForwardKinematics(std::span<const double> joint_values) const;
  /// The Jacobian of a link, by its place in links(). Joints that close a loop are taken as free,
  /// as ForwardKinematics does. Throws Failure for a place or number of values that do not exist.
  [[nodiscard]] Jacobian JacobianOf(int link, std::span<const double> joint_values) const;
  /// The kinematic graph.
  [[nodiscard]] KinematicGraph Graph() const;
  /// A number that congruent robots share and others hardly ever: it finds a robot among many, and
  /// CompareWith decides. Lengths enter it rounded to 10 µm; where ranges of joints begin does not.
  [[nodiscard]] uint64_t CongruenceHash() const;
  /// Compares it with another robot, of the same model or of another one. May take some seconds.
  [[nodiscard]] Congruence CompareWith(const Robot& other) const;
  /// Other robots of the same modules that are congruent to it and keep the robot frame: at most
  /// `most`. With a seed they are drawn at random, the same for the same seed.
  [[nodiscard]] std::vector<Robot> Variants(size_t most,
                                            std::optional<uint64_t> seed = std::nullopt) const;

  /// For the other libraries of Morphbus: what is inside.
  class Content;
  explicit Robot(std::shared_ptr<const Content> content);
  [[nodiscard]] const std::shared_ptr<const Content>& content() const { return content_; }

 private:
  std::shared_ptr<const Content> content_;
};

}  // namespace morphbus
