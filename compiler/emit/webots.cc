#include "compiler/emit/webots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "compiler/emit/left_out.h"
#include "compiler/emit/link_solids.h"
#include "compiler/emit/meshes.h"
#include "compiler/emit/names.h"
#include "compiler/emit/numbers.h"
#include "compiler/emit/robot_tree.h"
#include "compiler/emit/scenery.h"
#include "compiler/emit/vrml_writer.h"
#include "compiler/emit/webots_docks.h"
#include "compiler/emit/webots_scene.h"
#include "compiler/emit/webots_sensors.h"
#include "compiler/model/convex_hull.h"
#include "compiler/model/forward_kinematics.h"

namespace morphbus::emit {
namespace {

using Eigen::Vector3d;
using model::JointType;

constexpr double kFloorThickness = 0.1;  // m
constexpr double kTokenRadius = 1e-3;    // m, of links that have no hull.

/// Writes the world file of one robot. One object is one export; Write is called once.
class WebotsWriter {
 public:
  /// `programs` are those of the module types that the robot has.
  WebotsWriter(const model::Model& model, const model::Robot& robot, const DockFaces& faces,
               std::map<int, WebotsProgram> programs, const std::vector<world::Obstacle>& obstacles)
      : model_(model),
        robot_(robot),
        solids_(model),
        faces_(faces),
        scale_(DockScaleOf(model)),
        X_WL_(model::ForwardKinematics(model, robot, model::StartValues(robot)).X_RL),
        programs_(std::move(programs)) {
    // Each module is a Robot node of its own, so the trees are those of the types.
    for (size_t type = 0; type < model.module_types.size(); ++type) {
      trees_.push_back(TreeOf(model, ModuleAsRobot(model, static_cast<int>(type))));
    }
    // Connectors that are docked at the start are written as locked.
    for (const model::Docking& d : robot.dockings) {
      docked_.insert({d.module_a, d.connector_a});
      docked_.insert({d.module_b, d.connector_b});
    }
    const std::string floor = FreeModuleName("floor");
    obstacles_ = FreelyNamed(obstacles, [&](const std::string& name) {
      return name == floor || robot_.FindModule(name).has_value();
    });
    // The world is the robot frame, but for its height: the floor is at 0.
    double lift = kFloorClearance - LowestPoint(model, TreeOf(model, robot));
    for (auto& module : X_WL_) {
      for (model::Pose& X : module) X.translation().y() += lift;
    }
  }

  Exported Write(const std::string& controllers) {
    // The scene, then a Robot a module, in the order of the model.
    vrml_.Line("#VRML_SIM R2023b utf8");
    vrml_.Line("# Written by morphbus export. SI, radians; x north, y up, z east.");
    AppendScene();
    for (size_t m = 0; m < robot_.modules.size(); ++m) AppendModule(m);
    Exported exported;
    exported.text = vrml_.text();
    exported.warnings = Unaligned();
    // Controllers and warnings of the module types that the robot has.
    std::set<int> types;
    for (auto& [type, program] : programs_) {
      types.insert(type);
      WarnOfLimits(model_.module_types[type], &exported.warnings);
      WarnOfContactSensors(type, &exported.warnings);
      for (CompanionFile& file : program.files) {
        file.path = controllers + "/" + program.name + "/" + file.path;
        exported.companions.push_back(std::move(file));
      }
    }
    WarnOfLeftOut("Webots", model_, types, &exported.warnings);
    std::ranges::move(LooseDocking(model_, faces_, types), std::back_inserter(exported.warnings));
    return exported;
  }

