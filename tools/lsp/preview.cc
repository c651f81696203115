#include "tools/lsp/preview.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "tools/lsp/pictures.h"

namespace morphbus::tools {
namespace {

using source::NamedThing;
using source::NameKind;

constexpr double kPreviewWidth = 760;

Json PreviewOfModel(const ModelFile& file, const std::string& wanted) {
  const model::Model& solved = file.compiled.solved;
  Json preview = {{"robots", Json::array()}, {"robot", ""}, {"svg", ""}, {"complete", true}};
  if (file.compiled.model && !file.compiled.model->robots.empty()) {
    const model::Model& model = *file.compiled.model;
    for (const model::Robot& robot : model.robots) preview["robots"].push_back(robot.name);
    const model::Robot* robot = model.FindRobot(wanted);
    if (robot == nullptr) robot = &model.robots[0];
    preview["robot"] = robot->name;
    preview["svg"] = SvgOf(RobotDrawing(model, *robot, {}, kPreviewWidth));
  } else if (!solved.module_types.empty()) {
    preview["svg"] = SvgOf(ModuleDrawing(solved, 0, kPreviewWidth));
  }
  return preview;
}

Json PreviewOfProgram(Workspace* workspace, const ProgramFile& program, const RoleFits& fits,
                      const std::string& wanted) {
  Json preview = {{"robots", Json::array()},
                  {"robot", ""},
                  {"svg", ""},
                  {"modules", Json::array()},
                  {"complete", fits.complete()}};
  for (const RobotFit& fit : fits.fits()) preview["robots"].push_back(fit.robot);
  const auto named = std::find_if(fits.fits().begin(), fits.fits().end(),
                                  [&](const RobotFit& fit) { return fit.robot == wanted; });
  const auto shown = named == fits.fits().end() ? fits.fits().begin() : named;
  if (shown == fits.fits().end()) return preview;
  preview["robot"] = shown->robot;
  // A role has the colour that it has in reports and in the monitor.
  std::vector<std::string> roles;
  for (const NamedThing& thing : program.names.things) {
    const bool concrete = thing.kind == NameKind::kRole && thing.extent.file >= 0 &&
                          !thing.summary.starts_with("abstract ");
    if (concrete) roles.push_back(thing.name);
  }
  RoleColors colors;
  colors.Add(roles);
  std::vector<Color> of_modules;
  for (const StaticRole& module : shown->roles.modules) {
    const Color color = colors.Of(module.role);
    of_modules.push_back(color);
    preview["modules"].push_back(
        {{"module", module.module}, {"role", module.role}, {"color", CssColor(color)}});
  }
  const ModelFile& model = workspace->Model(shown->model);
  const model::Robot* robot =
      model.compiled.model ? model.compiled.model->FindRobot(shown->robot) : nullptr;
  if (robot != nullptr && robot->modules.size() == of_modules.size()) {
    preview["svg"] = SvgOf(RobotDrawing(*model.compiled.model, *robot, of_modules, kPreviewWidth));
  }
  return preview;
}

}  // namespace

Json PreviewOf(Workspace* workspace, const Document& document, const RoleFits& fits,
               const std::string& robot) {
  if (document.is_model()) return PreviewOfModel(workspace->Model(document.path), robot);
  return PreviewOfProgram(workspace, workspace->Program(document.path), fits, robot);
}

}  // namespace morphbus::tools
