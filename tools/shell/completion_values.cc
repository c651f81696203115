#include "tools/shell/completion_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "bridge/control/control_command.h"
#include "bridge/wire/channels.h"
#include "compiler/base/text.h"
#include "compiler/dynarole/parameters.h"
#include "compiler/keywords/module_keywords.h"
#include "compiler/model/attributes.h"
#include "logger/compare/tolerances.h"
#include "logger/log/description.h"
#include "tools/base/files.h"
#include "tools/base/model_io.h"
#include "tools/base/program.h"
#include "tools/machine/run_registry.h"
#include "tools/plan/run_plan.h"
#include "vm/image/directions.h"

namespace morphbus::tools {
namespace {

/// What the words of a line are about: a model with its robots, and a program.
class LineSubject {
 public:
  explicit LineSubject(const TypedLine& line) : line_(line) {
    // All words that may be files, options' values, too: `--model FILE.m3l`.
    std::vector<std::string> words = line.arguments;
    for (const auto& [name, values] : line.options)
      words.insert(words.end(), values.begin(), values.end());
    std::string program;
    std::vector<std::string> models;
    for (const std::string& word : words) {
      if (word.ends_with(".m3l")) models.push_back(word);
      if (word.ends_with(".dyn") && program.empty()) program = word;
    }
    if (!models.empty()) model_ = LoadModel(models);
    if (models.empty()) TakeDescription(words);
    if (!model_ || program.empty()) return;
    // A program on the line is meant rather than the one with which the run began.
    const std::optional<CompiledProgram> compiled =
        LoadProgram(program, keywords::KeywordsOf(*model_));
    image_ = compiled ? compiled->image : "";
  }

  /// The robots that are meant: that of --robot or of the run, else all of the model.
  [[nodiscard]] std::vector<const model::Robot*> Robots() const {
    std::vector<const model::Robot*> robots;
    if (!model_) return robots;
    for (const model::Robot& robot : model_->robots) {
      if (robot_.empty() || robot.name == robot_) robots.push_back(&robot);
    }
    return robots;
  }

  /// Null without one.
  [[nodiscard]] const model::Model* model() const { return model_ ? &*model_ : nullptr; }
  /// Empty without one.
  [[nodiscard]] const std::string& run() const { return run_; }
  /// Null without one.
  [[nodiscard]] std::unique_ptr<vm::VerifiedProgram> Program() const {
    auto program = image_.empty() ? nullptr : VerifyProgram(image_).value_or(nullptr);
    return program;
  }