 private:
  /// What a world needs beside the robot: gravity, a view, light, and a floor at height 0.
  void AppendScene() {
    // The coordinate system is M3L's, so that no pose needs to be turned.
    std::vector<std::string> info = {fmt::format("title \"{}\"", robot_.name), "gravity 9.81",
                                     "basicTimeStep 4", "coordinateSystem \"NUE\""};
    std::ranges::move(WebotsContacts(model_, robot_, obstacles_), std::back_inserter(info));
    vrml_.Block("WorldInfo", info);
    const model::Pose view = ViewOf(Corners());
    vrml_.Block("Viewpoint", {"orientation " + Rotation(view.linear()),
                              "position " + Triple(view.translation())});
    vrml_.Block("Background", {"skyColor [ 0.7 0.8 0.9 ]"});
    vrml_.Block("DirectionalLight", {"direction -0.4 -1 -0.5"});
    // The floor's upper side is at height 0.
    vrml_.Open("Solid {");
    vrml_.Line(fmt::format("translation 0 {} 0", Number(-0.5 * kFloorThickness)));
    vrml_.Line(fmt::format("name \"{}\"", FreeModuleName("floor")));
    vrml_.Open("children [");
    vrml_.Block("Shape",
                {"appearance PBRAppearance { baseColor 0.6 0.6 0.55 roughness 1 metalness 0 }",
                 fmt::format("geometry DEF {} Box {{ size 10 {} 10 }}", FreeModuleName("FLOOR"),
                             Number(kFloorThickness))});
    vrml_.Close("]");
    vrml_.Line("boundingObject USE " + FreeModuleName("FLOOR"));
    vrml_.Close("}");
    for (size_t i = 0; i < obstacles_.size(); ++i) {
      AppendWebotsObstacle(obstacles_[i], FreeModuleName(fmt::format("OBSTACLE_{}", i + 1)),
                           &vrml_);
    }
  }

  /// A name that no module has.
  [[nodiscard]] std::string FreeModuleName(std::string name) const {
    return FreeName(std::move(name),
                    [&](const std::string& tried) { return robot_.FindModule(tried).has_value(); });
  }

  /// Corners of all hulls and origins of all links, where the robot stands (world, m).
  [[nodiscard]] std::vector<Eigen::Vector3d> Corners() const {
    std::vector<Eigen::Vector3d> corners;
    for (size_t m = 0; m < X_WL_.size(); ++m) {
      const model::ModuleType& type = model_.TypeOf(robot_, static_cast<int>(m));
      for (size_t l = 0; l < X_WL_[m].size(); ++l) {
        corners.emplace_back(X_WL_[m][l].translation());
        for (const Eigen::Vector3d& p : type.links[l].hull) corners.push_back(X_WL_[m][l] * p);
      }
    }
    return corners;
  }

  /// The Robot node of a module, with all its links.
  void AppendModule(size_t m) {
    const model::ModuleInstance& module = robot_.modules[m];
    const RobotTree& tree = trees_[module.type];
    vrml_.Open(fmt::format("DEF {} Robot {{", module.name));
    vrml_.Place(X_WL_[m][tree.links[0].link]);
    vrml_.Line(fmt::format("name \"{}\"", module.name));
    vrml_.Line(fmt::format("controller \"{}\"", programs_.at(module.type).name));
    vrml_.Line(fmt::format("customData \"{}\"", CustomData(m)));
    AppendLinkBody(m, tree, 0);
    vrml_.Close("}");
  }

  /// What the module's controller cannot find out by itself (morphbus_module.h).
  [[nodiscard]] std::string CustomData(size_t m) const {
    const std::string id = fmt::format("id {}", m);
    if (static_cast<int>(m) != robot_.root_module) return id;
    const model::Pose X_RL = robot_.X_LR.inverse();
    return fmt::format("{} root {} {} {}", id, robot_.root_link, Triple(X_RL.translation()),
                       QuaternionWxyz(X_RL.linear()));
  }

  /// Children, bounding object and physics, up to the node's end.
  void AppendLinkBody(size_t m, const RobotTree& tree, int at) {
    // The link's shape, its connectors, the links below it, and the joints that close loops.
    const TreeLink& link = tree.links[at];
    const model::ModuleType& type = model_.module_types[link.type];
    const std::string hull =
        fmt::format("HULL_{}_{}", robot_.modules[m].name, type.links[link.link].name);
    vrml_.Open("children [");
    const std::vector<std::string> shapes = AppendShapes(link, hull, m);
    for (size_t c = 0; c < type.connectors.size(); ++c) {
      if (type.connectors[c].link == link.link) AppendConnector(m, type, c);
    }
    for (const model::Sensor& sensor : type.sensors) {
      if (sensor.link == link.link) {
        AppendWebotsSensor(sensor, solids_.Faces(link.type, link.link), &vrml_);
      }
    }
    for (int child = 1; child < std::ssize(tree.links); ++child) {
      // A link that hangs from nothing is part of the first one.
      if (std::max(tree.links[child].parent, 0) == at) AppendChild(m, tree, child);
    }
    for (const TreeLoop& loop : tree.loops) {
      if (loop.from == at) AppendClosingJoint(m, tree, loop);
    }
    vrml_.Close("]");
    AppendBoundingObject(link, shapes);
    if (const model::Link& of = type.links[link.link]; of.friction) {
      vrml_.Line(fmt::format("contactMaterial \"{}\"", WebotsMaterialOf(type, of)));
    }
    AppendPhysics(link);
  }

