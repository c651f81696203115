#include "tools/convert/rerun_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/base/program.h"
#include "vm/image/print_line.h"

namespace morphbus::tools {
namespace {

/// The words of vm::TaskKind and vm::WaitKind.
constexpr const char* kTaskKinds[] = {"startup", "behavior", "command", "handler"};
constexpr const char* kWaits[] = {"nothing", "the next tick", "a time", "a joint"};

/// Goes down to where two values differ; `path` leads there.
std::optional<FieldDifference> Differ(const Json& a, const Json& b, const std::string& path) {
  if (a == b) return std::nullopt;
  if (a.is_object() && b.is_object()) {
    for (const auto& [key, value] : a.items()) {
      const std::string at = path.empty() ? key : path + "." + key;
      if (!b.contains(key)) return FieldDifference{at, JsonText(value), "nothing"};
      if (auto found = Differ(value, b.at(key), at)) return found;
    }
  }
  if (a.is_array() && b.is_array()) {
    for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
      if (auto found = Differ(a[i], b[i], fmt::format("{}[{}]", path, i))) return found;
    }
    return FieldDifference{path, Counted(static_cast<int64_t>(a.size()), "entry", "entries"),
                           Counted(static_cast<int64_t>(b.size()), "entry", "entries")};
  }
  return FieldDifference{path.empty() ? "message" : path, a.is_null() ? "nothing" : JsonText(a),
                         b.is_null() ? "nothing" : JsonText(b)};
}

/// A call with the line at which it stands and the values of its locals, in their order: arguments
/// first.
Json CallJson(const logger::ComputedTick& tick, const vm::Frame& frame, const vm::Cell* cells) {
  const vm::FunctionInfo function = tick.program.function(frame.function);
  Json locals = Json::array();
  for (int i = 0; i < function.num_locals; ++i) {
    locals.push_back(vm::ValueText(tick.program, &tick.kinematics, function.local_types[i],
                                   cells[frame.base + i]));
  }
  return {{"function", ToString(tick.program.function_name(frame.function))},
          {"line", tick.program.LineOf(frame.function, frame.pc)},
          {"locals", locals}};
}

/// A task with its calls, the innermost first.
Json TaskJson(const logger::ComputedTick& tick, const vm::Task& task) {
  Json calls = Json::array();
  for (int f = task.stack.depth - 1; f >= 0; --f) {
    calls.push_back(CallJson(tick, task.stack.frames[f], task.stack.cells));
  }
  Json json = {{"kind", TaskKindName(task.kind)},
               {"waits_for", kWaits[static_cast<int>(task.wait)]}};
  if (task.wait == vm::WaitKind::kSleep) json["until"] = static_cast<double>(task.wake_us) * 1e-6;
  if (task.wait == vm::WaitKind::kMotion) {
    json["joint"] = ToString(tick.kinematics.joint(task.wait_joint).name);
  }
  json["calls"] = calls;
  return json;
}

/// The joints: where they are, where they are to go, and the signs of conventions.
Json JointsJson(const logger::ComputedTick& tick) {
  Json joints = Json::object();
  for (int j = 0; j < tick.kinematics.num_joints(); ++j) {
    const vm::JointState& joint = tick.state.joints[j];
    const bool slides = tick.kinematics.joint(j).kind == vm::JointKind::kPrismatic;
    joints[ToString(tick.kinematics.joint(j).name)] = {{"unit", slides ? "mm" : "degrees"},
                                                       {"measured", joint.measured},
                                                       {"target", joint.target},
                                                       {"turning", joint.turning},
                                                       {"arrived", joint.arrived},
                                                       {"stalled", joint.stalled},
                                                       {"sign", joint.sign}};
  }
  return joints;
}

}  // namespace

const char* TaskKindName(vm::TaskKind kind) { return kTaskKinds[static_cast<int>(kind)]; }

std::string WaitText(const vm::Task& task, const vm::VerifiedKinematics& kinematics) {
  if (task.wait == vm::WaitKind::kSleep) {
    return fmt::format("{:.2f} s", static_cast<double>(task.wake_us) * 1e-6);
  }
  if (task.wait == vm::WaitKind::kMotion) {
    return "joint " + ToString(kinematics.joint(task.wait_joint).name);
  }
  return kWaits[static_cast<int>(task.wait)];
}

std::optional<FieldDifference> FirstDifference(const Json& logged, const Json& again) {
  return Differ(logged, again, "");
}

Json RerunDifferences::Decoded(std::span<const uint8_t> bytes) const {
  if (bytes.empty()) return nullptr;
  const Result<Json> decoded = schema_.Decode(bytes.data(), bytes.size());
  if (!decoded) return nullptr;
  Json message = *decoded;
  // The checksum differs wherever anything does.
  if (message.contains("header")) message["header"].erase("crc32");
  return message;
}

