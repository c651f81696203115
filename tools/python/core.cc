// The Python module morphbus._core: the libraries of include/morphbus/, with NumPy arrays.

#include <morphbus/diagnostic.h>
#include <pybind11/stl.h>

#include <memory>

#include "tools/python/bindings.h"

namespace py = pybind11;

namespace morphbus::python {

Numbers ToArray(std::vector<double> values, std::vector<py::ssize_t> shape) {
  auto* kept = new std::vector<double>(std::move(values));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<double>*>(p); });
  return Numbers(std::move(shape), kept->data(), owner);
}
Numbers ToArray(std::vector<double> values) {
  const auto size = static_cast<py::ssize_t>(values.size());
  return ToArray(std::move(values), {size});
}

std::pair<Numbers, Numbers> ToArrays(const std::vector<Pose>& poses) {
  std::vector<double> positions, rotations;
  for (const Pose& pose : poses) {
    positions.insert(positions.end(), pose.position.begin(), pose.position.end());
    rotations.insert(rotations.end(), pose.rotation.begin(), pose.rotation.end());
  }
  const auto count = static_cast<py::ssize_t>(poses.size());
  return {ToArray(std::move(positions), {count, 3}), ToArray(std::move(rotations), {count, 4})};
}

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

}  // namespace morphbus::python

PYBIND11_MODULE(_core, m) {
  m.doc() = "What the package morphbus is made of; its names are there without the underscore.";
  morphbus::python::AddErrors(m);
  morphbus::python::AddModel(m);
  morphbus::python::AddRobot(m);
  morphbus::python::AddProgram(m);
  morphbus::python::AddLog(m);
  morphbus::python::AddComparison(m);
  morphbus::python::AddRun(m);
}