  /// What the link collides with: its shapes by name, several in a group, or a small sphere for a
  /// link without any.
  void AppendBoundingObject(const TreeLink& link, const std::vector<std::string>& shapes) {
    if (shapes.empty()) {
      vrml_.Line(fmt::format("boundingObject Sphere {{ radius {} }}", Number(kTokenRadius)));
    } else if (!LinkOf(model_, link).visual.empty()) {
      AppendUnseenShapes(link, shapes);
    } else if (shapes.size() == 1) {
      vrml_.Line("boundingObject USE " + shapes.front());
    } else {
      std::string parts;
      for (const std::string& shape : shapes) {
        parts += (parts.empty() ? "" : ", ") + fmt::format("Shape {{ geometry USE {} }}", shape);
      }
      vrml_.Block("boundingObject Group", {"children [ " + parts + " ]"});
    }
  }

  /// The bounding object of a link that does not look like its shapes, which stand here alone.
  void AppendUnseenShapes(const TreeLink& link, const std::vector<std::string>& shapes) {
    vrml_.Open("boundingObject Group {");
    vrml_.Open("children [");
    size_t next = 0;
    for (const model::ConvexHull& part : solids_.Faces(link.type, link.link)) {
      if (part.dimension < 3) continue;
      vrml_.Open("Shape {");
      vrml_.Block(fmt::format("geometry DEF {} IndexedFaceSet", shapes[next++]),
                  VrmlWriter::FacesOf(part));
      vrml_.Close("}");
    }
    vrml_.Close("]");
    vrml_.Close("}");
  }

  /// The shapes of a link's convex parts, in a colour of its module, and what they are called for
  /// the bounding object. Flat parts have no inside, and Webots wants solids: none is written. Of a
  /// link that looks otherwise only that is written.
  std::vector<std::string> AppendShapes(const TreeLink& link, const std::string& name, size_t m) {
    // Modules get colours between blue and yellow. The golden ratio spreads the hues, so that
    // neighbours differ.
    const double hue = std::fmod(0.381966 * static_cast<double>(m), 1.0);
    const double shade = std::round(100 * hue) / 100;
    std::vector<std::string> names;
    const std::vector<LookMesh>& looks = solids_.Looks(link.type, link.link);
    const std::vector<model::ConvexHull>& parts = solids_.Faces(link.type, link.link);
    for (size_t i = 0; i < parts.size(); ++i) {
      if (parts[i].dimension < 3) continue;
      names.push_back(parts.size() == 1 ? name : fmt::format("{}_{}", name, i + 1));
      if (looks.empty()) vrml_.Hull(names.back(), parts[i], {shade, 0.7, 1.0 - shade});
    }
    for (size_t i = 0; i < looks.size(); ++i) {
      const Color color = looks[i].color.value_or(Color{shade, 0.7, 1.0 - shade});
      vrml_.Triangles(fmt::format("{}_LOOK_{}", name, i + 1), {looks[i].points, looks[i].triangles},
                      {color[0], color[1], color[2]});
    }
    return names;
  }

  /// The link's mass, centre of mass and inertia; a density of -1 says that these count.
  void AppendPhysics(const TreeLink& link) {
    const model::LinkMass& mass = solids_.Mass(link.type, link.link);
    const Eigen::Matrix3d& I = mass.I_Lcm_L;
    vrml_.Block("physics Physics", {"density -1", "mass " + Number(mass.mass_kg),
                                    "centerOfMass [ " + Triple(mass.p_LoLcm_L) + " ]",
                                    "inertiaMatrix [ " + Triple(I.diagonal()) + ", " +
                                        Triple({I(0, 1), I(0, 2), I(1, 2)}) + " ]"});
  }

