#include "tools/convert/rerun_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/module/read_held.h"
#include "bridge/wire/stream_hash.h"
#include "tools/base/held_report.h"
#include "tools/base/program.h"

namespace morphbus::tools {
namespace {

/// Goes down to where two values differ; `path` leads there.
std::optional<FieldDifference> Differ(const Json& a, const Json& b, const std::string& path) {
  if (a == b) return std::nullopt;
  // Of two objects the first field that differs, in the order of their names.
  if (a.is_object() && b.is_object()) {
    // Both are of one type of message and have the same members; one that only b has is told as a
    // whole, below.
    for (const auto& [key, value] : a.items()) {
      const std::string at = path.empty() ? key : path + "." + key;
      if (!b.contains(key)) return FieldDifference{at, JsonText(value), "nothing"};
      if (auto found = Differ(value, b.at(key), at)) return found;
    }
  }
  // Of two lists the first entry that differs, and their lengths if one is the beginning of the
  // other.
  if (a.is_array() && b.is_array()) {
    for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
      if (auto found = Differ(a[i], b[i], fmt::format("{}[{}]", path, i))) return found;
    }
    // As the lists are not equal and no common entry differs, their lengths do.
    return FieldDifference{path, Counted(static_cast<int64_t>(a.size()), "entry", "entries"),
                           Counted(static_cast<int64_t>(b.size()), "entry", "entries")};
  }
  return FieldDifference{path.empty() ? "message" : path, a.is_null() ? "nothing" : JsonText(a),
                         b.is_null() ? "nothing" : JsonText(b)};
}

/// The joints: where they are, where they are to go, and the signs of conventions.
Json JointsJson(const logger::ComputedTick& tick) {
  Json joints = Json::object();
  for (int j = 0; j < tick.kinematics.num_joints(); ++j) {
    const vm::JointState& joint = tick.state.joints[j];
    const bool slides = tick.kinematics.joint(j).kind == vm::JointKind::kPrismatic;
    // The VM counts in degrees and millimetres, as programs do; they are shown as they are.
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

std::optional<FieldDifference> FirstDifference(const Json& logged, const Json& again) {
  return Differ(logged, again, "");
}

Json RerunDifferences::Decoded(std::span<const uint8_t> bytes) const {
  if (bytes.empty()) return nullptr;
  const Result<Json> decoded = schema_.Decode(bytes.data(), bytes.size());
  if (!decoded) return nullptr;
  Json message = *decoded;
  // The checksum differs wherever anything does, and auth in every run.
  if (message.contains("header")) {
    message["header"].erase("crc32");
    message["header"].erase("auth");
  }
  return message;
}

void RerunDifferences::Take(const logger::MessageAgain& message) {
  const auto digest = [](std::span<const uint8_t> bytes) {
    return bridge::MessageDigest(bytes.data(), bytes.size());
  };
  // The digests leave out what differs in every run, such as the key's hash; an absent message has
  // that of no bytes.
  if (digest(message.logged) == digest(message.again)) return;
  if (count_++ > 0) return;
  const auto difference = FirstDifference(Decoded(message.logged), Decoded(message.again));
  first_ = {{"tick", message.tick},
            {"seconds", static_cast<double>(message.sim_time_us) * 1e-6},
            {"topic", bridge::TopicName(message.topic)},
            // Digests that differ where all members are equal leave only the checksum.
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
  // Labels stand for joints or links of the module, by name; for none where they are not resolved.
  Json labels = Json::object();
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
  }
  // Fields and tasks are read as inspections of a running robot read them.
  const bridge::HeldState held = bridge::ReadHeld(tick.program, tick.kinematics, tick.state);
  known["labels"] = labels;
  known["program"] = ToString(tick.program.source_name());
  known["fields"] = FieldsJson(held.fields);
  known["joints"] = JointsJson(tick);
  known["tasks"] =
      TasksJson(held.tasks, vm::SourceFiles(tick.program), ConnectorNames(tick.kinematics));
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
  // Labels, fields, joints and tasks, a line each.
  for (const auto& [name, part] : known["labels"].items()) {
    text += fmt::format("  label {} = {}\n", name,
                        part.is_null() ? "(not resolved)" : part.get<std::string>());
  }
  text += FieldsText(known["fields"]);
  for (const auto& [name, joint] : known["joints"].items()) {
    // A sign of 0 says that no convention was set; a joint that has arrived and stands has no
    // remark.
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
  text += TasksText(known["tasks"]);
  return text;
}

}  // namespace morphbus::tools
