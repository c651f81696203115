// The Python module morphbus._core: the libraries of include/morphbus/, with NumPy arrays.

#include <morphbus/compare/compare.h>
#include <morphbus/dynarole/program.h>
#include <morphbus/m3l/m3l.h>
#include <morphbus/observe/log.h>
#include <morphbus/run/batch.h>
#include <morphbus/view/view.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace morphbus {
namespace {

using Numbers = py::array_t<double>;
using Released = py::call_guard<py::gil_scoped_release>;

/// The numbers as an array of this shape that owns them: they are moved, and not copied.
Numbers ToArray(std::vector<double> values, std::vector<py::ssize_t> shape) {
  auto* kept = new std::vector<double>(std::move(values));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<double>*>(p); });
  return Numbers(std::move(shape), kept->data(), owner);
}
Numbers ToArray(std::vector<double> values) {
  const auto size = static_cast<py::ssize_t>(values.size());
  return ToArray(std::move(values), {size});
}

/// Positions (n, 3) and rotations (n, 4) of poses.
std::pair<Numbers, Numbers> ToArrays(const std::vector<Pose>& poses) {
  std::vector<double> positions, rotations;
  for (const Pose& pose : poses) {
    positions.insert(positions.end(), pose.position.begin(), pose.position.end());
    rotations.insert(rotations.end(), pose.rotation.begin(), pose.rotation.end());
  }
  const auto count = static_cast<py::ssize_t>(poses.size());
  return {ToArray(std::move(positions), {count, 3}), ToArray(std::move(rotations), {count, 4})};
}

/// Joint values as the library takes them; the robot's own at the start for None.
std::vector<double> JointValues(const Robot& robot, const std::optional<std::vector<double>>& q) {
  return q ? *q : robot.StartValues();
}

/// The views by their names on the command line.
std::vector<View> ViewsNamed(const std::vector<std::string>& names) {
  std::vector<View> views;
  for (const std::string& name : names) {
    if (name == "side") {
      views.push_back(View::kSide);
    } else if (name == "top") {
      views.push_back(View::kTop);
    } else if (name == "front") {
      views.push_back(View::kFront);
    } else if (name == "iso") {
      views.push_back(View::kThreeQuarter);
    } else {
      throw Failure("view '" + name + "': expected side, top, front or iso");
    }
  }
  return views;
}

void AddErrors(py::module_& m) {
  static py::exception<Failure> failure(m, "Failure", PyExc_RuntimeError);
  static py::exception<TextError> text_error(m, "TextError", failure.ptr());
  // A TextError carries its diagnostics.
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const TextError& error) {
      py::object instance = py::handle(text_error)(error.what());
      instance.attr("diagnostics") = py::cast(error.diagnostics());
      PyErr_SetObject(text_error.ptr(), instance.ptr());
    } catch (const Failure& error) {
      failure(error.what());
    }
  });
  py::class_<TextRange>(
      m, "TextRange",
      "A stretch of a text: file, line and column from 1, and those behind its end.")
      .def_readonly("file", &TextRange::file)
      .def_readonly("line", &TextRange::line)
      .def_readonly("column", &TextRange::column)
      .def_readonly("end_line", &TextRange::end_line)
      .def_readonly("end_column", &TextRange::end_column);
  py::class_<DiagnosticNote>(m, "DiagnosticNote")
      .def_readonly("where", &DiagnosticNote::where)
      .def_readonly("message", &DiagnosticNote::message);
  py::class_<Diagnostic>(m, "Diagnostic", "An error or a warning: where, message, hint and notes.")
      .def_readonly("is_error", &Diagnostic::is_error)
      .def_readonly("where", &Diagnostic::where)
      .def_readonly("message", &Diagnostic::message)
      .def_readonly("hint", &Diagnostic::hint)
      .def_readonly("notes", &Diagnostic::notes);
}

void AddModel(py::module_& m) {
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
          py::arg("text"), py::arg("name") = "text.m3l", Released())
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
  m.def(
      "format_m3l", [](const std::string& text) { return FormatM3l("text.m3l", text); },
      py::arg("text"));
}

void AddRobot(py::module_& m) {
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
          py::arg("text"), py::arg("model"), py::arg("name") = "text.dyn", Released())
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

