#pragma once
// The immutable model that the M3L compiler produces: module types, solved connections, robots.
//
// Everything here is SI (metres, kilograms, radians), whatever `unit` the source used.
// Frames: L link, M module (its ideal frame at joints 0), R robot frame (NUE: +X north, +Y up,
// +Z east). X_AB is the pose of B in A. At joint values 0 all link frames of a module coincide with
// M; a link's frame is M carried by the link.
// The checker makes one model for each compilation, or FromProto reads one back (model_proto.h).
// Everything refers to everything else by index, so that a model can be copied and moved freely.

#include <Eigen/Geometry>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "compiler/base/role_colors.h"

namespace morphbus::model {

/// A rigid pose; rotation part always orthonormal, no mirror image.
using Pose = Eigen::Isometry3d;

/// How a joint moves; continuous joints turn without limits.
enum class JointType { kRevolute, kContinuous, kPrismatic, kFixed };

/// "revolute", "continuous", "prismatic", "fixed": M3L's words, which URDF, SDF and the keywords'
/// XML share. In the order of JointType.
inline constexpr const char* kJointTypeNames[] = {"revolute", "continuous", "prismatic", "fixed"};
/// The word of a type.
inline const char* JointTypeName(JointType type) { return kJointTypeNames[static_cast<int>(type)]; }
/// The type that a word names, or nothing.
std::optional<JointType> JointTypeNamed(std::string_view name);

/// A fixed attribute of a point or module: `gender="male"`, `extended=false`, `length=0.2`.
using AttributeValue = std::variant<bool, double, std::string>;

/// A number as a person writes it: up to 9 digits, no trailing zeros, no negative zero.
std::string NumberText(double value);

/// An attribute's value as written in M3L: "male", true, 0.5. Strings get quotes but no escapes, so
/// the text is for messages and not for reading back.
std::string ValueText(const AttributeValue& value);

/// A free state variable of a connector: `extended=[bool]` or `mode=["a","b"]`.
/// A connector's state is not fixed by the model: a connection may ask for a value
/// (StateRequirement).
struct StateVariable {
  std::string name;
  /// Allowed values; {false, true} for `[bool]`.
  std::vector<AttributeValue> values;
};

/// A place where two modules can be mated: a point of a module that is flagged `connector`.
struct Connector {
  std::string name;
  /// The index of the link that carries it.
  int link = 0;
  /// Its centre in the module frame (m).
  Eigen::Vector3d p_MoCo_M;
  /// The names of its sub-points, and below their positions in the same order.
  std::vector<std::string> subpoint_names;
  /// The positions of the sub-points in M (m).
  std::vector<Eigen::Vector3d> subpoints;
  /// The attributes whose values are fixed, by name.
  std::map<std::string, AttributeValue> attributes;
  /// The attributes whose values may change while the robot runs.
  std::vector<StateVariable> states;
  /// Unit `normal=` directions in M: key "" for the centre, else a sub-point's name. Often empty.
  std::map<std::string, Eigen::Vector3d> normals;
};

/// A part of how a link looks: a convex hull, or the triangles of a mesh.
struct VisualPart {
  /// Its points in M (m), of single precision, as viewers have them.
  std::vector<Eigen::Vector3d> points;
  /// Indices of points, counter-clockwise as seen from outside; none: the part is the convex hull
  /// of the points.
  std::vector<std::array<int, 3>> triangles = {};
  /// Its own color; absent: that of its module, or of the role that the module plays.
  std::optional<Color> color = {};
};

/// A rigid body of a module.
struct Link {
  std::string name;
  /// The points of its shape, in M (m), in source order: their convex hull, or where there are
  /// part_ends the hulls of its parts, one part's points behind the other's. Empty without a shape;
  /// a part may be flat.
  std::vector<Eigen::Vector3d> hull;
  /// Of a shape of two or more convex parts: behind which point of `hull` each part ends. Empty for
  /// a shape of one part.
  std::vector<int> part_ends = {};
  /// The mass (kg), spread evenly over the parts of the shape (link_mass.h).
  double mass_kg = 0.0;
  /// Coulomb friction where it touches something; absent: that of the world.
  std::optional<double> friction = {};
  /// The standard deviation by which the link of one module weighs more or less than that of
  /// another, as a fraction of the mass.
  double mass_spread = 0.0;
  /// How it looks in pictures, viewers and exports, and nowhere else; empty: like its shape.
  std::vector<VisualPart> visual = {};

