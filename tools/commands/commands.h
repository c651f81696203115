#pragma once
// One function a subcommand, in a file of its own: each adds the subcommand to the command line
// with its options, its examples and what it does. docs/cli.md describes the options, the output
// and the exit statuses; the functions stand here in the same order. Nothing runs until the command
// line has been parsed. The headers that are included here are those that every command uses.

#include "tools/base/files.h"
#include "tools/base/messages.h"
#include "tools/base/model_io.h"
#include "tools/base/options.h"
#include "tools/base/output_path.h"

namespace morphbus::tools {

// Models and programs.
/// `check` compiles M3L files and lists their module types, connections and robots.
void AddCheck(CommandLine* line);
/// `connections` lists the numbered ways of mating two modules, or explains one pair of connectors.
void AddConnections(CommandLine* line);
/// `fk` prints the poses of all links in the robot frame at given joint values.
void AddFk(CommandLine* line);
/// `graph` prints the bodies, joints and mobility of a robot.
void AddGraph(CommandLine* line);
/// `equivalent` answers whether two robots are kinematically congruent, with a mapping or a reason.
void AddEquivalent(CommandLine* line);
/// `variants` writes other assemblies that are congruent to a robot, as M3L.
void AddVariants(CommandLine* line);
/// `roles` says which module takes which role while the robot stands still.
void AddRoles(CommandLine* line);
/// `compile` turns a DynaRole program into an image.
void AddCompile(CommandLine* line);
/// `disasm` prints a program image as text.
void AddDisasm(CommandLine* line);
/// `export` writes a model, a module type or a robot in the format of another program.
void AddExport(CommandLine* line);
/// `format` lays out M3L and DynaRole files canonically, in place.
void AddFormat(CommandLine* line);
/// `draw` writes a picture of a robot, from its model or from a log.
void AddDraw(CommandLine* line);
/// `build` writes a sheet with which a person puts a real robot together.
void AddBuild(CommandLine* line);

/// `new` writes files to begin with: a module type, a program, a project.
void AddNew(CommandLine* line);
/// `lsp` serves editors.
void AddLsp(CommandLine* line);

// Running robots.
/// `run` runs a whole robot: simulator, modules and logger.
void AddRun(CommandLine* line);
/// `sweep` runs a robot many times, and looks at the rows of that.
void AddSweep(CommandLine* line);
void AddOptimise(CommandLine* line);
/// `benchmark` holds robots and their programs against tasks.
void AddBenchmark(CommandLine* line);
/// `sim` is the simulator process of a run; `run` starts it, and so may a person.
void AddSim(CommandLine* line);
/// `module` becomes the program morphbus-module, one module of a run.
void AddModule(CommandLine* line);
/// `log` is the logger process of a run; `run` starts it, and so may a person.
void AddLog(CommandLine* line);
/// `replay` publishes a log again.
void AddReplay(CommandLine* line);
/// `spy` shows what is on the bus: channels, rates, losses, fields, roles.
void AddSpy(CommandLine* line);
/// `monitor` serves runs and logs to the browser and to other viewers.
void AddMonitor(CommandLine* line);
/// `control` acts on a running robot, and says at which tick.
void AddControl(CommandLine* line);
/// `runs` lists what runs on this machine.
void AddRuns(CommandLine* line);
/// `doctor` answers whether this machine can carry a run, and names what mends it.
void AddDoctor(CommandLine* line);

/// `completion` and `man` tell shells and manual pages of the command line.
void AddCompletion(CommandLine* line);
void AddManual(CommandLine* line);

// Logs.
/// `compare` answers whether two logs hold the same walk, by role and label.
void AddCompare(CommandLine* line);
/// `info` prints what a log holds.
void AddInfo(CommandLine* line);
/// `verify` answers whether a log is whole.
void AddVerify(CommandLine* line);
/// `repair` copies what is sound in a damaged log into a new one.
void AddRepair(CommandLine* line);
/// `reproduce` runs again what a log says, and answers whether it says the same.
void AddReproduce(CommandLine* line);
/// `report` writes one run on a page.
void AddReport(CommandLine* line);
/// `convert` writes a log for other programs, or compresses it.
void AddConvert(CommandLine* line);

}  // namespace morphbus::tools