 private:
  /// The description of a log on the line, or of a run.
  void TakeDescription(const std::vector<std::string>& words) {
    Result<std::string> description = Fail("there is none");
    for (const std::string& word : words) {
      // A pipe or a device would not end.
      std::error_code none;
      if (!description && std::filesystem::is_regular_file(word, none))
        description = logger::ReadDescription(word);
    }
    if (!description) {
      const auto run = line_.options.find("--run");
      const Result<RunEntry> entry = FindRun(run == line_.options.end() ? "" : run->second.back());
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

  const TypedLine& line_;
  std::optional<model::Model> model_;
  std::string robot_, run_;
  std::string image_;
};

using Candidates = std::vector<Candidate>;

Candidates Robots(const LineSubject& subject) {
  Candidates found;
  if (subject.model() == nullptr) return found;
  for (const model::Robot& robot : subject.model()->robots) {
    found.push_back({robot.name, Counted(static_cast<int64_t>(robot.modules.size()), "module")});
  }
  return found;
}

/// The modules, each once where several robots have one of that name.
Candidates Modules(const LineSubject& subject) {
  Candidates found;
  std::set<std::string> names;
  for (const model::Robot* robot : subject.Robots()) {
    for (size_t m = 0; m < robot->modules.size(); ++m) {
      const std::string& name = robot->modules[m].name;
      const auto module = static_cast<int>(m);
      if (names.insert(name).second)
        found.push_back({name, subject.model()->TypeOf(*robot, module).name});
    }
  }
  return found;
}

/// "m1.joint_1": the parts of all modules, each once.
template <class Part>
Candidates Parts(const LineSubject& subject, std::vector<Part> model::ModuleType::*parts) {
  Candidates found;
  std::set<std::string> names;
  for (const model::Robot* robot : subject.Robots()) {
    for (size_t m = 0; m < robot->modules.size(); ++m) {
      const model::ModuleType& type = subject.model()->TypeOf(*robot, static_cast<int>(m));
      for (const Part& part : type.*parts) {
        std::string name = robot->modules[m].name + "." + part.name;
        if (names.insert(name).second) found.push_back({std::move(name), type.name});
      }
    }
  }
  return found;
}

template <class Named>
Candidates Names(const LineSubject& subject, std::vector<Named> model::Model::*things) {
  Candidates found;
  if (subject.model() == nullptr) return found;
  for (const Named& thing : subject.model()->*things) found.push_back({thing.name, ""});
  return found;
}

Candidates Roles(const LineSubject& subject) {
  Candidates found;
  const std::unique_ptr<vm::VerifiedProgram> program = subject.Program();
  for (int r = 0; program != nullptr && r < program->num_roles(); ++r) {
    // An abstract one is taken by nobody.
    if (!program->role(r).abstract_role) found.push_back({ToString(program->role(r).name), ""});
  }
  return found;
}

/// "Leg.turn": what `control invoke` can ask for.
Candidates Commands(const LineSubject& subject) {
  Candidates found;
  const std::unique_ptr<vm::VerifiedProgram> program = subject.Program();
  for (int r = 0; program != nullptr && r < program->num_roles(); ++r) {
    const vm::RoleInfo role = program->role(r);
    for (int c = 0; c < role.num_commands; ++c) {
      found.push_back(
          {ToString(role.name) + "." + ToString(program->member_name(role.commands[c])), ""});
    }
  }
  return found;
}

Candidates Parameters(const LineSubject& subject) {
  Candidates found;
  const std::unique_ptr<vm::VerifiedProgram> program = subject.Program();
  if (program == nullptr) return found;
  const std::vector<dynarole::ProgramParameter> all = dynarole::ParametersOf(*program);
  for (const dynarole::ProgramParameter& one : all) {
    // The role may be left out where no other parameter has that name.
    const std::string alone = one.name.substr(one.name.find('.') + 1);
    const auto same = std::ranges::count_if(all, [&](const dynarole::ProgramParameter& other) {
      return other.name.substr(other.name.find('.') + 1) == alone;
    });
    found.push_back(
        {same == 1 ? alone : one.name, fmt::format("{} in [{}, {}]", one.Text(one.value),
                                                   one.Text(one.least), one.Text(one.most))});
  }
  return found;
}

/// What `run --set` can change: parameters of the program, then attributes of the model.
Candidates Settable(const LineSubject& subject) {
  Candidates found = Parameters(subject);
  if (subject.model() == nullptr) return found;
  for (const model::SettableAttribute& one : model::SettableAttributes(*subject.model())) {
    const std::string now = one.value ? model::NumberText(*one.value) + " " : "";
    found.push_back({one.name, fmt::format("{}in [{}, {}] {}", now, model::NumberText(one.least),
                                           model::NumberText(one.most), one.unit)});
  }
  return found;
}

/// The channels that a run with these modules has.
Candidates Channels(const LineSubject& subject) {
  std::vector<std::string> processes = {"", std::string(bridge::kSimProcess),
                                        std::string(bridge::kLogProcess)};
  for (const Candidate& module : Modules(subject)) processes.push_back(module.word);
  Candidates found;
  if (subject.run().empty()) return found;
  for (const std::string& process : processes) {
    for (int t = 0; t <= static_cast<int>(bridge::Topic::kEnd); ++t) {
      const std::string channel =
          bridge::Channel(subject.run(), process, static_cast<bridge::Topic>(t));
      // Topics of others take another name or none.
      const auto name = bridge::ParseChannel(channel);
      if (name && name->process == process) found.push_back({channel, ""});
    }
  }
  return found;
}

Candidates Runs() {
  Candidates found;
  const Result<std::vector<RunEntry>> runs = ListRuns();
  if (!runs) return found;
  for (const RunEntry& run : *runs) found.push_back({run.name, run.robot});
  return found;
}

Candidates Directions() {
  Candidates found;
  for (const vm::DirectionRow& row : vm::kDirectionRows) {
    // Those of one part have names of their own, which need no dollar here.
    const auto [north, up, east] = row.signs;
    if (north * north + up * up + east * east == 1) found.push_back({row.name + 1, ""});
  }
  return found;
}

/// The same words with something behind them, as a value that is still to come.
Candidates With(Candidates found, const char* behind) {
  for (Candidate& one : found) one.word += behind;
  return found;
}

/// The words of `control`: a command, and what its usage says of those behind it.
TypeValues ControlWords(const TypedLine& line) {
  const std::vector<std::string>& words = line.arguments;
  TypeValues found;
  for (const std::string& usage : bridge::ControlUsages()) {
    const std::string name = usage.substr(0, usage.find(' '));
    if (words.empty()) found.words.push_back({name, usage});
    if (words.empty() || words.front() != name) continue;
    // The word of the usage that stands in this place: "push BODY DIRECTION NEWTON".
    size_t begin = 0;
    for (size_t i = 0; i < words.size() && begin != std::string::npos; ++i) {
      begin = usage.find(' ', begin);
      if (begin != std::string::npos) ++begin;
    }
    if (begin == std::string::npos) return found;
    std::string type = usage.substr(begin, usage.find(' ', begin) - begin);
    if (type.starts_with("[") && type.ends_with("]")) type = type.substr(1, type.size() - 2);
    found.type = type;
  }
  return found;
}

}  // namespace

TypeValues ValuesOfType(const std::string& type, const TypedLine& line) {
  if (type == "RUN") return {Runs()};
  if (type == "COMMAND") return ControlWords(line);
  if (type == "DIRECTION") return {Directions()};
  if (type == "TOLERANCE=VALUE") {
    Candidates found;
    for (const auto& [name, member] : logger::ToleranceNames()) found.push_back({name, ""});
    return {With(std::move(found), "=")};
  }
  // The others speak of a model, which is only then read.
  static const std::pair<const char*, Candidates (*)(const LineSubject&)> kOfSubject[] = {
      {"ROBOT", Robots},
      {"MODULE", Modules},
      {"ROLE", Roles},
      {"PARAMETER", Parameters},
      {"REGEX", Channels},
      {"Role.command", Commands},
      {"NAME=VALUE", [](const LineSubject& s) { return With(Settable(s), "="); }},
      {"MODULE@SECONDS", [](const LineSubject& s) { return With(Modules(s), "@"); }},
      {"MODULE.JOINT=VALUE",
       [](const LineSubject& s) { return With(Parts(s, &model::ModuleType::joints), "="); }},
      {"MODULE.CONNECTOR",
       [](const LineSubject& s) { return Parts(s, &model::ModuleType::connectors); }},
      {"BODY",
       [](const LineSubject& s) {
         Candidates found = Modules(s);
         std::ranges::move(Parts(s, &model::ModuleType::links), std::back_inserter(found));
         return found;
       }},
      {"TYPE", [](const LineSubject& s) { return Names(s, &model::Model::module_types); }},
      {"CONNECTION",
       [](const LineSubject& s) { return Names(s, &model::Model::connection_types); }},
  };
  for (const auto& [name, find] : kOfSubject) {
    if (type == name) return {find(LineSubject(line))};
  }
  return {};
}

}  // namespace morphbus::tools
