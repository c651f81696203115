#include "tools/base/inspection_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "bridge/description/run_model.h"
#include "bridge/observe/process_state.h"
#include "tools/base/held_report.h"
#include "tools/base/messages.h"
#include "tools/base/program.h"

namespace morphbus::tools {
namespace {

/// The name of a label's part; null for one that is not resolved.
Json LabelJson(const model::ModuleType& type, const morphbus::label_t& label) {
  // The index counts the type's joints or its links, as the label's kind says.
  if (label.index < 0) return nullptr;
  if (label.kind == morphbus::label_t::KIND_JOINT) {
    if (label.index < std::ssize(type.joints)) return type.joints[label.index].name;
  } else if (label.index < std::ssize(type.links)) {
    return type.links[label.index].name;
  }
  // A damaged log may name a part that the type does not have: its number is all that is known.
  return label.index;
}

}  // namespace

vm::SourceFiles SourceOfImage(const std::string& image) {
  // An image that the verifier refuses has no name that could be relied on.
  const Result<std::unique_ptr<vm::VerifiedProgram>> program = VerifyProgram(image);
  if (!program) return {};
  return vm::SourceFiles(**program);
}

Json InspectionJson(const std::string& module, const model::ModuleType& type,
                    const Inspection& inspection, const vm::SourceFiles& program) {
  const morphbus::status_t& status = inspection.status;
  Json labels = Json::object(), conventions = Json::object();
  // Labels are told by name; conventions by joint, as signs: 0 where the program has set none.
  for (const morphbus::label_t& label : status.labels) labels[label.name] = LabelJson(type, label);
  for (int j = 0; j < std::min(std::ssize(status.joint_sign), std::ssize(type.joints)); ++j) {
    conventions[type.joints[j].name] = status.joint_sign[j];
  }
  return {{"module", module},
          {"type", status.type_name},
          {"tick", status.header.tick},
          {"seconds", static_cast<double>(status.header.sim_time_us) * 1e-6},
          {"role", status.role < 0 ? Json(nullptr) : Json(status.role_name)},
          {"frozen", status.frozen != 0},
          {"has_pose", status.has_pose != 0},
          {"pose_stale", status.pose_stale != 0},
          {"labels", labels},
          {"conventions", conventions},
          {"program", program.own()},
          {"fields", FieldsJson(inspection.held.fields)},
          {"tasks", TasksJson(inspection.held.tasks, program, NamesOf(type.connectors))}};
}

Json InspectionsOf(const logger::RunLog& log) {
  // Images name their own source.
  std::map<uint64_t, vm::SourceFiles> sources;
  if (log.described != nullptr && log.described->has_program) {
    sources[log.facts.program_hash] = vm::SourceFiles(log.described->images.program());
  }
  for (const auto& [hash, image] : log.deployed) sources.emplace(hash, SourceOfImage(image));
  // By tick, the modules in the robot's order.
  std::map<int64_t, Json> ticks;
  for (const logger::ModuleSeries& module : log.modules) {
    if (log.robot == nullptr || module.model_index < 0) continue;
    const model::ModuleType& type = log.model->TypeOf(*log.robot, module.model_index);
    // An answer comes in several STATUS; it is whole with the last of its parts.
    bridge::InspectionCollector collector;
    for (const logger::StatusSample& sample : module.status) {
      std::optional<bridge::HeldState> held = collector.Take(sample.status);
      // Only an answer that is whole is told.
      if (!held) continue;
      const auto program = static_cast<uint64_t>(sample.status.header.program_hash);
      Json& answers = ticks.try_emplace(sample.tick, Json::array()).first->second;
      answers.push_back(
          InspectionJson(module.name, type, {sample.status, *std::move(held)}, sources[program]));
    }
  }
  Json inspections = Json::array();
  for (auto& [tick, answers] : ticks) {
    // All answers of a tick have its time.
    const Json seconds = answers.front()["seconds"];
    inspections.push_back({{"tick", tick}, {"seconds", seconds}, {"modules", std::move(answers)}});
  }
  return inspections;
}

std::string AnswersText(const Json& answers) {
  std::string text;
  for (const Json& answer : answers) {
    text += fmt::format("{}: role {}{}, pose {}\n", answer["module"].get<std::string>(),
                        answer["role"].is_null() ? "none" : answer["role"].get<std::string>(),
                        answer["frozen"].get<bool>() ? " (frozen)" : "",
                        !answer["has_pose"].get<bool>()    ? "unknown"
                        : answer["pose_stale"].get<bool>() ? "stale"
                                                           : "known");
    // What the role has found out about the module: its labels, and the conventions that are set.
    for (const auto& [name, part] : answer["labels"].items()) {
      text += fmt::format("  label {} = {}\n", name,
                          part.is_string() ? part.get<std::string>() : "(not resolved)");
    }
    for (const auto& [joint, sign] : answer["conventions"].items()) {
      if (sign.get<int>() == 0) continue;
      text += fmt::format("  joint {}: sign {}\n", joint, sign.get<int>() > 0 ? "+" : "-");
    }
    // What the program keeps, and what it is doing.
    text += FieldsText(answer["fields"]) + TasksText(answer["tasks"]);
  }
  return text;
}

std::string InspectionsText(const Json& inspections) {
  std::string text;
  for (const Json& inspection : inspections) {
    text += fmt::format("inspected at tick {} ({:.2f} s):\n{}", inspection["tick"].get<int64_t>(),
                        inspection["seconds"].get<double>(), AnswersText(inspection["modules"]));
  }
  return text;
}

}  // namespace morphbus::tools
