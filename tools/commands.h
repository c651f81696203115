#pragma once
// One function a subcommand: adds it to the command line, and sets `action` when the user chose it.

#include "tools/cli.h"

namespace CLI {
class App;
}

namespace morphbus::tools {

// Models and programs.
void AddCheck(CLI::App& app, Action* action);
void AddConnections(CLI::App& app, Action* action);
void AddFk(CLI::App& app, Action* action);
void AddGraph(CLI::App& app, Action* action);
void AddEquivalent(CLI::App& app, Action* action);
void AddVariants(CLI::App& app, Action* action);
void AddRoles(CLI::App& app, Action* action);
void AddCompile(CLI::App& app, Action* action);
void AddDisasm(CLI::App& app, Action* action);
void AddExport(CLI::App& app, Action* action);
void AddFormat(CLI::App& app, Action* action);
void AddDraw(CLI::App& app, Action* action);

// Running robots.
void AddRun(CLI::App& app, Action* action);
void AddSim(CLI::App& app, Action* action);
void AddModule(CLI::App& app, Action* action);
void AddLog(CLI::App& app, Action* action);
void AddReplay(CLI::App& app, Action* action);
void AddSpy(CLI::App& app, Action* action);
void AddRuns(CLI::App& app, Action* action);

// Logs.
void AddCompare(CLI::App& app, Action* action);
void AddInfo(CLI::App& app, Action* action);
void AddVerify(CLI::App& app, Action* action);
void AddRepair(CLI::App& app, Action* action);

}  // namespace morphbus::tools
