#include "tools/commands/draw_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "compiler/keywords/module_keywords.h"
#include "logger/show/robot_scenes.h"
#include "sim/rigid_body_model.h"
#include "tools/base/model_io.h"
#include "tools/base/program.h"
#include "tools/base/world_file.h"
#include "tools/lsp/pictures.h"
#include "tools/roles/static_roles.h"
#include "vm/image/image_texts.h"

namespace morphbus::tools {
namespace {

/// A drawing with one scene, which has no view yet.
logger::Drawing DrawingOf(logger::Scene scene, std::string title) {
  logger::Drawing drawing;
  drawing.title = std::move(title);
  drawing.panels.push_back({std::move(scene), logger::View::kSide, ""});
  return drawing;
}

/// A module of a type, with a dot and a name where each connector is.
std::optional<logger::Drawing> DrawModuleType(const model::Model& model, const std::string& name) {
  const model::ModuleType* type = PickByName(model.module_types, name, "module");
  if (type == nullptr) return std::nullopt;
  logger::Drawing drawing =
      ModuleDrawing(model, static_cast<int>(type - model.module_types.data()), 0);
  if (drawing.panels.empty()) return Refuse(name + " has no shape that could be drawn");
  logger::Scene scene = std::move(drawing.panels[0].scene);
  // The module frame is the world's, so that positions in it are those of the picture.
  for (const model::Connector& connector : type->connectors) {
    scene.marks.push_back({connector.name, connector.p_MoCo_M});
  }
  return DrawingOf(std::move(scene), name);
}

/// Two modules, mated in one of the ways of a connection.
std::optional<logger::Drawing> DrawMated(const model::Model& model, const std::string& name,
                                         int number) {
  // The numbers are those of one connection.
  const model::ConnectionType* type = PickByName(model.connection_types, name, "connection");
  if (type == nullptr) return std::nullopt;
  const auto option = std::ranges::find(type->options, number, &model::ConnectionOption::number);
  if (option == type->options.end()) {
    return Refuse(
        fmt::format("--number {}: {} has {} ways, from 1; morphbus connections lists them", number,
                    type->name, type->options.size()));
  }
  logger::Drawing drawing =
      MatedDrawing(model, static_cast<int>(type - model.connection_types.data()),
                   static_cast<int>(option - type->options.begin()), 0);
  if (drawing.panels.empty()) return Refuse(type->name + ": its modules have no shape to draw");
  // The title says which connectors meet, in the words of `connections`.
  const std::string& a = model.module_types[type->type_a].connectors[option->connector_a].name;
  const std::string& b = model.module_types[type->type_b].connectors[option->connector_b].name;
  return DrawingOf(std::move(drawing.panels[0].scene),
                   fmt::format("{}: a.{} to b.{}", number, a, b));
}

/// Colours of a robot's modules, and what they mean.
struct Colouring {
  std::vector<Color> colors;  ///< A module each.
  std::vector<logger::LegendEntry> legend;
};

/// By the roles that the modules of the robot take where they stand.
std::optional<Colouring> ColourByRole(const model::Model& model, const ModelPicture& picture) {
  const std::optional<CompiledProgram> program =
      LoadProgram(picture.program, keywords::KeywordsOf(model));
  if (!program) return std::nullopt;
  RunOptions run;
  run.model_file = picture.file;
  run.program_file = picture.program;
  run.robot = picture.robot;
  const std::optional<RunPlan> plan = PlanCompiled(run, model, *program);
  if (!plan) return std::nullopt;
  const Result<StaticRoles> roles = SettleRoles(*plan);
  if (!roles) return Refuse(roles.error().message);
  const Result<std::unique_ptr<vm::VerifiedProgram>> verified = VerifyProgram(program->image);
  if (!verified) return Refuse(verified.error().message);
  // A role has the colour that it has in reports and in the monitor: that of its place among all
  // roles of the program, whether or not a module takes it.
  RoleColors colors;
  colors.Add(vm::PlayableRoles(**verified));
  // The legend has those that are taken.
  Colouring colouring;
  std::vector<std::string> played;
  for (const StaticRole& module : roles->modules) {
    played.push_back(module.role);
    colouring.colors.push_back(colors.Of(module.role));
  }
  colouring.legend = logger::RoleLegend(colors, played);
  return colouring;
}

/// The robot standing on the ground as it starts.
std::optional<logger::Drawing> DrawRobot(const model::Model& model, const ModelPicture& picture) {
  const model::Robot* robot = PickRobot(model, picture.robot);
  if (robot == nullptr) return std::nullopt;
  // Without a program each module has a colour of its own.
  Colouring colouring = {PaletteColors(robot->modules.size()), {}};
  if (!picture.program.empty()) {
    std::optional<Colouring> by_role = ColourByRole(model, picture);
    if (!by_role) return std::nullopt;
    colouring = std::move(*by_role);
  }
  // The robot stands where a run of it begins, half a millimetre above the ground.
  logger::Scene scene =
      logger::SceneOf(model, *robot, sim::PlaceOnGround(model, *robot), colouring.colors);
  if (!picture.world.empty()) {
    const std::optional<LoadedWorld> world = LoadWorld(picture.world);
    if (!world) return std::nullopt;
    logger::AddObstacles(world->obstacles, &scene);
  }
  logger::Drawing drawing = DrawingOf(std::move(scene), robot->name);
  drawing.legend = std::move(colouring.legend);
  return drawing;
}

}  // namespace

std::optional<logger::Drawing> DrawModel(const ModelPicture& picture, const std::string& output,
                                         const OutputKind& kind, bool force) {
  ModelSource source;
  const std::optional<model::Model> model = LoadModel({picture.file}, &source);
  if (!model) return std::nullopt;
  // The picture may be none of the files that it is made of.
  std::vector<std::string> read = source.Files();
  if (!picture.program.empty()) read.push_back(picture.program);
  if (!MayWrite(output, kind, force, read)) return std::nullopt;
  if (!picture.module.empty()) return DrawModuleType(*model, picture.module);
  if (picture.number > 0) return DrawMated(*model, picture.connection, picture.number);
  return DrawRobot(*model, picture);
}

}  // namespace morphbus::tools
