// Runs and batches of them.

#include <morphbus/run/batch.h>
#include <pybind11/stl.h>

#include "tools/python/bindings.h"

namespace py = pybind11;

namespace morphbus::python {
namespace {

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

}  // namespace

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

}  // namespace morphbus::python
