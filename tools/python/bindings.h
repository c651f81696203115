#pragma once
// The parts of the Python module morphbus._core, and what they share.

#include <morphbus/model/model.h>
#include <morphbus/view/view.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <string>
#include <utility>
#include <vector>

namespace morphbus::python {

using Numbers = pybind11::array_t<double>;
/// Functions that take long let other threads of Python go on.
using Released = pybind11::call_guard<pybind11::gil_scoped_release>;

/// The numbers as an array of this shape, or as a row of them, that owns them: they are moved, and
/// not copied.
Numbers ToArray(std::vector<double> values, std::vector<pybind11::ssize_t> shape);
Numbers ToArray(std::vector<double> values);

/// Positions (n, 3) and rotations (n, 4) of poses.
std::pair<Numbers, Numbers> ToArrays(const std::vector<Pose>& poses);

/// The views by their names on the command line. Throws Failure for another name.
std::vector<View> ViewsNamed(const std::vector<std::string>& names);

// Each adds its classes and functions to the module, errors first.
void AddErrors(pybind11::module_& m);
void AddModel(pybind11::module_& m);
void AddRobot(pybind11::module_& m);
void AddProgram(pybind11::module_& m);
void AddLog(pybind11::module_& m);
void AddComparison(pybind11::module_& m);
void AddRun(pybind11::module_& m);

}  // namespace morphbus::python
