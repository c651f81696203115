#include "tools/lsp/role_fits.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "compiler/base/text.h"
#include "tools/base/program.h"
#include "tools/plan/run_plan.h"

namespace morphbus::tools {
namespace {

/// Robots that are larger, and more of them, would keep an editor waiting.
constexpr size_t kLargestRobot = 200;
constexpr size_t kMostRobots = 60;

/// What the robot makes of the program; nothing where the program cannot run on it.
std::optional<StaticRoles> Ask(const ModelFile& model, const std::string& robot,
                               const std::string& program, const std::string& text,
                               const source::TextReader& read) {
  // The program is compiled for this model alone, as `morphbus roles` does it: a word that none of
  // its module types has makes it no program for this model.
  const Result<keywords::KeywordTable> table = keywords::KeywordTable::Of(model.keywords);
  if (!table) return std::nullopt;
  const dynarole::CompileResult result =
      dynarole::CompileProgram(program, text, *table, dynarole::Dump::kNone, nullptr, read);
  if (!result.image) return std::nullopt;
  CompiledProgram image;
  image.image.assign(result.image->begin(), result.image->end());
  image.hash = HashOfImage(image.image);
  RunOptions options;
  options.model_file = model.path;
  options.program_file = program;
  options.robot = robot;
  const std::optional<RunPlan> plan = PlanCompiled(options, *model.compiled.model, image);
  if (!plan) return std::nullopt;
  Result<StaticRoles> roles = SettleRoles(*plan);
  if (!roles) return std::nullopt;
  return std::move(*roles);
}

}  // namespace

void RoleFits::Begin(Workspace* workspace, const std::string& program) {
  if (program == program_ && workspace->IsCurrent(stamps_)) return;
  const ProgramFile& file = workspace->Program(program);
  program_ = program;
  stamps_ = file.stamps;
  robots_.clear();
  fits_.clear();
  next_ = 0;
  // A program with errors fits nothing; what it did before is of no use either.
  if (!file.compiled.image) return;
  // A robot belongs to the model that declares it, and not to those that import that.
  const std::vector<std::string> models = file.models;
  for (const bool own : {true, false}) {
    for (const std::string& path : models) AddRobots(workspace->Model(path), own);
  }
}

void RoleFits::AddRobots(const ModelFile& model, bool own) {
  if (!model.compiled.model) return;
  for (const model::Robot& robot : model.compiled.model->robots) {
    const int thing = model.names.Find(source::NameKind::kRobot, robot.name);
    const bool declares = thing >= 0 && model.names.things[thing].extent.file == 0;
    const bool known = std::any_of(robots_.begin(), robots_.end(), [&](const Candidate& other) {
      return other.robot == robot.name;
    });
    if (declares != own || known || robot.modules.size() > kLargestRobot) continue;
    if (robots_.size() < kMostRobots) robots_.push_back({model.path, robot.name});
  }
}

bool RoleFits::Work(Workspace* workspace) {
  if (complete()) return false;
  const Candidate candidate = robots_[next_++];
  const ModelFile& model = workspace->Model(candidate.model);
  if (!model.compiled.model || model.compiled.model->FindRobot(candidate.robot) == nullptr) {
    return true;
  }
  const ProgramFile& program = workspace->Program(program_);
  const std::string text(program.compiled.sources.text(0));
  std::optional<StaticRoles> roles =
      Ask(model, candidate.robot, program_, text, workspace->Reader());
  const bool any = roles && std::any_of(roles->modules.begin(), roles->modules.end(),
                                        [](const StaticRole& m) { return !m.role.empty(); });
  if (any) fits_.push_back({candidate.model, candidate.robot, std::move(*roles)});
  return true;
}

}  // namespace morphbus::tools