  /// How it looks: `visual`, or else a part for each convex part of its shape.
  [[nodiscard]] std::vector<VisualPart> Looks() const;
  /// The points of each convex part; none for a link without a shape.
  [[nodiscard]] std::vector<std::vector<Eigen::Vector3d>> Parts() const;
};

/// A joint between two links. Driving it by +q turns (or slides) A relative to B about (along)
/// `axis`: X_MA(q) = X_MB * Trans(o) * Rot(axis, q) * Trans(-o), with o = p_MoJo_M.
struct Joint {
  std::string name;
  JointType type = JointType::kRevolute;
  int link_a = 0;
  /// Indices of the two links, A and B, into ModuleType::links.
  int link_b = 0;
  /// A point on the axis in M (m); named Jo, the joint's origin.
  Eigen::Vector3d p_MoJo_M;
  /// The unit direction of A's axis in M.
  Eigen::Vector3d axis;
  /// The lower limit (rad or m); -infinity for continuous joints.
  double lower = 0.0;
  /// The upper limit (rad or m); +infinity for continuous joints.
  double upper = 0.0;
  /// The greatest torque (N·m), or force for prismatic joints (N).
  double effort = 1.9;
  /// The greatest speed (rad/s), or m/s for prismatic joints.
  double speed = 3.14159265358979323846;
  /// The play between motor and link: how far one can move without the other (rad), or m for
  /// prismatic joints.
  double backlash = 0.0;
  /// How much later the motor does what it is told (s).
  double delay_s = 0.0;
};

/// What a sensor measures: how far something is, whether something touches, how far it is tilted.
enum class SensorType { kDistance, kContact, kTilt };

/// "distance", "contact", "tilt": M3L's words, in the order of SensorType.
inline constexpr const char* kSensorTypeNames[] = {"distance", "contact", "tilt"};
/// The word of a type.
inline const char* SensorTypeName(SensorType type) {
  return kSensorTypeNames[static_cast<int>(type)];
}
/// The type that a word names, or nothing.
std::optional<SensorType> SensorTypeNamed(std::string_view name);

/// A sensor of a module, rigid with one of its links (docs/m3l.md, sensors).
struct Sensor {
  std::string name;
  SensorType type = SensorType::kDistance;
  /// The index of the link that carries it.
  int link = 0;
  /// Where it sits (m), and the unit direction in which it looks, in M.
  Eigen::Vector3d p_MoSo_M = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
  /// Distance: how far it sees. Contact: how far from it a touch counts, 0 for anywhere on its
  /// link. Tilt: 0. Metres.
  double range_m = 0.0;
  /// The standard deviation of its readings: m for a distance, rad for a tilt, 0 for a contact.
  double noise = 0.0;
};

/// What the joints of a module do once its electronics are dead: their motors exert nothing, or
/// they stay where they are (as with a worm gear or a brake).
enum class OnLoss { kLimp, kHold };

/// A type of module: what `module` defines.
struct ModuleType {
  std::string name;
  /// Metres per model unit of the source; the lengths here are converted already.
  double unit_m = 1.0;
  OnLoss on_loss = OnLoss::kLimp;
  std::vector<Link> links;
  std::vector<Joint> joints;
  std::vector<Connector> connectors;
  std::vector<Sensor> sensors = {};

  // The functions below give the index of the member called `name`, or nothing.
  [[nodiscard]] std::optional<int> FindLink(const std::string& name) const;
  [[nodiscard]] std::optional<int> FindJoint(const std::string& name) const;
  [[nodiscard]] std::optional<int> FindConnector(const std::string& name) const;
};

/// State that a connector must be in for a connection to be made, e.g. b.c3.extended == true.
struct StateRequirement {
  /// True for a state variable of a's connector, false for one of b's.
  bool of_a = true;
  std::string variable;
  AttributeValue value;

