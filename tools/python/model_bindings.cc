// Models, robots and programs.

#include <morphbus/dynarole/program.h>
#include <morphbus/m3l/m3l.h>
#include <pybind11/stl.h>

#include "tools/python/bindings.h"

namespace py = pybind11;

namespace morphbus::python {
namespace {

/// Joint values as the library takes them; the robot's own at the start for None.
std::vector<double> JointValues(const Robot& robot, const std::optional<std::vector<double>>& q) {
  return q ? *q : robot.StartValues();
}

}  // namespace

/// Types of modules and connections, and models with what checks their source.
void AddModel(py::module_& m) {
  // What is compiled or compared may take long, so that Python's other threads go on (Released).
  py::class_<ModuleType>(m, "ModuleType", "A type of module, by the names of its parts.")
      .def_readonly("name", &ModuleType::name)
      .def_readonly("links", &ModuleType::links)
      .def_readonly("joints", &ModuleType::joints)
      .def_readonly("connectors", &ModuleType::connectors)
      .def_readonly("sensors", &ModuleType::sensors);
  py::class_<ConnectionOption>(m, "ConnectionOption",
                               "A numbered way to join two modules; X_AB is the pose of the second "
                               "one in the first, 4 by 4.")
      .def_readonly("number", &ConnectionOption::number)
      .def_readonly("connector_a", &ConnectionOption::connector_a)
      .def_readonly("connector_b", &ConnectionOption::connector_b)
      .def_property_readonly("X_AB", [](const ConnectionOption& option) {
        const std::array<double, 16> matrix = option.X_AB.Matrix();
        return ToArray({matrix.begin(), matrix.end()}, {4, 4});
      });
  py::class_<ConnectionType>(m, "ConnectionType",
                             "A connection between two types of modules, solved.")
      .def_readonly("name", &ConnectionType::name)
      .def_readonly("type_a", &ConnectionType::type_a)
      .def_readonly("type_b", &ConnectionType::type_b)
      .def_readonly("options", &ConnectionType::options);
  py::class_<Model>(m, "Model",
                    "A compiled model. Model(path) compiles a file of M3L; from_text and "
                    "from_bytes are other ways.")
      .def(py::init([](const std::string& path) { return CompileM3l(path); }), py::arg("path"),
           Released())
      .def_static(
          "from_text",
          [](const std::string& text, const std::string& name) {
            return CompileM3lText(name, text);
          },
          py::arg("text"), py::arg("name") = "text.m3l", Released(),
          "The same for a text; `name` stands for the file's, from whose folder it may import.")
      .def_static("from_bytes",
                  [](const py::bytes& bytes) { return Model::FromBytes(std::string_view(bytes)); })
      .def("__bytes__", [](const Model& model) { return py::bytes(model.Bytes()); })
      .def_property_readonly("hash", &Model::Hash)
      .def_property_readonly("module_types", &Model::module_types)
      .def_property_readonly("connection_types", &Model::connection_types)
      .def_property_readonly("robots", &Model::RobotNames)
      .def("robot", &Model::robot, py::arg("name") = "", "The robot of that name, or the only one.")
      .def(py::pickle(
          [](const Model& model) { return py::bytes(model.Bytes()); },
          [](const py::bytes& bytes) { return Model::FromBytes(std::string_view(bytes)); }));
  // Like Model(path), but what it finds is an answer and no exception.
  m.def(
      "check",
      [](const std::string& path) {
        std::vector<Diagnostic> found;
        try {
          (void)CompileM3l(path, &found);
        } catch (const TextError& error) {
          found = error.diagnostics();
        }
        return found;
      },
      py::arg("path"), Released(),
      "All errors and warnings of a file of M3L and of what it imports, as Diagnostics; "
      "Model(path) raises where there are errors.");
  m.def(
      "format_m3l", [](const std::string& text) { return FormatM3l("text.m3l", text); },
      py::arg("text"));
}

/// Robots, their parts, and what is computed of them.
void AddRobot(py::module_& m) {
  // Parts are told as in C++: by their places in the robot's lists.
  py::enum_<JointType>(m, "JointType")
      .value("revolute", JointType::kRevolute)
      .value("continuous", JointType::kContinuous)
      .value("prismatic", JointType::kPrismatic)
      .value("fixed", JointType::kFixed);
  py::class_<Module>(m, "Module", "A module of a robot: its name, and that of its type.")
      .def_readonly("name", &Module::name)
      .def_readonly("type", &Module::type);
  py::class_<Link>(m, "Link",
                   "A rigid body of a module: m1.link_a, the place of its module, its mass (kg).")
      .def_readonly("name", &Link::name)
      .def_readonly("module", &Link::module)
      .def_readonly("mass_kg", &Link::mass_kg);
  py::class_<Joint>(m, "Joint",
                    "A joint of a module. Values are in rad, or in m where it is prismatic; limits "
                    "may be infinite.")
      .def_readonly("name", &Joint::name)
      .def_readonly("module", &Joint::module)
      .def_readonly("type", &Joint::type)
      .def_readonly("link_a", &Joint::link_a)
      .def_readonly("link_b", &Joint::link_b)
      .def_readonly("lower", &Joint::lower)
      .def_readonly("upper", &Joint::upper)
      .def_readonly("effort", &Joint::effort)
      .def_readonly("speed", &Joint::speed)
      .def_readonly("start", &Joint::start);
  py::class_<Connection>(
      m, "Connection",
      "Two connectors that hold each other: modules by their places, connectors by name.")
      .def_readonly("module_a", &Connection::module_a)
      .def_readonly("module_b", &Connection::module_b)
      .def_readonly("connector_a", &Connection::connector_a)
      .def_readonly("connector_b", &Connection::connector_b)
      .def_readonly("connection", &Connection::connection)
      .def_readonly("number", &Connection::number);
  // Poses become one array for all links.
  py::class_<LinkPoses>(
      m, "LinkPoses",
      "Poses of all links in the robot frame, in the order of Robot.links: position (n, 3; m), "
      "rotation (n, 4; w x y z), matrix (n, 4, 4); and how far loops are from closing.")
      .def_property_readonly("position", [](const LinkPoses& p) { return ToArrays(p.X_RL).first; })
      .def_property_readonly("rotation", [](const LinkPoses& p) { return ToArrays(p.X_RL).second; })
      .def_property_readonly("matrix",
                             [](const LinkPoses& p) {
                               std::vector<double> values;
                               for (const Pose& pose : p.X_RL) {
                                 const std::array<double, 16> matrix = pose.Matrix();
                                 values.insert(values.end(), matrix.begin(), matrix.end());
                               }
                               const auto count = static_cast<py::ssize_t>(p.X_RL.size());
                               return ToArray(std::move(values), {count, 4, 4});
                             })
      .def_readonly("closure_m", &LinkPoses::closure_m)
      .def_readonly("closure_rad", &LinkPoses::closure_rad);
  // The classes within a class are declared before the members that have their type.
  py::class_<KinematicGraph> graph(m, "KinematicGraph");
  py::class_<KinematicGraph::Edge>(graph, "Edge")
      .def_readonly("joint", &KinematicGraph::Edge::joint)
      .def_readonly("body_a", &KinematicGraph::Edge::body_a)
      .def_readonly("body_b", &KinematicGraph::Edge::body_b)
      .def_readonly("axis_R", &KinematicGraph::Edge::axis_R)
      .def_readonly("point_R", &KinematicGraph::Edge::point_R)
      .def_readonly("locked", &KinematicGraph::Edge::locked);
  graph.def_readonly("bodies", &KinematicGraph::bodies)
      .def_readonly("joints", &KinematicGraph::joints)
      .def_readonly("mobility", &KinematicGraph::mobility);
  py::class_<Congruence> congruence(m, "Congruence");
  py::class_<Congruence::JointImage>(congruence, "JointImage")
      .def_readonly("from_", &Congruence::JointImage::from)
      .def_readonly("to", &Congruence::JointImage::to)
      .def_readonly("sign", &Congruence::JointImage::sign)
      .def_readonly("offset", &Congruence::JointImage::offset);
  congruence.def_readonly("decided", &Congruence::decided)
      .def_readonly("congruent", &Congruence::congruent)
      .def_readonly("ways", &Congruence::ways)
      .def_readonly("complete", &Congruence::complete)
      .def_readonly("reason", &Congruence::reason)
      .def_readonly("keeps_frame", &Congruence::keeps_frame)
      .def_readonly("modules", &Congruence::modules)
      .def_readonly("joints", &Congruence::joints)
      .def_readonly("masses_equal", &Congruence::masses_equal)
      .def_readonly("hulls_equal", &Congruence::hulls_equal)
      .def("__bool__", [](const Congruence& answer) { return answer.congruent; });
  // Links and joints are named here, where the library takes their places.
  py::class_<Robot>(m, "Robot", "A robot of a model. Joint values are in the order of joints.")
      .def_property_readonly("name", &Robot::name)
      .def_property_readonly("model", &Robot::model)
      .def_property_readonly("modules", &Robot::modules)
      .def_property_readonly("links", &Robot::links)
      .def_property_readonly("joints", &Robot::joints)
      .def_property_readonly("connections", &Robot::connections)
      .def("find_link", &Robot::FindLink, py::arg("name"), "The place in links of m1.link_a.")
      .def("find_joint", &Robot::FindJoint, py::arg("name"), "The place in joints of m1.joint_1.")
      .def(
          "start_values", [](const Robot& robot) { return ToArray(robot.StartValues()); },
          "The values of all joints when the robot starts.")
      .def(
          "fk",
          [](const Robot& robot, const std::optional<std::vector<double>>& q) {
            return robot.ForwardKinematics(JointValues(robot, q));
          },
          py::arg("q") = py::none())
      .def(
          "jacobian",
          [](const Robot& robot, const std::string& link,
             const std::optional<std::vector<double>>& q) {
            Jacobian jacobian = robot.JacobianOf(robot.FindLink(link), JointValues(robot, q));
            const auto columns = static_cast<py::ssize_t>(jacobian.columns);
            return ToArray(std::move(jacobian.values), {6, columns});
          },
          py::arg("link"), py::arg("q") = py::none())
      .def("graph", &Robot::Graph,
           "Bodies, joints that can move, and mobility, at the start values.")
      .def("congruence_hash", &Robot::CongruenceHash,
           "A number that congruent robots share and others hardly ever; compare decides.")
      .def("compare", &Robot::CompareWith, py::arg("other"), Released())
      .def("variants", &Robot::Variants, py::arg("most") = 10, py::arg("seed") = py::none(),
           Released())
      .def(
          "draw",
          [](const Robot& robot, const std::vector<std::string>& views,
             const std::optional<std::vector<double>>& q) {
            return DrawRobot(robot, JointValues(robot, q), ViewsNamed(views));
          },
          py::arg("views") = std::vector<std::string>{"iso"}, py::arg("q") = py::none())
      .def("_repr_svg_",
           [](const Robot& robot) { return DrawRobot(robot, {}, {View::kThreeQuarter}); });
}

/// Programs with their roles and parameters.
void AddProgram(py::module_& m) {
  py::class_<Parameter>(m, "Parameter", "A parameter of a program, with its value and its range.")
      .def_readonly("name", &Parameter::name)
      .def_readonly("is_int", &Parameter::is_int)
      .def_readonly("value", &Parameter::value)
      .def_readonly("source_value", &Parameter::source_value)
      .def_readonly("least", &Parameter::least)
      .def_readonly("most", &Parameter::most);
  py::class_<Role>(m, "Role", "A role of a program.")
      .def_readonly("name", &Role::name)
      .def_readonly("extends", &Role::extends)
      .def_readonly("is_abstract", &Role::is_abstract);
  py::class_<Program>(m, "Program",
                      "A program that the verifier has passed. Program(path, model) compiles a "
                      "file of DynaRole, or reads an image.")
      .def(py::init([](const std::string& path, const Model& model) {
             return CompileDynaRole(path, model);
           }),
           py::arg("path"), py::arg("model"), Released())
      .def_static(
          "from_text",
          [](const std::string& text, const Model& model, const std::string& name) {
            return CompileDynaRoleText(name, text, model);
          },
          py::arg("text"), py::arg("model"), py::arg("name") = "text.dyn", Released(),
          "The same for a text; `name` stands for the file's, from whose folder it may import.")
      .def_static(
          "from_image",
          [](const py::bytes& image) { return Program::FromImage(std::string_view(image)); })
      .def_property_readonly("image", [](const Program& p) { return py::bytes(p.image()); })
      .def_property_readonly("hash", &Program::hash)
      .def_property_readonly("roles", &Program::Roles)
      .def_property_readonly("parameters", &Program::Parameters)
      .def("with_parameter", &Program::With, py::arg("name"), py::arg("value"),
           "The program with another value of a parameter.")
      .def("disassemble", &Program::Disassemble, "Instructions and tables as text.")
      .def(py::pickle(
          [](const Program& program) { return py::bytes(program.image()); },
          [](const py::bytes& image) { return Program::FromImage(std::string_view(image)); }));
  m.def(
      "format_dynarole", [](const std::string& text) { return FormatDynaRole("text.dyn", text); },
      py::arg("text"));
}

}  // namespace morphbus::python
