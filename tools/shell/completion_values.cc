#include "tools/shell/completion_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <set>
#include <sstream>
#include <utility>

#include "bridge/control/control_command.h"
#include "bridge/wire/channels.h"
#include "compiler/base/text.h"
#include "compiler/dynarole/parameters.h"
#include "compiler/model/attributes.h"
#include "logger/compare/tolerances.h"
#include "tools/base/program.h"
#include "tools/machine/run_registry.h"
#include "tools/shell/line_subject.h"
#include "vm/image/directions.h"

namespace morphbus::tools {
namespace {

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

/// The words of a usage: "push", "BODY", "DIRECTION", "NEWTON", "[SECONDS]".
std::vector<std::string> WordsOf(const std::string& usage) {
  std::istringstream stream(usage);
  return {std::istream_iterator<std::string>(stream), {}};
}

/// The words of `control`: a command, and behind it what its usage says of that place.
TypeValues ControlWords(const TypedLine& line) {
  const std::vector<std::string>& typed = line.arguments;
  TypeValues found;
  for (const std::string& usage : bridge::ControlUsages()) {
    const std::vector<std::string> words = WordsOf(usage);
    // The command itself comes first; of the others only the usage of the one that is typed counts.
    if (typed.empty()) found.words.push_back({words.front(), usage});
    if (typed.empty() || typed.front() != words.front() || typed.size() >= words.size()) continue;
    // Words in brackets may be left out, and are of the same types.
    std::string type = words[typed.size()];
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
      {"MODULE.LINK", [](const LineSubject& s) { return Parts(s, &model::ModuleType::links); }},
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