/// A series as NumPy arrays, which own what the library made.
struct JointArrays {
  std::string joint;
  Numbers time_s, position, velocity, effort, command_time_s, target;
};
JointArrays ToArrays(JointSeries series) {
  return {series.joint,
          ToArray(std::move(series.time_s)),
          ToArray(std::move(series.position)),
          ToArray(std::move(series.velocity)),
          ToArray(std::move(series.effort)),
          ToArray(std::move(series.command_time_s)),
          ToArray(std::move(series.target))};
}
struct PoseArrays {
  std::string link;
  Numbers time_s, position, rotation;
};
PoseArrays ToArrays(PoseSeries series) {
  auto [position, rotation] = ToArrays(series.pose);
  return {series.link, ToArray(std::move(series.time_s)), std::move(position), std::move(rotation)};
}

void AddLog(py::module_& m) {
  py::class_<JointArrays>(
      m, "JointSeries",
      "A joint over sim time: time_s with position, velocity, effort; command_time_s with target "
      "(NaN without one). rad or m, per second, N m or N.")
      .def_readonly("joint", &JointArrays::joint)
      .def_readonly("time_s", &JointArrays::time_s)
      .def_readonly("position", &JointArrays::position)
      .def_readonly("velocity", &JointArrays::velocity)
      .def_readonly("effort", &JointArrays::effort)
      .def_readonly("command_time_s", &JointArrays::command_time_s)
      .def_readonly("target", &JointArrays::target);
  py::class_<PoseArrays>(
      m, "PoseSeries",
      "A link over sim time: time_s, position (n, 3; m), rotation (n, 4; w x y z).")
      .def_readonly("link", &PoseArrays::link)
      .def_readonly("time_s", &PoseArrays::time_s)
      .def_readonly("position", &PoseArrays::position)
      .def_readonly("rotation", &PoseArrays::rotation);
  py::class_<RolePlayed>(
      m, "RolePlayed",
      "A stretch of time in which a module played a role, with what its labels named.")
      .def_readonly("begin_s", &RolePlayed::begin_s)
      .def_readonly("end_s", &RolePlayed::end_s)
      .def_readonly("role", &RolePlayed::role)
      .def_readonly("labels", &RolePlayed::labels);
  py::class_<Log>(m, "Log",
                  "A run as it was logged. Log(path, run) reads the first run of the file, or the "
                  "one that is named.")
      .def(py::init([](const std::string& path, const std::string& run) {
             return Log::Open(path, {run});
           }),
           py::arg("path"), py::arg("run") = "", Released())
      .def_property_readonly("run", &Log::run)
      .def_property_readonly("hash", &Log::hash)
      .def_property_readonly("seconds", &Log::seconds)
      .def_property_readonly("tick_s", &Log::tick_s)
      .def_property_readonly("whole", &Log::whole)
      .def("info_json", &Log::InfoJson,
           "All that morphbus info --json tells; morphbus.info(log) has it as a dict.")
      .def_property_readonly("robot", &Log::robot)
      .def_property_readonly("modules", &Log::ModuleNames)
      .def("roles", &Log::Roles, py::arg("module"),
           "The roles that a module played, in order of time.")
      .def(
          "joint",
          [](const Log& log, const std::string& name) { return ToArrays(log.JointNamed(name)); },
          py::arg("name"))
      .def(
          "joints_labelled",
          [](const Log& log, const std::string& role, const std::string& label) {
            std::vector<JointArrays> all;
            for (JointSeries& series : log.JointsLabelled(role, label)) {
              all.push_back(ToArrays(std::move(series)));
            }
            return all;
          },
          py::arg("role"), py::arg("label"))
      .def(
          "pose",
          [](const Log& log, const std::string& link) { return ToArrays(log.SimulatedPose(link)); },
          py::arg("link"))
      .def(
          "believed_pose",
          [](const Log& log, const std::string& link) {
            return ToArrays(log.PropagatedPose(link));
          },
          py::arg("link"))
      .def(
          "draw",
          [](const Log& log, double at_s, const std::vector<std::string>& views) {
            return DrawMoment(log, at_s, ViewsNamed(views));
          },
          py::arg("at_s"), py::arg("views") = std::vector<std::string>{"iso"})
      .def(
          "draw_strip",
          [](const Log& log, int count, double from_s, std::optional<double> to_s,
             const std::vector<std::string>& views) {
            return DrawStrip(log, count, {from_s, to_s}, ViewsNamed(views));
          },
          py::arg("count") = 6, py::arg("from_s") = 0.0, py::arg("to_s") = py::none(),
          py::arg("views") = std::vector<std::string>{"side"})
      .def(
          "draw_video",
          [](const Log& log, int fps, double from_s, std::optional<double> to_s,
             const std::vector<std::string>& views) {
            std::string bytes;
            {
              const py::gil_scoped_release released;
              bytes = DrawVideo(log, fps, {from_s, to_s}, ViewsNamed(views));
            }
            return py::bytes(bytes);
          },
          py::arg("fps") = 10, py::arg("from_s") = 0.0, py::arg("to_s") = py::none(),
          py::arg("views") = std::vector<std::string>{"iso"})
      .def("report_html", [](const Log& log) { return ReportHtml(log); });
}