  /// A Connector node with the emitter and receiver over which two docked modules talk.
  void AppendConnector(size_t m, const model::ModuleType& type, size_t c) {
    // The emitter stands off the centre, so that a mate hears from its direction how the two are
    // turned.
    const DockFace& face = faces_[robot_.modules[m].type][c];
    const std::string& name = type.connectors[c].name;
    const bool docked = docked_.count({static_cast<int>(m), static_cast<int>(c)}) != 0;
    vrml_.Open("Connector {");
    vrml_.Place(face.X_LC);
    vrml_.Open("children [");
    vrml_.Line(fmt::format("Emitter {{ translation 0 0 {} name \"{}.emitter\" range {} }}",
                           Number(scale_.emitter_offset), name, Number(scale_.reach)));
    vrml_.Line(fmt::format("Receiver {{ name \"{}.receiver\" }}", name));
    vrml_.Close("]");
    vrml_.Line(fmt::format("name \"{}\"", name));
    vrml_.Line(fmt::format("model \"{}\"", face.model));
    vrml_.Line(fmt::format("type \"{}\"", face.type));
    // A passive connector cannot lock; the active one holds it.
    if (docked && face.type != "passive") vrml_.Line("isLocked TRUE");
    vrml_.Line("distanceTolerance " + Number(scale_.reach));
    vrml_.Line(fmt::format("numberOfRotations {}", face.rotations));
    vrml_.Close("}");
  }

  /// A link below another: by a joint, or, where the joint is fixed, as part of it.
  void AppendChild(size_t m, const RobotTree& tree, int child) {
    // A link below a joint stands where the module's start value places it.
    const TreeLink& link = tree.links[child];
    model::Pose X_PL = link.X_PL;
    const bool moves = link.joint >= 0 && tree.joints[link.joint].type != JointType::kFixed;
    if (moves) {
      X_PL = X_PL * MotionOf(tree.joints[link.joint], robot_.modules[m].start[link.joint]);
      OpenJoint(m, tree, link.joint);
    }
    vrml_.Open(moves ? "endPoint Solid {" : "Solid {");
    vrml_.Place(X_PL);
    vrml_.Line(fmt::format("name \"{}\"", link.name));
    AppendLinkBody(m, tree, child);
    vrml_.Close("}");
    if (moves) vrml_.Close("}");
  }

  /// The joint of a loop within a module: its end point is a link that stands elsewhere in the
  /// file.
  void AppendClosingJoint(size_t m, const RobotTree& tree, const TreeLoop& loop) {
    if (loop.joint < 0) return;
    OpenJoint(m, tree, loop.joint);
    vrml_.Line(
        fmt::format("endPoint SolidReference {{ solidName \"{}\" }}", tree.links[loop.to].name));
    vrml_.Close("}");
  }

  /// Webots takes limits only on either side of 0.
  static bool LimitsFit(double lower, double upper) {
    return lower <= 0.0 && upper >= 0.0 && lower < upper;
  }

  /// Its hinges take mechanical stops only within half a turn of 0.
  static bool StopsFit(JointType type, double lower, double upper) {
    return type == JointType::kPrismatic || (lower >= -EIGEN_PI && upper <= EIGEN_PI);
  }

  /// Says which contact sensors have no part of their link to feel with.
  void WarnOfContactSensors(int type, std::vector<std::string>* warnings) {
    for (const model::Sensor& sensor : model_.module_types[type].sensors) {
      if (sensor.type != model::SensorType::kContact) continue;
      if (!ContactPads(sensor, solids_.Faces(type, sensor.link)).empty()) continue;
      warnings->push_back(fmt::format(
          "contact sensor {} of {}: no face of its link looks where it does and lies within its "
          "range; in Webots it feels at its own place alone",
          sensor.name, model_.module_types[type].name));
    }
  }

  /// Says which joints of the type are without their limits or without stops in Webots.
  static void WarnOfLimits(const model::ModuleType& type, std::vector<std::string>* warnings) {
    for (const model::Joint& joint : type.joints) {
      // Limits are left out, with a warning, where Webots could not take them.
      const bool slides = joint.type == JointType::kPrismatic;
      if (joint.type != JointType::kRevolute && !slides) continue;
      const std::string limits = fmt::format("{} to {} {}", Number(joint.lower),
                                             Number(joint.upper), slides ? "m" : "rad");
      if (!LimitsFit(joint.lower, joint.upper)) {
        warnings->push_back(
            fmt::format("Webots takes limits only on either side of 0: {} of {} is left without "
                        "its own, {}",
                        joint.name, type.name, limits));
      } else if (!StopsFit(joint.type, joint.lower, joint.upper)) {
        warnings->push_back(
            fmt::format("Webots has stops only within half a turn of 0: {} of {} is kept to its "
                        "limits, {}, by its motor alone",
                        joint.name, type.name, limits));
      }
    }
  }