void RerunDifferences::Take(const logger::MessageAgain& message) {
  if (std::ranges::equal(message.logged, message.again)) return;
  if (count_++ > 0) return;
  const auto difference = FirstDifference(Decoded(message.logged), Decoded(message.again));
  first_ = {{"tick", message.tick},
            {"seconds", static_cast<double>(message.sim_time_us) * 1e-6},
            {"topic", bridge::TopicName(message.topic)},
            {"field", difference ? difference->field : "checksum"},
            {"logged", difference ? difference->logged : ""},
            {"again", difference ? difference->again : ""}};
}

Json KnownAfter(const logger::ComputedTick& tick) {
  const vm::RoleState& role = tick.state.role;
  Json known = {{"tick", tick.input.tick},
                {"seconds", static_cast<double>(tick.input.sim_time_us) * 1e-6},
                {"role", nullptr},
                {"has_pose", tick.output.status.has_pose},
                {"pose_stale", tick.output.status.pose_stale}};
  Json labels = Json::object(), fields = Json::object(), tasks = Json::array();
  if (role.role >= 0) {
    const vm::RoleInfo info = tick.program.role(role.role);
    known["role"] = ToString(info.name);
    for (int l = 0; l < info.num_labels; ++l) {
      const bool is_joint =
          tick.program.function(info.labels[l]).return_type == vm::ValueType::kJoint;
      const int at = role.labels[l];
      const std::string name = ToString(tick.program.member_name(info.labels[l]));
      if (at < 0) {
        labels[name] = nullptr;
      } else {
        labels[name] =
            ToString(is_joint ? tick.kinematics.joint(at).name : tick.kinematics.link(at).name);
      }
    }
    for (int f = 0; f < info.num_fields; ++f) {
      fields[ToString(tick.program.field_name(role.role, f))] =
          vm::ValueText(tick.program, &tick.kinematics, info.fields.type(f), role.fields[f]);
    }
  }
  for (const vm::Task& task : tick.state.scheduler.tasks) {
    if (task.used) tasks.push_back(TaskJson(tick, task));
  }
  known["labels"] = labels;
  known["fields"] = fields;
  known["joints"] = JointsJson(tick);
  known["tasks"] = tasks;
  return known;
}

std::string KnownText(const Json& known) {
  std::string text =
      fmt::format("tick {} ({:.2f} s): role {}, pose {}\n", known["tick"].get<int64_t>(),
                  known["seconds"].get<double>(),
                  known["role"].is_null() ? "none" : known["role"].get<std::string>(),
                  !known["has_pose"].get<bool>()    ? "unknown"
                  : known["pose_stale"].get<bool>() ? "stale"
                                                    : "known");
  for (const auto& [name, part] : known["labels"].items()) {
    text += fmt::format("  label {} = {}\n", name,
                        part.is_null() ? "(not resolved)" : part.get<std::string>());
  }
  for (const auto& [name, value] : known["fields"].items()) {
    text += fmt::format("  field {} = {}\n", name, value.get<std::string>());
  }
  for (const auto& [name, joint] : known["joints"].items()) {
    const int sign = joint["sign"].get<int>();
    text += fmt::format("  joint {}: at {:.2f}, target {:.2f} {}{}{}{}\n", name,
                        joint["measured"].get<double>(), joint["target"].get<double>(),
                        joint["unit"].get<std::string>(),
                        sign == 0  ? ""
                        : sign > 0 ? ", sign +"
                                   : ", sign -",
                        joint["turning"].get<bool>()   ? ", turning"
                        : joint["arrived"].get<bool>() ? ""
                                                       : ", on its way",
                        joint["stalled"].get<bool>() ? ", stalled" : "");
  }
  for (const Json& task : known["tasks"]) {
    std::string waits = task["waits_for"].get<std::string>();
    if (task.contains("until")) waits = fmt::format("{:.2f} s", task["until"].get<double>());
    if (task.contains("joint")) waits = "joint " + task["joint"].get<std::string>();
    text += fmt::format("  {} waits for {}\n", task["kind"].get<std::string>(), waits);
    for (const Json& call : task["calls"]) {
      std::string locals;
      for (const Json& local : call["locals"]) {
        locals += (locals.empty() ? "" : ", ") + local.get<std::string>();
      }
      text += fmt::format("    in {}, line {}{}\n", call["function"].get<std::string>(),
                          call["line"].get<int>(), locals.empty() ? "" : ", locals " + locals);
    }
  }
  return text;
}

}  // namespace morphbus::tools
