#include "tools/control/program_call.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>

#include "compiler/base/quantity.h"
#include "tools/base/messages.h"
#include "tools/base/program.h"

namespace morphbus::tools {
namespace {

/// The degrees of "30deg" or "0.5rad"; nothing for another text, and for more than can be meant.
std::optional<float> DegreesOf(const std::string& word) {
  constexpr double kMost = 1e6;
  const std::optional<double> angle = ReadRadians(word);
  if (!angle || !(std::abs(*angle) <= kMost)) return std::nullopt;
  return static_cast<float>(*angle * 180 / std::numbers::pi);
}

/// The place of "$NORTH", or "north", which needs no quotes in a shell; of a diagonal "$NORTH +
/// $UP".
std::optional<vm::Cell> NamedCell(const std::string& word, std::span<const vm::DirectionRow> rows) {
  std::string upper = word;
  for (char& c : upper) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  for (size_t i = 0; i < rows.size(); ++i) {
    const std::string name = rows[i].name;
    if (upper == name || "$" + upper == name) return vm::Cell::Int(static_cast<int32_t>(i));
  }
  return std::nullopt;
}

/// The role of that name, with or without $.
std::optional<int> RoleIndex(const vm::VerifiedProgram& program, const std::string& name) {
  // Names of roles have no $, which programs put before them.
  for (int r = 0; r < program.num_roles(); ++r) {
    const std::string role = ToString(program.role(r).name);
    if (name == role || name == "$" + role) return r;
  }
  return std::nullopt;
}

/// A word as a value of a type that travels; nothing if it is none.
std::optional<vm::Cell> ArgumentCell(const vm::VerifiedProgram& program, vm::ValueType type,
                                     const std::string& word) {
  // The words are those that programs use.
  switch (type) {
    case vm::ValueType::kBool:
      if (word != "true" && word != "false") return std::nullopt;
      return vm::Cell::Bool(word == "true");
    case vm::ValueType::kInt: {
      const auto number = ReadNumber<int32_t>(word);
      return number ? std::optional(vm::Cell::Int(*number)) : std::nullopt;
    }
    case vm::ValueType::kFloat: {
      auto number = ReadNumber<float>(word);
      // Of an angle with its unit programs know the degrees.
      if (word.ends_with("deg") || word.ends_with("rad")) number = DegreesOf(word);
      return number ? std::optional(vm::Cell::Float(*number)) : std::nullopt;
    }
    // Directions and axes travel as their places in the tables that compiler and VM share.
    case vm::ValueType::kDirection:
      return NamedCell(word, vm::kDirectionRows);
    case vm::ValueType::kAxis:
      return NamedCell(word, vm::kAxisRows);
    case vm::ValueType::kRole: {
      const std::optional<int> role = RoleIndex(program, word);
      return role ? std::optional(vm::Cell::Int(*role)) : std::nullopt;
    }
    default:
      return std::nullopt;
  }
}

}  // namespace

Result<vm::InvokeRequest> ResolveCall(const vm::VerifiedProgram& program,
                                      const bridge::ControlCommand& command) {
  // A module that runs another program by then refuses it.
  vm::InvokeRequest request;
  request.program_hash = program.hash();
  const std::optional<int> role = RoleIndex(program, command.role);
  // Abstract roles count, too: whoever plays one that extends them runs the command.
  if (!role) {
    std::vector<std::string> names;
    for (int r = 0; r < program.num_roles(); ++r) names.push_back(ToString(program.role(r).name));
    return Fail(fmt::format("the program has no role '{}'{}", command.role,
                            DidYouMean(command.role, names)));
  }
  request.role = static_cast<uint16_t>(*role);
  // Commands of the role and of those that it extends; the slot is the same in all of them.
  const vm::RoleInfo info = program.role(*role);
  std::vector<std::string> names;
  for (int c = 0; c < info.num_commands; ++c)
    names.push_back(ToString(program.member_name(info.commands[c])));
  const auto found = std::find(names.begin(), names.end(), command.routine);
  if (found == names.end()) {
    const std::string suggestion = DidYouMean(command.routine, names);
    const std::string all = names.empty() ? "; it has none" : "; it has " + NameSome(names);
    return Fail(fmt::format("role {} has no command '{}'{}", command.role, command.routine,
                            suggestion.empty() ? all : suggestion));
  }
  request.command = static_cast<uint8_t>(found - names.begin());
  // Each argument must be a value of the type that the program declares.
  const vm::FunctionInfo function = program.function(info.commands[request.command]);
  if (command.arguments.size() != function.num_arguments) {
    return Fail(fmt::format("{}.{} takes {} arguments, not {}", command.role, command.routine,
                            function.num_arguments, command.arguments.size()));
  }
  for (const std::string& word : command.arguments) {
    const vm::ValueType type = function.local_types[request.num_arguments];
    const std::optional<vm::Cell> cell = ArgumentCell(program, type, word);
    if (!cell) {
      return Fail(fmt::format("argument {} of {}.{}: expected {}, not '{}'",
                              request.num_arguments + 1, command.role, command.routine,
                              vm::InfoOf(type).phrase, word));
    }
    request.arguments[request.num_arguments++] = *cell;
  }
  return request;
}

}  // namespace morphbus::tools
