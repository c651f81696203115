#include "tools/shell/line_subject.h"

#include <cstdlib>
#include <filesystem>
#include <utility>

#include "compiler/keywords/module_keywords.h"
#include "logger/log/description.h"
#include "tools/base/files.h"
#include "tools/base/model_io.h"
#include "tools/base/program.h"
#include "tools/machine/run_registry.h"
#include "tools/plan/run_plan.h"

namespace morphbus::tools {
namespace {

/// The word as the shell would hand it over: what is completed has not been expanded yet.
std::string WithoutTilde(const std::string& word) {
  const char* home = std::getenv("HOME");
  return home != nullptr && word.starts_with("~/") ? home + word.substr(1) : word;
}

/// The last value of an option; empty if it is not on the line.
std::string ValueOf(const TypedLine& line, const std::string& option) {
  const auto at = line.options.find(option);
  return at == line.options.end() || at->second.empty() ? "" : at->second.back();
}

}  // namespace

LineSubject::LineSubject(const TypedLine& line) : robot_(ValueOf(line, "--robot")) {
  // Every word may be a file, values of options, too: `--model FILE.m3l`.
  std::vector<std::string> words = line.arguments;
  for (const auto& [name, values] : line.options)
    words.insert(words.end(), values.begin(), values.end());
  std::vector<std::string> models;
  std::vector<std::string> others;
  std::string program;
  for (const std::string& word : words) {
    const std::string path = WithoutTilde(word);
    if (path.ends_with(".m3l")) {
      models.push_back(path);
    } else if (path.ends_with(".dyn")) {
      if (program.empty()) program = path;
    } else {
      others.push_back(path);
    }
  }
  if (models.empty()) {
    TakeDescription(others, ValueOf(line, "--run"));
  } else {
    model_ = LoadModel(models);
  }
  if (!model_ || program.empty()) return;
  // A program on the line is meant rather than the one with which the run began.
  const std::optional<CompiledProgram> compiled =
      LoadProgram(program, keywords::KeywordsOf(*model_));
  image_ = compiled ? compiled->image : "";
}

void LineSubject::TakeDescription(const std::vector<std::string>& files, const std::string& run) {
  Result<std::string> description = Fail("there is none");
  for (const std::string& file : files) {
    // A pipe or a device would not end.
    std::error_code none;
    if (!description && std::filesystem::is_regular_file(file, none))
      description = logger::ReadDescription(file);
  }
  // Without a log on the line it is about a run, if about any.
  if (!description) {
    const Result<RunEntry> entry = FindRun(run);
    if (entry) description = ReadFile(entry->folder + "/description.pb");
  }
  if (!description) return;
  Result<RunPlan> plan = PlanFromDescription(*description);
  if (!plan) return;
  robot_ = plan->robot().name;
  run_ = plan->description.run();
  image_ = plan->description.program_image();
  model_ = std::move(plan->model);
}

std::vector<const model::Robot*> LineSubject::Robots() const {
  std::vector<const model::Robot*> robots;
  if (!model_) return robots;
  for (const model::Robot& robot : model_->robots) {
    if (robot_.empty() || robot.name == robot_) robots.push_back(&robot);
  }
  return robots;
}

std::unique_ptr<vm::VerifiedProgram> LineSubject::Program() const {
  return image_.empty() ? nullptr : VerifyProgram(image_).value_or(nullptr);
}

}  // namespace morphbus::tools
