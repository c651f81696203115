#include "tools/spy/message_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <map>
#include <morphbus/label_t.hpp>

#include "compiler/base/text.h"
#include "vm/image/fault_text.h"

namespace morphbus::tools {
namespace {

/// True for the types of `lcmtypes/`: those of others mean what we do not know.
bool IsOurs(const LcmType& type) { return type.name.starts_with("morphbus."); }

/// Of a member that is a hash, or a sum that is none but as unreadable: how many digits it has; 0
/// for all others.
int HashDigits(const LcmType& type, const LcmMember& member) {
  if (!IsOurs(type) || !member.dimensions.empty()) return 0;
  if (member.type == "int32_t") return member.name == "crc32" ? 8 : 0;
  if (member.type != "int64_t") return 0;
  return member.name.ends_with("hash") || member.name == "auth" ? 16 : 0;
}

/// The member at the place of a value in a decoded struct; null for what was added to it since.
const LcmMember* MemberAt(const LcmType* type, size_t i, const std::string& name) {
  if (type == nullptr || i >= type->members.size()) return nullptr;
  return type->members[i].name == name ? &type->members[i] : nullptr;
}

/// What follows the member's name in the name of the constant that has this value; empty if none
/// has: HOLD for MODE_HOLD.
std::string ConstantName(const LcmType& type, const std::string& member, int64_t value) {
  std::string prefix = member + "_";
  for (char& c : prefix) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  const auto begin = type.constants.lower_bound(prefix);
  for (auto it = begin; it != type.constants.end() && it->first.starts_with(prefix); ++it) {
    // As C writes numbers, in which 0x10 is one; a constant that is a float is the value of none.
    char* end = nullptr;
    const int64_t constant = std::strtoll(it->second.c_str(), &end, 0);
    if (*end == '\0' && constant == value) return it->first.substr(prefix.size());
  }
  return "";
}

/// What a number of one of our messages stands for.
enum class Stands : uint8_t {
  kModule,
  kLink,
  kJoint,
  kConnector,
  kMateConnector,
  kConnection,
  kRole,
  kTaskKind,
};

/// By the member's name, which means the same in all of our types (lcmtypes/README.md).
const std::map<std::string_view, Stands> kStands = {
    {"module_id", Stands::kModule},
    {"mate_module", Stands::kModule},
    {"origin_module", Stands::kModule},
    {"target_module", Stands::kModule},
    {"root_module", Stands::kModule},
    {"inspected", Stands::kModule},
    {"link", Stands::kLink},
    {"body_link", Stands::kLink},
    {"joint", Stands::kJoint},
    {"connector", Stands::kConnector},
    {"mate_connector", Stands::kMateConnector},
    {"connection_type", Stands::kConnection},
    {"role", Stands::kRole},
    {"rival_role", Stands::kRole},
    {"ended_task", Stands::kTaskKind},
};

/// Walks one message.
class FieldWalk {
 public:
  explicit FieldWalk(const FieldWords& words) : words_(words) {}

  MessageFields Walk(const Json& message) {
    // Hashes are texts by now, which the names of roles need as a number.
    if (const auto header = message.find("header");
        header != message.end() && header->is_object()) {
      const auto hash = header->find("program_hash");
      const std::string digits = hash != header->end() && hash->is_string() ? *hash : Json("");
      uint64_t bits = 0;
      std::from_chars(digits.data(), digits.data() + digits.size(), bits, 16);
      program_hash_ = static_cast<int64_t>(bits);
    }
    const int module = words_.names.NumberOf(words_.process);
    Value({nullptr, nullptr, nullptr, module, module}, words_.type, message, "", 0);
    // Every message of ours begins with the same header, which nobody opens a channel for.
    std::vector<MessageField>& fields = out_.fields;
    const bool ours = words_.type == nullptr || IsOurs(*words_.type);
    if (ours && std::ranges::find(fields, "header.crc32", &MessageField::path) != fields.end()) {
      std::stable_partition(fields.begin(), fields.end(), [](const MessageField& field) {
        return !field.path.starts_with("header.");
      });
    }
    return std::move(out_);
  }

