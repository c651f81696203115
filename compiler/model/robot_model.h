#pragma once
// The immutable model that the M3L compiler produces: module types, solved connections, robots.
//
// Everything here is SI (metres, kilograms, radians), whatever `unit` the source used.
// Frames: L link, M module (its ideal frame at joints 0), R robot frame (NUE: +X north, +Y up,
// +Z east). X_AB is the pose of B in A. At joint values 0 all link frames of a module coincide with
// M; a link's frame is M carried by the link.

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace morphbus::model {

/// A rigid pose; rotation part always orthonormal, no mirror image.
using Pose = Eigen::Isometry3d;

enum class JointType { kRevolute, kContinuous, kPrismatic, kFixed };

/// A fixed attribute of a point or module: `gender="male"`, `extended=false`, `length=0.2`.
using AttributeValue = std::variant<bool, double, std::string>;

/// A free state variable of a connector: `extended=[bool]` or `mode=["a","b"]`.
struct StateVariable {
  std::string name;
  /// Allowed values; {false, true} for `[bool]`.
  std::vector<AttributeValue> values;
};

/// A place where two modules can be mated.
struct Connector {
  std::string name;
  int link = 0;              ///< Index of the link that carries it.
  Eigen::Vector3d p_MoCo_M;  ///< Its centre, in the module frame (m).
  std::vector<std::string> subpoint_names;
  std::vector<Eigen::Vector3d> subpoints;  ///< Positions in M (m), same order as the names.
  std::map<std::string, AttributeValue> attributes;
  std::vector<StateVariable> states;
  /// Unit `normal=` directions in M: key "" for the centre, else a sub-point's name. Often empty.
  std::map<std::string, Eigen::Vector3d> normals;
};

/// A rigid body of a module.
struct Link {
  std::string name;
  /// Vertices of the convex hull's point set, in M (m), in source order; may be empty or flat.
  std::vector<Eigen::Vector3d> hull;
  double mass_kg = 0.0;
};

/// A joint between two links. Driving it by +q turns (or slides) A relative to B about (along)
/// `axis`: X_MA(q) = X_MB * Trans(o) * Rot(axis, q) * Trans(-o), with o = p_MoJo_M.
struct Joint {
  std::string name;
  JointType type = JointType::kRevolute;
  int link_a = 0;
  int link_b = 0;
  Eigen::Vector3d p_MoJo_M;               ///< Origin of A's axis in M (m).
  Eigen::Vector3d axis;                   ///< Unit direction of A's axis in M.
  double lower = 0.0;                     ///< rad or m; -infinity for continuous joints.
  double upper = 0.0;                     ///< rad or m; +infinity for continuous joints.
  double effort = 1.9;                    ///< N·m (N for prismatic).
  double speed = 3.14159265358979323846;  ///< rad/s (m/s for prismatic).
};

struct ModuleType {
  std::string name;
  double unit_m = 1.0;  ///< Metres per model unit of the source.
  std::vector<Link> links;
  std::vector<Joint> joints;
  std::vector<Connector> connectors;

  [[nodiscard]] std::optional<int> FindLink(const std::string& name) const;
  [[nodiscard]] std::optional<int> FindJoint(const std::string& name) const;
  [[nodiscard]] std::optional<int> FindConnector(const std::string& name) const;
};

/// State that a connector must be in for a connection to be made, e.g. b.c3.extended == true.
struct StateRequirement {
  bool of_a = true;  ///< True: a state variable of a's connector, else of b's.
  std::string variable;
  AttributeValue value;
};

/// One numbered way of mating two connectors.
struct ConnectionOption {
  int number = 0;  ///< 1-based over the whole connection (docs/m3l.md, numbering).
  int connector_a = 0;
  int connector_b = 0;
  Pose X_AB = Pose::Identity();  ///< b's module frame in a's module frame, joints at 0 (m).
  std::vector<StateRequirement> states;
};

/// Why two connectors cannot be mated by a connection at all.
struct PairRejection {
  int connector_a = 0;
  int connector_b = 0;
  std::string reason;  ///< For people: "c1 and c2 are both male".
};

/// A solved `connection` definition.
struct ConnectionType {
  std::string name;
  int type_a = 0;  ///< Indices into Model::module_types.
  int type_b = 0;
  int candidates = 0;  ///< Rigid motions of connector pairs before pruning by hulls.
  std::vector<ConnectionOption> options;  ///< options[i].number == i + 1.
  std::vector<PairRejection> rejections;  ///< Pairs without an option, connectors in order.
};

/// A module of a robot.
struct ModuleInstance {
  std::string name;
  int type = 0;
  std::vector<double> start;  ///< Start value of each joint (rad or m), declaration order.
};

/// One entry of a robot's `connections`. module_a plays the connection's member a.
struct Docking {
  int module_a = 0;
  int connector_a = 0;
  int module_b = 0;
  int connector_b = 0;
  int connection_type = 0;
  int option = 0;  ///< Index into ConnectionType::options.
};

struct Robot {
  std::string name;
  std::vector<ModuleInstance> modules;
  std::vector<Docking> dockings;  ///< In declared order.
  int root_module = 0;            ///< The module whose link carries the robot frame.
  int root_link = 0;
  Pose X_LR = Pose::Identity();  ///< Robot frame R in the root link's frame L (m).

  [[nodiscard]] std::optional<int> FindModule(const std::string& name) const;
};

/// The compiled model; immutable once built.
struct Model {
  std::vector<ModuleType> module_types;
  std::vector<ConnectionType> connection_types;
  std::vector<Robot> robots;

  [[nodiscard]] const Robot* FindRobot(const std::string& name) const;
  [[nodiscard]] const ModuleType& TypeOf(const Robot& robot, int module) const;
};

/// Largest side of the axis-aligned box round a module's points (hulls, connectors, sub-points), m.
/// Geometric tolerances are 1e-6 of it; 0 for a module without points.
double ExtentOf(const ModuleType& type);

/// The connection option by which `docking` looks from module_b's side: the option of the same
/// connection type whose member a is b's connector and whose transform is the inverse
/// (to 1e-6 of the modules' extent). Absent for connections between unlike types.
std::optional<int> MirrorOption(const Model& model, const Docking& docking);

}  // namespace morphbus::model
