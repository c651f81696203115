// Logs and comparisons of them.

#include <morphbus/compare/compare.h>
#include <morphbus/observe/log.h>
#include <pybind11/stl.h>

#include "tools/python/bindings.h"

namespace py = pybind11;

namespace morphbus::python {
namespace {

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
  auto [position, rotation] = python::ToArrays(series.pose);
  return {series.link, ToArray(std::move(series.time_s)), std::move(position), std::move(rotation)};
}

}  // namespace

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

}  // namespace morphbus::python