 private:
  /// Where a value stands.
  struct Place {
    const LcmType* type = nullptr;      ///< The struct that has it; null: not known.
    const LcmMember* member = nullptr;  ///< The member that it is, or an element of.
    const Json* object = nullptr;       ///< The struct's values.
    int module = -1;                    ///< The module that the struct speaks of,
    int speaker = -1;                   ///< and the one that the message does.
  };

  /// A value with all that is in it. `type` is that of an object, `dimension` how many arrays of
  /// its member it stands in.
  void Value(const Place& place, const LcmType* type, const Json& value, const std::string& path,
             size_t dimension) {
    if (value.is_object()) return Members(place, type, value, path);
    // An array of nothing is a field all the same.
    if (value.is_array() && !value.empty()) {
      for (size_t i = 0; i < value.size(); ++i) {
        const std::string name = dimension == 0 ? ElementName(place, value[i], i) : "";
        Value(place, type, value[i],
              fmt::format("{}[{}]", path, name.empty() ? fmt::to_string(i) : name), dimension + 1);
      }
      return;
    }
    // A message of a million numbers is not shown whole.
    if (out_.fields.size() >= MessageFields::kMost) {
      ++out_.more;
      return;
    }
    out_.fields.push_back({path, Text(place, value), NumberOf(value)});
  }

  void Members(const Place& place, const LcmType* type, const Json& object,
               const std::string& path) {
    Place inner = {type, nullptr, &object, place.module, place.speaker};
    // A struct that names a module speaks of that one from there on.
    if (const int named = IndexIn(object, "module_id"); !words_.names.Module(named).empty()) {
      inner.module = named;
    }
    size_t i = 0;
    for (const auto& [name, value] : object.items()) {
      inner.member = MemberAt(type, i++, name);
      const LcmType* nested = inner.member == nullptr || words_.schema == nullptr
                                  ? nullptr
                                  : words_.schema->FindByName(inner.member->type);
      Value(inner, nested, value, path.empty() ? name : path + "." + name, 0);
    }
  }

  /// An index among the members; -1 without it.
  static int IndexIn(const Json& object, const char* name) {
    const auto found = object.find(name);
    if (found == object.end() || !found->is_number_integer()) return -1;
    const auto number = found->get<int64_t>();
    return number < 0 || number > INT16_MAX ? -1 : static_cast<int>(number);
  }

  /// The name of element `i` of an array in one of our messages; empty if it has none. No two
  /// elements of an array may have the same.
  [[nodiscard]] std::string ElementName(const Place& place, const Json& element, size_t i) const {
    if (place.member == nullptr || !IsOurs(*place.type) || place.member->dimensions.empty()) {
      return "";
    }
    // What an array is counted by tells what its elements are of.
    const std::string& count = place.member->dimensions.front().size;
    const int index = static_cast<int>(i);
    const RunNames& names = words_.names;
    if (count == "num_joints") return names.Joint(place.module, index);
    if (count == "num_links") return names.Link(place.module, index);
    if (count == "num_sensor_values") return names.SensorValue(place.module, index);
    if (!element.is_object()) return "";
    if (count == "num_docked") return names.Connector(place.module, IndexIn(element, "connector"));
    const int module = IndexIn(element, "module_id");
    if (count == "num_modules") return names.Module(module);
    if (count == "num_bodies" || count == "num_contacts") {
      const std::string link = names.Link(module, IndexIn(element, "link"));
      return link.empty() ? "" : names.Module(module) + "." + link;
    }
    return "";
  }

  /// A value that holds no others, as text.
  [[nodiscard]] std::string Text(const Place& place, const Json& value) const {
    if (place.member != nullptr) {
      // A hash has no quotation marks, as it is no text of the message.
      if (HashDigits(*place.type, *place.member) > 0 && value.is_string()) return value;
      if (value.is_number_integer()) {
        const std::string word = Word(place, value.get<int64_t>());
        if (!word.empty()) return word;
      }
    }
    return value.is_array()          ? "[]"
           : value.is_number_float() ? fmt::format("{:.6g}", value.get<double>())
                                     : JsonText(value);
  }