void AddComparison(py::module_& m) {
  py::enum_<Verdict>(m, "Verdict")
      .value("equivalent", Verdict::kEquivalent)
      .value("different", Verdict::kDifferent)
      .value("unusable", Verdict::kUnusable);
  py::enum_<Alignment>(m, "Alignment")
      .value("tick", Alignment::kTick)
      .value("event", Alignment::kEvent)
      .value("lag", Alignment::kLag);
  py::class_<ComparedItem>(m, "ComparedItem",
                           "How one quantity of one joint, link or module differs. SI units.")
      .def_readonly("quantity", &ComparedItem::quantity)
      .def_readonly("role", &ComparedItem::role)
      .def_readonly("label", &ComparedItem::label)
      .def_readonly("module_a", &ComparedItem::module_a)
      .def_readonly("module_b", &ComparedItem::module_b)
      .def_readonly("unit", &ComparedItem::unit)
      .def_readonly("samples", &ComparedItem::samples)
      .def_readonly("max", &ComparedItem::max)
      .def_readonly("rms", &ComparedItem::rms)
      .def_readonly("tolerance", &ComparedItem::tolerance)
      .def_readonly("max_time_s", &ComparedItem::max_time_s)
      .def_readonly("first_over_s", &ComparedItem::first_over_s)
      .def_property_readonly("differs", &ComparedItem::Differs);
  py::class_<Comparison>(m, "Comparison", "What a comparison comes to; str() is its text.")
      .def_readonly("verdict", &Comparison::verdict)
      .def_readonly("reason", &Comparison::reason)
      .def_readonly("items", &Comparison::items)
      .def_readonly("first", &Comparison::first)
      .def_readonly("notes", &Comparison::notes)
      .def_readonly("text", &Comparison::text)
      .def_readonly("json", &Comparison::json)
      .def("__str__", [](const Comparison& comparison) { return comparison.text; });
  m.def(
      "compare",
      [](const Log& a, const Log& b, Alignment alignment, bool gait,
         const std::vector<std::pair<std::string, std::string>>& tolerances) {
        return CompareLogs(a, b, {alignment, gait, tolerances});
      },
      py::arg("a"), py::arg("b"), py::arg("alignment") = Alignment::kTick, py::arg("gait") = false,
      py::arg("tolerances") = std::vector<std::pair<std::string, std::string>>(), Released());
}

/// A batch that keeps its runs alive.
struct KeptBatch {
  KeptBatch(std::vector<std::shared_ptr<Run>> the_runs, int threads)
      : runs(std::move(the_runs)), batch(Pointers(runs), threads) {}

  std::vector<std::shared_ptr<Run>> runs;
  Batch batch;

 private:
  static std::vector<Run*> Pointers(const std::vector<std::shared_ptr<Run>>& runs) {
    std::vector<Run*> pointers;
    for (const auto& run : runs) pointers.push_back(run.get());
    return pointers;
  }
};

