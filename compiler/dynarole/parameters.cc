#include "compiler/dynarole/parameters.h"

#include <fmt/format.h>

#include <optional>

#include "compiler/base/quantity.h"
#include "compiler/source/diagnostics.h"
#include "vm/image/image.h"
#include "vm/image/image_texts.h"

namespace morphbus::dynarole {

namespace {

/// A cell of a number's type.
double NumberIn(vm::ValueType type, vm::Cell cell) {
  return type == vm::ValueType::kInt ? cell.AsInt() : static_cast<double>(cell.AsFloat());
}

/// The name without the role's.
std::string_view MemberName(std::string_view name) { return name.substr(name.rfind('.') + 1); }

/// Index of the parameter that is called so; the error suggests another name.
Result<size_t> FindParameter(const std::vector<ProgramParameter>& parameters,
                             std::string_view name) {
  if (parameters.empty()) {
    return Fail(fmt::format(
        "there is no parameter '{}': the program has none (param {} = 30.0 in [10, 60];), or its "
        "image has no names for them (compile --strip)",
        name, MemberName(name)));
  }
  // A name that fits one parameter only may stand without its role.
  std::vector<std::string> names, likely;
  std::optional<size_t> without_role;
  int fitting = 0;
  for (size_t i = 0; i < parameters.size(); ++i) {
    if (parameters[i].name == name) return i;
    names.push_back(parameters[i].name);
    likely.push_back(parameters[i].name);
    likely.emplace_back(MemberName(parameters[i].name));
    if (MemberName(parameters[i].name) != name) continue;
    without_role = i;
    ++fitting;
  }
  if (fitting == 1) return *without_role;
  if (fitting > 1) {
    return Fail(fmt::format("several roles have a parameter '{}': write {}", name,
                            parameters[*without_role].name));
  }
  return Fail(fmt::format("the program has no parameter '{}': {}", name,
                          source::NearestHint(std::string(name), likely,
                                              "it has " + fmt::to_string(fmt::join(names, ", ")))));
}

/// Puts a value of a parameter into an image of its program, behind the type of its constant, and
/// the hash that follows from it.
void PutValue(const vm::ParameterInfo& parameter, vm::Cell value, std::string* image) {
  auto* bytes = reinterpret_cast<uint8_t*>(image->data());
  const auto put = [bytes](uint32_t at, uint64_t bits, uint32_t size) {
    for (uint32_t i = 0; i < size; ++i) bytes[at + i] = static_cast<uint8_t>(bits >> (8 * i));
  };
  const uint32_t constants = vm::image::SectionOf(bytes, vm::image::Section::kConstants).begin;
  put(constants + static_cast<uint32_t>(parameter.constant) * vm::image::kConstantBytes + 1,
      value.bits, 4);
  const uint32_t run_size = vm::image::ReadU32(bytes + vm::image::kSizeAt);
  put(vm::image::kHashAt, vm::image::HashOf(bytes, run_size), 8);
}

/// The cell of a value that is written so; nothing for what is no number of the type.
std::optional<vm::Cell> ReadCell(std::string_view text, bool is_int) {
  if (is_int) {
    const std::optional<int32_t> number = ReadNumber<int32_t>(text);
    return number ? std::optional(vm::Cell::Int(*number)) : std::nullopt;
  }
  const std::optional<double> number = ReadPlainNumber(text);
  if (!number) return std::nullopt;
  return vm::Cell::Float(static_cast<float>(*number));
}

}  // namespace

std::string ProgramParameter::Text(double number) const {
  // Shortest as the single that it is: as a double 0.1f has seventeen digits.
  return is_int ? fmt::format("{}", static_cast<int32_t>(number))
                : fmt::format("{}", static_cast<float>(number));
}

std::vector<ProgramParameter> ParametersOf(const vm::VerifiedProgram& program) {
  std::vector<ProgramParameter> parameters;
  for (int i = 0; i < program.num_parameters(); ++i) {
    const vm::ParameterInfo info = program.parameter(i);
    parameters.push_back({.name = vm::ToString(info.name),
                          .is_int = info.type == vm::ValueType::kInt,
                          .value = NumberIn(info.type, info.value),
                          .source_value = NumberIn(info.type, info.source_value),
                          .least = NumberIn(info.type, info.least),
                          .most = NumberIn(info.type, info.most)});
  }
  return parameters;
}

std::string ParametersText(const std::vector<ProgramParameter>& parameters) {
  std::string text;
  for (const ProgramParameter& p : parameters) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", p.name, p.Text(p.value));
    if (p.value != p.source_value)
      text += fmt::format(" ({} in the source)", p.Text(p.source_value));
  }
  return text;
}

Result<std::string> WithParameter(const vm::VerifiedProgram& program, std::string_view name,
                                  std::string_view value) {
  const std::vector<ProgramParameter> parameters = ParametersOf(program);
  const Result<size_t> index = FindParameter(parameters, name);
  if (!index) return Fail(index.error().message);
  const ProgramParameter& parameter = parameters[*index];
  const std::optional<vm::Cell> cell = ReadCell(value, parameter.is_int);
  const std::string range =
      fmt::format("{} to {}", parameter.Text(parameter.least), parameter.Text(parameter.most));
  if (!cell) {
    return Fail(fmt::format("parameter {}: expected {}, {}, not '{}'", parameter.name,
                            parameter.is_int ? "an int" : "a number", range, value));
  }
  const vm::ParameterInfo info = program.parameter(static_cast<int>(*index));
  const double number = NumberIn(info.type, *cell);
  if (!(number >= parameter.least && number <= parameter.most)) {
    return Fail(
        fmt::format("parameter {}: {} is out of its range, {}", parameter.name, value, range));
  }
  std::string image(reinterpret_cast<const char*>(program.bytes()), program.size());
  PutValue(info, *cell, &image);
  return image;
}

uint64_t HashOfSource(const vm::VerifiedProgram& program) {
  std::string image(reinterpret_cast<const char*>(program.bytes()), program.size());
  for (int i = 0; i < program.num_parameters(); ++i) {
    const vm::ParameterInfo parameter = program.parameter(i);
    PutValue(parameter, parameter.source_value, &image);
  }
  return vm::image::ReadU64(reinterpret_cast<const uint8_t*>(image.data()) + vm::image::kHashAt);
}

}  // namespace morphbus::dynarole