  /// What a whole number stands for; empty if it is but a number.
  [[nodiscard]] std::string Word(const Place& place, int64_t value) const {
    const LcmType& type = *place.type;
    const std::string& member = place.member->name;
    std::string constant = ConstantName(type, member, value);
    if (!constant.empty() || !IsOurs(type) || value < 0 || value > INT16_MAX) return constant;
    const int number = static_cast<int>(value);
    const RunNames& names = words_.names;
    // A few names mean what their own struct says.
    if (type.name == "morphbus.label_t" && member == "index") {
      return IndexIn(*place.object, "kind") == morphbus::label_t::KIND_JOINT
                 ? names.Joint(place.module, number)
                 : names.Link(place.module, number);
    }
    if (type.name == "morphbus.connector_command_t" && member == "state") {
      return names.State(place.module, IndexIn(*place.object, "connector"), number);
    }
    if (type.name == "morphbus.connector_command_t" && member == "value") {
      return names.StateValue(place.module, IndexIn(*place.object, "connector"),
                              IndexIn(*place.object, "state"), number);
    }
    const bool task = type.name == "morphbus.task_t" || type.name == "morphbus.held_task_t";
    const auto found = kStands.find(member);
    if (found == kStands.end()) return task && member == "kind" ? TaskKind(number) : "";
    switch (found->second) {
      case Stands::kModule:
        return names.Module(number);
      case Stands::kLink:
        // A body entry tells of a joint of any module and of a link of the one that speaks.
        return names.Link(type.name == "morphbus.body_entry_t" ? place.speaker : place.module,
                          number);
      case Stands::kJoint:
        return names.Joint(place.module, number);
      case Stands::kConnector:
        return names.Connector(place.module, number);
      case Stands::kMateConnector:
        return names.Connector(IndexIn(*place.object, "mate_module"), number);
      case Stands::kConnection:
        return names.Connection(number);
      case Stands::kRole:
        return names.Role(program_hash_, number);
      case Stands::kTaskKind:
        return TaskKind(number);
    }
    return "";
  }

  static std::string TaskKind(int kind) {
    return vm::TaskKindName(static_cast<vm::TaskKind>(kind));
  }

  /// The value as a number for its history; not a number if it is none now.
  static double NumberOf(const Json& value) {
    if (value.is_boolean()) return value.get<bool>() ? 1.0 : 0.0;
    if (!value.is_number()) return std::numeric_limits<double>::quiet_NaN();
    return value.get<double>();
  }

  const FieldWords& words_;
  MessageFields out_;
  int64_t program_hash_ = 0;  ///< Of the program that the sender runs.
};

}  // namespace

MessageFields FieldsOf(const Json& message, const FieldWords& words) {
  return FieldWalk(words).Walk(message);
}

void WriteHashes(const LcmSchema& schema, const LcmType& type, Json* message) {
  size_t i = 0;
  for (auto& [name, value] : message->items()) {
    const LcmMember* member = MemberAt(&type, i++, name);
    if (member == nullptr) continue;
    if (const int digits = HashDigits(type, *member); digits > 0) {
      const auto bits = static_cast<uint64_t>(value.get<int64_t>());
      value = Hex(digits == 8 ? bits & UINT32_MAX : bits, digits);
    }
    const LcmType* nested = schema.FindByName(member->type);
    if (nested == nullptr) continue;
    // Structs of ours are in arrays of one dimension or alone.
    if (value.is_object()) WriteHashes(schema, *nested, &value);
    if (!value.is_array()) continue;
    for (Json& element : value) {
      if (element.is_object()) WriteHashes(schema, *nested, &element);
    }
  }
}

}  // namespace morphbus::tools