void AddRun(py::module_& m) {
  py::class_<Observation>(
      m, "Observation",
      "What there is to see of a run at a tick: position, velocity, effort of the joints, "
      "link_position and link_rotation in the world, sensors and roles by module.")
      .def_readonly("tick", &Observation::tick)
      .def_readonly("time_s", &Observation::time_s)
      .def_property_readonly("position", [](const Observation& o) { return ToArray(o.position); })
      .def_property_readonly("velocity", [](const Observation& o) { return ToArray(o.velocity); })
      .def_property_readonly("effort", [](const Observation& o) { return ToArray(o.effort); })
      .def_property_readonly("link_position",
                             [](const Observation& o) { return ToArrays(o.X_WL).first; })
      .def_property_readonly("link_rotation",
                             [](const Observation& o) { return ToArrays(o.X_WL).second; })
      .def_readonly("sensors", &Observation::sensors)
      .def_readonly("roles", &Observation::roles);
  py::class_<RunResult>(m, "RunResult",
                        "How a run went: its hash, its ticks, why it ended, what went wrong.")
      .def_readonly("hash", &RunResult::hash)
      .def_readonly("ticks", &RunResult::ticks)
      .def_readonly("reason", &RunResult::reason)
      .def_readonly("error", &RunResult::error)
      .def_readonly("log", &RunResult::log);
  py::class_<Run, std::shared_ptr<Run>>(m, "Run",
                                        "A run of a robot with a program in this process, tick by "
                                        "tick. Keywords are the options of morphbus run.")
      .def(py::init([](const Robot& robot, const Program& program, double seconds,
                       const std::string& log, const std::string& name,
                       const std::vector<std::pair<std::string, std::string>>& settings,
                       const std::string& world, double friction, bool ground, bool still,
                       double loss, uint64_t seed, uint64_t random_seed, int noise_seed) {
             return std::make_shared<Run>(
                 robot, program,
                 RunOptions{seconds, log, name, settings, world, friction, ground, still, loss,
                            seed, random_seed, noise_seed});
           }),
           py::arg("robot"), py::arg("program"), py::kw_only(), py::arg("seconds") = 0.0,
           py::arg("log") = "", py::arg("name") = "run",
           py::arg("settings") = std::vector<std::pair<std::string, std::string>>(),
           py::arg("world") = "", py::arg("friction") = 0.8, py::arg("ground") = true,
           py::arg("still") = false, py::arg("loss") = 0.0, py::arg("seed") = 1,
           py::arg("random_seed") = 1, py::arg("noise_seed") = 1, Released())
      .def("step", &Run::Step, py::arg("ticks") = 1, Released(),
           "Goes on by so many ticks of 20 ms, at most to the end of the run.")
      .def_property_readonly("over", &Run::over)
      .def("observe", &Run::Observe, "What there is to see now.")
      .def("command", &Run::Command, py::arg("text"),
           "Gives a command as morphbus control takes it; it takes effect at the next tick.")
      .def("set", &Run::Set, py::arg("parameter"), py::arg("value"),
           "Gives a parameter another value, in all modules at one tick.")
      .def("drive", &Run::Drive, py::arg("joint"), py::arg("target"), py::arg("speed") = 0.0,
           "Drives a joint (its place in Robot.joints) to a target, whatever the program says, "
           "until it is released.")
      .def("release", &Run::Release, py::arg("joint"), "Leaves a joint to the program again.")
      .def(
          "close", [](Run& run) { return run.Close(); }, Released())
      .def("summary_json", &Run::SummaryJson, Released(),
           "All that morphbus run --json tells of a closed run; morphbus.summary(run) has it as a "
           "dict.")
      .def("__enter__", [](const std::shared_ptr<Run>& run) { return run; })
      .def("__exit__", [](Run& run, const py::args& /*what*/) { run.Close(); });
  py::class_<KeptBatch>(m, "Batch",
                        "Runs that go on together, on several processors (0 threads: on all). What "
                        "happens in a run does not depend on that.")
      .def(py::init<std::vector<std::shared_ptr<Run>>, int>(), py::arg("runs"),
           py::arg("threads") = 0)
      .def_readonly("runs", &KeptBatch::runs)
      .def("__len__", [](const KeptBatch& batch) { return batch.runs.size(); })
      .def(
          "step", [](KeptBatch& batch, int64_t ticks) { batch.batch.Step(ticks); },
          py::arg("ticks") = 1, Released())
      .def_property_readonly("over", [](const KeptBatch& batch) { return batch.batch.over(); })
      .def("observe",
           [](const KeptBatch& batch) {
             std::vector<Observation> seen;
             for (const auto& run : batch.runs) seen.push_back(run->Observe());
             return seen;
           })
      .def(
          "close", [](KeptBatch& batch) { return batch.batch.Close(); }, Released());
  m.def("arithmetic_fingerprint", &ArithmeticFingerprint);
}

}  // namespace
}  // namespace morphbus

PYBIND11_MODULE(_core, m) {
  m.doc() = "What the package morphbus is made of; its names are there without the underscore.";
  morphbus::AddErrors(m);
  morphbus::AddModel(m);
  morphbus::AddRobot(m);
  morphbus::AddProgram(m);
  morphbus::AddLog(m);
  morphbus::AddComparison(m);
  morphbus::AddRun(m);
}
