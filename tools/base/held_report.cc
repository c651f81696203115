#include "tools/base/held_report.h"

#include <fmt/format.h>

#include "compiler/base/quantity.h"
#include "compiler/base/text.h"
#include "vm/image/fault_text.h"
#include "vm/image/image_texts.h"

namespace morphbus::tools {
namespace {

/// The words of vm::WaitKind.
constexpr const char* kWaits[] = {"nothing", "the next tick", "a time", "a joint"};

/// A task with its calls, the innermost first.
Json TaskJson(const bridge::HeldTask& task, const vm::SourceFiles& files,
              const std::vector<std::string>& connectors) {
  Json calls = Json::array();
  for (const bridge::HeldCall& call : task.calls) {
    const vm::SourcePlace place = files.Of(call.line);
    calls.push_back({{"function", call.function},
                     {"file", place.file},
                     {"line", place.line},
                     {"locals", LocalsJson(LocalsForPeople(call.locals, connectors))}});
  }
  Json json = {{"kind", vm::TaskKindName(task.kind)}, {"routine", task.routine}};
  // What it waits for stands beside the other members, not in an object of its own.
  json.update(WaitJson(task.wait, task.until_us, task.joint));
  json["calls"] = calls;
  return json;
}

/// Whether a local has the name and type of the neighbours to which a loop has still to come, which
/// the compiler holds.
bool MayBeToCome(const bridge::HeldValue& local) {
  return local.name == "neighbours" && local.type == vm::InfoOf(vm::ValueType::kSet).word;
}

/// "c1 and c2": a set of neighbours, a bit for each connector, as held: a number.
std::string NeighboursText(const std::string& held, const std::vector<std::string>& connectors) {
  const std::optional<int32_t> bits = ReadNumber<int32_t>(held);
  if (!bits) return held;
  std::string text;
  for (size_t c = 0; c < connectors.size(); ++c) {
    const bool in_set = (static_cast<uint32_t>(*bits) >> c & 1) != 0;
    if (in_set) text += (text.empty() ? "" : " and ") + connectors[c];
  }
  return text.empty() ? "none" : text;
}

}  // namespace

Json WaitJson(vm::WaitKind wait, int64_t until_us, const std::string& joint) {
  // Time and joint are members only where the task waits for such a thing.
  Json json = {{"waits_for", kWaits[static_cast<int>(wait)]}};
  if (wait == vm::WaitKind::kSleep) json["until"] = Seconds(until_us);
  if (wait == vm::WaitKind::kMotion) json["joint"] = joint;
  return json;
}

std::string WaitText(const Json& wait) {
  // A time and a joint say themselves what is waited for.
  if (wait.contains("until")) return fmt::format("{:.2f} s", wait["until"].get<double>());
  if (wait.contains("joint")) return "joint " + wait["joint"].get<std::string>();
  return wait["waits_for"].get<std::string>();
}

Json FieldsJson(const std::vector<bridge::HeldValue>& fields) {
  Json json = Json::object();
  for (const bridge::HeldValue& field : fields) {
    json[field.name] = {{"type", field.type}, {"value", field.value}};
  }
  return json;
}

Json LocalsJson(const std::vector<bridge::HeldValue>& locals) {
  Json json = Json::array();
  for (const bridge::HeldValue& local : locals) {
    // A local that nothing was written to yet has no value to tell.
    if (local.value.empty()) continue;
    json.push_back({{"name", local.name}, {"type", local.type}, {"value", local.value}});
  }
  return json;
}

std::vector<std::string> ConnectorNames(const vm::VerifiedKinematics& kinematics) {
  std::vector<std::string> names;
  for (int c = 0; c < kinematics.num_connectors(); ++c) {
    names.push_back(ToString(kinematics.connector(c).name));
  }
  return names;
}

std::vector<bridge::HeldValue> LocalsForPeople(std::vector<bridge::HeldValue> locals,
                                               const std::vector<std::string>& connectors) {
  // The notes of an image tell these neighbours by their name alone, which a program may give to
  // the variable of a loop: that one stands behind them.
  bool behind_hidden = false;
  for (bridge::HeldValue& local : locals) {
    const bool hidden = MayBeToCome(local) && !behind_hidden;
    behind_hidden = hidden;
    if (local.value.empty()) continue;
    if (hidden) {
      local.value.clear();
    } else if (local.type == vm::InfoOf(vm::ValueType::kSet).word) {
      local.value = NeighboursText(local.value, connectors);
    }
  }
  return locals;
}

Json TasksJson(const std::vector<bridge::HeldTask>& tasks, const vm::SourceFiles& files,
               const std::vector<std::string>& connectors) {
  Json json = Json::array();
  for (const bridge::HeldTask& task : tasks) json.push_back(TaskJson(task, files, connectors));
  return json;
}

std::string FieldsText(const Json& fields) {
  std::string text;
  for (const auto& [name, field] : fields.items()) {
    text += fmt::format("  field {} = {} ({})\n", name, field["value"].get<std::string>(),
                        field["type"].get<std::string>());
  }
  return text;
}

std::string LocalsText(const Json& locals) {
  std::string text;
  for (size_t i = 0; i < locals.size(); ++i) {
    // A local without a name is told by its number.
    const std::string name = locals[i]["name"].get<std::string>();
    text += fmt::format("{}{} = {}", i > 0 ? ", " : "", name.empty() ? std::to_string(i) : name,
                        locals[i]["value"].get<std::string>());
  }
  return text;
}

std::string CallsText(const Json& calls) {
  std::string text;
  for (const Json& call : calls) {
    // "in Leg.walk, walk.dyn:7: n = 3"; whatever is not known is left out.
    const std::string locals = LocalsText(call["locals"]);
    const vm::SourcePlace place = {call["file"].get<std::string>(), call["line"].get<int>()};
    text += fmt::format("    in {}, {}{}\n", call["function"].get<std::string>(),
                        vm::PlaceText(place), locals.empty() ? "" : ": " + locals);
  }
  return text;
}

std::string TasksText(const Json& tasks) {
  std::string text;
  for (const Json& task : tasks) {
    text += fmt::format("  {} {} waits for {}\n", task["kind"].get<std::string>(),
                        task["routine"].get<std::string>(), WaitText(task));
    text += CallsText(task["calls"]);
  }
  return text;
}

}  // namespace morphbus::tools