  /// Writes a joint up to its end point, which the caller writes before it closes the node.
  void OpenJoint(size_t m, const RobotTree& tree, int index) {
    // The joint's place and limits, then its motor and its sensor.
    const TreeJoint& joint = tree.joints[index];
    const double start = robot_.modules[m].start[index];
    const bool slides = joint.type == JointType::kPrismatic;
    // Webots refuses a file with limits that it cannot take; WarnOfLimits says which were left out.
    const bool limited =
        joint.type != JointType::kContinuous && LimitsFit(joint.lower, joint.upper);
    vrml_.Open(slides ? "SliderJoint {" : "HingeJoint {");
    std::vector<std::string> parameters = {"axis " + Triple(joint.axis)};
    if (!slides) parameters.push_back("anchor " + Triple(joint.origin));
    parameters.push_back("position " + Number(start));
    std::vector<std::string> motor = {fmt::format("name \"{}\"", joint.name),
                                      "maxVelocity " + Number(joint.speed),
                                      (slides ? "maxForce " : "maxTorque ") + Number(joint.effort)};
    const std::string lower = Number(joint.lower);
    const std::string upper = Number(joint.upper);
    if (limited) motor.insert(motor.end(), {"minPosition " + lower, "maxPosition " + upper});
    if (limited && StopsFit(joint.type, joint.lower, joint.upper)) {
      // Limits bind the motor, stops the joint itself.
      parameters.insert(parameters.end(), {"minStop " + lower, "maxStop " + upper});
    }
    vrml_.Block(slides ? "jointParameters JointParameters" : "jointParameters HingeJointParameters",
                parameters);
    vrml_.Open("device [");
    vrml_.Block(slides ? "LinearMotor" : "RotationalMotor", motor);
    vrml_.Line(fmt::format("PositionSensor {{ name \"{}.sensor\" }}", joint.name));
    vrml_.Close("]");
  }

  /// A warning for each docking that Webots will not hold.
  [[nodiscard]] std::vector<std::string> Unaligned() const {
    // Webots locks two connectors only if their faces look at each other at the start.
    std::vector<std::string> warnings;
    const auto pose = [&](int module, const model::Connector& connector, const DockFace& face) {
      return X_WL_[module][connector.link] * face.X_LC;
    };
    for (const model::Docking& d : robot_.dockings) {
      const model::Connector& a = model_.EndA(robot_, d);
      const model::Connector& b = model_.EndB(robot_, d);
      const DockFace& face_a = Face(d.module_a, d.connector_a);
      const DockFace& face_b = Face(d.module_b, d.connector_b);
      // Webots asks both connectors, and the one with more ways to dock decides.
      const int rotations = std::max(face_a.rotations, face_b.rotations);
      if (Aligned(pose(d.module_a, a, face_a), pose(d.module_b, b, face_b), rotations,
                  scale_.tolerance)) {
        continue;
      }
      warnings.push_back(fmt::format(
          "Webots will not lock {}.{} to {}.{}: their faces do not look at each other",
          robot_.modules[d.module_a].name, a.name, robot_.modules[d.module_b].name, b.name));
    }
    return warnings;
  }

  // The face of a connector; faces are those of the module's type.
  [[nodiscard]] const DockFace& Face(int module, int connector) const {
    return faces_[robot_.modules[module].type][connector];
  }

  const model::Model& model_;
  const model::Robot& robot_;
  LinkSolids solids_;
  const DockFaces& faces_;
  DockScale scale_;
  std::vector<std::vector<model::Pose>> X_WL_;
  std::vector<RobotTree> trees_;            ///< Of each module type.
  std::set<std::pair<int, int>> docked_;    ///< (module, connector)
  std::map<int, WebotsProgram> programs_;   ///< Of each used type; without files once written.
  std::vector<world::Obstacle> obstacles_;  ///< With names of their own.
  VrmlWriter vrml_;
};

}  // namespace

Result<Exported> ToWebots(const model::Model& model, const model::Robot& robot,
                          const WebotsOptions& options) {
  const DockFaces faces = DockFacesOf(model);
  std::map<int, WebotsProgram> programs;
  for (const model::ModuleInstance& module : robot.modules) {
    if (programs.count(module.type) > 0) continue;
    Result<WebotsProgram> program =
        WebotsController(model, faces, module.type, options.program, options.model_hash);
    if (!program) return Fail(program.error().message);
    programs[module.type] = *std::move(program);
  }
  return WebotsWriter(model, robot, faces, std::move(programs), options.obstacles)
      .Write(options.controllers);
}

}  // namespace morphbus::emit