  bool operator==(const StateRequirement&) const = default;
};

/// A setting of state variables of the two connectors: all of these values together.
using StateSetting = std::vector<StateRequirement>;

/// One numbered way of mating two connectors: a rigid pose between the modules that carry them.
struct ConnectionOption {
  /// The number by which M3L names it, counted from 1 over the whole connection (docs/m3l.md,
  /// numbering).
  int number = 0;
  /// The index of a's connector in module type a, and of b's in module type b.
  int connector_a = 0;
  int connector_b = 0;
  /// The pose of b's module frame in a's, with the joints of both at 0 (m).
  Pose X_AB = Pose::Identity();
  /// What the connectors' states must be, if anything: of the settings in which the connection
  /// holds, the one in which it is made.
  StateSetting states;
  /// The further settings in which it holds, where the conditions allow several: it parts when
  /// neither `states` nor any of these is the case.
  std::vector<StateSetting> other_states = {};
};

/// Why two connectors cannot be mated by a connection at all.
struct PairRejection {
  int connector_a = 0;
  int connector_b = 0;
  /// The reason in words for people: "c1 and c2 are both male".
  std::string reason;
};

/// A solved `connection` definition between module types a and b, which may be the same.
struct ConnectionType {
  std::string name;
  /// The indices of the two types in Model::module_types.
  int type_a = 0;
  int type_b = 0;
  /// The number of rigid motions of connector pairs before pruning by hulls, for reports.
  int candidates = 0;
  /// The ways to mate the two types; options[i].number is i + 1.
  std::vector<ConnectionOption> options;
  /// The pairs without an option, in the order of their connectors.
  std::vector<PairRejection> rejections;
};

/// A module of a robot: a named instance of a module type.
struct ModuleInstance {
  std::string name;
  int type = 0;
  /// The start value of each joint (rad or m), in declaration order.
  std::vector<double> start;
};

/// One entry of a robot's `connections`: two modules held together. module_a plays the connection's
/// member a. Modules are indices into Robot::modules, connectors into those of their types.
struct Docking {
  int module_a = 0;
  int connector_a = 0;
  int module_b = 0;
  int connector_b = 0;
  /// The index of the connection in Model::connection_types.
  int connection_type = 0;
  /// The index into ConnectionType::options.
  int option = 0;
};

/// An assembly of modules: what `robot` defines.
struct Robot {
  std::string name;
  std::vector<ModuleInstance> modules;
  /// The connections, in declared order.
  std::vector<Docking> dockings;
  /// The module, and the link of it, that carries the robot frame.
  int root_module = 0;
  int root_link = 0;
  /// The robot frame R in the root link's frame L (m).
  Pose X_LR = Pose::Identity();

  /// The index of the module called `name`, or nothing.
  [[nodiscard]] std::optional<int> FindModule(const std::string& name) const;
};

/// The compiled model; immutable once built.
struct Model {
  std::vector<ModuleType> module_types;
  std::vector<ConnectionType> connection_types;
  std::vector<Robot> robots;

  /// The robot called `name`, or null. The pointer is good while the model lives.
  [[nodiscard]] const Robot* FindRobot(const std::string& name) const;
  /// The type of module number `module` of `robot`; the number must be good (checked).
  [[nodiscard]] const ModuleType& TypeOf(const Robot& robot, int module) const;
  // The connectors that a docking of `robot` joins, and the option that it chooses.
  [[nodiscard]] const Connector& EndA(const Robot& robot, const Docking& docking) const;
  [[nodiscard]] const Connector& EndB(const Robot& robot, const Docking& docking) const;
  [[nodiscard]] const ConnectionOption& OptionOf(const Docking& docking) const;
};

/// Largest side of the axis-aligned box round a module's points (hulls, connectors, sub-points), m.
/// Geometric tolerances are 1e-6 of it; 0 for a module without points.
double ExtentOf(const ModuleType& type);

/// The connection option by which `docking` looks from module_b's side: the option of the same
/// connection type whose member a is b's connector and whose transform is the inverse
/// (to 1e-6 of the modules' extent). Absent for connections between unlike types.
std::optional<int> MirrorOption(const Model& model, const Docking& docking);

}  // namespace morphbus::model
