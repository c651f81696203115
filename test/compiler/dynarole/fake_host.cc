#include "test/compiler/dynarole/fake_host.h"

#include <fmt/format.h>

#include <bit>
#include <string>
#include <string_view>

#include "vm/image/fault_text.h"
#include "vm/image/print_line.h"

namespace morphbus::dynarole {

using vm::Axis;
using vm::Cell;
using vm::Direction;
using vm::OpResult;

keywords::KeywordTable TestKeywords() {
  keywords::ModuleKeywords mtran{"MTRAN", {}, {}, {}};
  mtran.links = {{"active_block", "LINK_ACTIVE_BLOCK"},
                 {"passive_block", "LINK_PASSIVE_BLOCK"},
                 {"connecting_bar", "LINK_CONNECTING_BAR"}};
  mtran.joints = {{"joint_1", "JOINT_1"}, {"joint_2", "JOINT_2"}};
  for (const char* number : {"1", "2", "3", "4", "5", "6"}) {
    mtran.connectors.push_back({std::string("c") + number, std::string("C") + number, {}});
  }
  mtran.connectors[0].states = {{"extended", "EXTENDED", {false, true}}};
  keywords::ModuleKeywords slider{"SLIDER", {}, {}, {}};
  slider.links = {{"rail", "LINK_RAIL"}};
  slider.joints = {{"joint_1", "JOINT_1", model::JointType::kPrismatic},
                   {"lift", "LIFT", model::JointType::kPrismatic},
                   {"turntable", "TURNTABLE", model::JointType::kContinuous}};
  slider.connectors = {{"c1", "C1", {{"gear", "GEAR", {1.0, 2.0}}}}};
  // Sensors are named only in the program that is about them.
  keywords::ModuleKeywords finder{"FINDER", {}, {}, {}};
  finder.joints = {{"joint_1", "JOINT_1"}};
  finder.sensors = {{"ir", "IR", model::SensorType::kDistance},
                    {"skin", "SKIN", model::SensorType::kContact},
                    {"level", "LEVEL", model::SensorType::kTilt}};
  return *keywords::KeywordTable::Of({mtran, slider, finder});
}

OpResult FakeHost::Note(const std::string& line, bool wait) {
  log.push_back(line);
  OpResult result = next_result;
  next_result = {};
  result.wait = wait && result.fault == vm::FaultCode::kNone;
  return result;
}

uint32_t FakeHost::Connected(Direction d) {
  switch (d) {
    case Direction::kAny:
      return 0b111;
    case Direction::kNorth:
      return 0b001;
    case Direction::kSouth:
      return 0b110;
    case Direction::kEast:
      return 0b100;
    default:
      return 0;
  }
}

uint32_t FakeHost::ConnectedRole(Direction d, int role) {
  const vm::Text name = program_.role(role).name;
  const std::string_view text(name.data, name.size);
  return text == "Many" ? Connected(d) : text == "Other" ? Connected(d) & 1u : 0;
}

int FakeHost::CountModules(uint32_t connector_mask) { return std::popcount(connector_mask); }

uint32_t FakeHost::Joints(Axis axis, int adjacent) {
  uint32_t mask = adjacent == 1 ? 1u : adjacent == 2 ? 2u : 0u;
  if (axis == Axis::kEastWest) mask &= 1u;
  if (axis == Axis::kUpDown) mask &= 2u;
  if (axis == Axis::kNorthSouth) mask = 0;
  return mask;
}

uint32_t FakeHost::Links(int degree) { return degree == 1 ? 1u : degree == 2 ? 6u : 0u; }

Axis FakeHost::JointAxis(int joint) { return joint == 0 ? Axis::kEastWest : Axis::kUpDown; }

Axis FakeHost::CenterAxis() { return Axis::kEastWest; }

int FakeHost::Keyword(int keyword) {
  const vm::Text name = program_.keyword(keyword).name;
  const std::string text(name.data, name.size);
  if (text == "ACTIVE_BLOCK" || text == "JOINT_1" || text == "C1") return 0;
  if (text == "PASSIVE_BLOCK" || text == "JOINT_2" || text == "C2") return 1;
  if (text == "CONNECTING_BAR" || text == "C3") return 2;
  return -1;
}

OpResult FakeHost::SetJointAxis(int joint, int link, Axis axis) {
  return Note(fmt::format("axis joint {} link {} axis {}", joint, link, static_cast<int>(axis)),
              false);
}
OpResult FakeHost::RotateDegrees(int joint, float degrees, bool blocking) {
  return Note(fmt::format("rotate joint {} by {}{}", joint, degrees, blocking ? " and wait" : ""),
              blocking);
}
OpResult FakeHost::SetDegrees(int joint, float degrees, bool blocking) {
  return Note(fmt::format("set joint {} to {}{}", joint, degrees, blocking ? " and wait" : ""),
              blocking);
}
OpResult FakeHost::JointDegrees(int joint, float* degrees) {
  *degrees = 10.5F + static_cast<float>(joint);
  return {};
}
OpResult FakeHost::JointEffort(int joint, float* effort) {
  *effort = -1.25F + static_cast<float>(joint);
  return {};
}
OpResult FakeHost::JointVelocity(int joint, float* velocity) {
  *velocity = 30.0F + static_cast<float>(joint);
  return {};
}
OpResult FakeHost::TurnContinuous(int joint, float degrees_per_s) {
  return Note(fmt::format("turn joint {} at {}", joint, degrees_per_s), false);
}
OpResult FakeHost::MoveMillimetres(int joint, float mm, bool blocking) {
  return Note(fmt::format("move joint {} by {} mm{}", joint, mm, blocking ? " and wait" : ""),
              blocking);
}
OpResult FakeHost::SetMillimetres(int joint, float mm, bool blocking) {
  return Note(fmt::format("move joint {} to {} mm{}", joint, mm, blocking ? " and wait" : ""),
              blocking);
}
OpResult FakeHost::JointMillimetres(int joint, float* mm) {
  *mm = 30.5F + static_cast<float>(joint);
  return {};
}
OpResult FakeHost::SetPosition(int joint, float degrees) {
  return Note(fmt::format("position {} {}", joint, degrees), false);
}
OpResult FakeHost::GetPosition(int joint, float* degrees) {
  *degrees = 20.25F + static_cast<float>(joint);
  return {};
}
OpResult FakeHost::SetConnectorState(int connector, int state_keyword, Cell value) {
  const vm::Text name = program_.keyword(state_keyword).name;
  return Note(fmt::format("connector {} {} {}", connector, std::string(name.data, name.size),
                          value.AsInt()),
              false);
}
OpResult FakeHost::GetConnectorState(int connector, int state_keyword, int* value) {
  const vm::Text name = program_.keyword(state_keyword).name;
  *value = std::string(name.data, name.size) == "EXTENDED" && connector == 0 ? 1 : 0;
  return {};
}
bool FakeHost::Docked(int connector) { return connector == 0; }
OpResult FakeHost::SensorTowards(vm::SensorKind kind, int, vm::Direction d, float* value) {
  if (kind == vm::SensorKind::kContact) {
    *value = d == vm::Direction::kSouth ? 1.0F : 0.0F;
  } else {
    *value = d == vm::Direction::kNorth ? 100.0F : 2000.0F;
  }
  return {};
}
OpResult FakeHost::Tilt(vm::Axis, float* degrees) {
  *degrees = 12.0F;
  return {};
}
OpResult FakeHost::SensorReading(vm::SensorKind kind, int, float* value) {
  *value = kind == vm::SensorKind::kContact ? 1.0F : 30.0F;
  return {};
}
int64_t FakeHost::RootTimeUs() { return 2500000; }
int FakeHost::Hops() { return 3; }
int FakeHost::Id() { return 7; }
OpResult FakeHost::Place(vm::Axis axis, float* mm) {
  *mm = 100.0F * static_cast<float>(axis);
  return {};
}
OpResult FakeHost::Heading(float* degrees) {
  *degrees = -90.0F;
  return {};
}
float FakeHost::Random() { return 0.25F; }
OpResult FakeHost::Sleep(int64_t duration_us) {
  return Note(fmt::format("sleep {} us", duration_us), true);
}
std::string FakeHost::CallText(int role, int command_slot, const Cell* arguments, int count) const {
  const vm::RoleInfo info = program_.role(role);
  const int command = info.commands[command_slot];
  const vm::Text name = program_.member_name(command);
  std::string line =
      std::string(info.name.data, info.name.size) + "." + std::string(name.data, name.size) + "(";
  const vm::FunctionInfo function = program_.function(command);
  for (int i = 0; i < count; ++i) {
    if (i > 0) line += ", ";
    line += function.local_types[i] == vm::ValueType::kFloat
                ? fmt::format("{}", arguments[i].AsFloat())
                : fmt::format("{}", arguments[i].AsInt());
  }
  return line + ")";
}
OpResult FakeHost::Invoke(int role, int command_slot, const Cell* arguments, int count) {
  return Note("invoke " + CallText(role, command_slot, arguments, count), false);
}
OpResult FakeHost::InvokeNear(uint32_t connector_mask, int role, int command_slot,
                              const Cell* arguments, int count) {
  return Note(fmt::format("invoke on {:b} ", connector_mask) +
                  CallText(role, command_slot, arguments, count),
              false);
}
// The one at connector 1 has told nothing.
uint32_t FakeHost::Telling(uint32_t connector_mask, int) { return connector_mask & ~2u; }
uint32_t FakeHost::FirstModule(uint32_t connector_mask) {
  return connector_mask & (~connector_mask + 1);
}
// The fields of a neighbour are what its role begins with.
OpResult FakeHost::NeighbourField(uint32_t connector_mask, int role, int field, Cell* value) {
  OpResult result;
  if (CountModules(connector_mask) != 1) result.fault = vm::FaultCode::kNotOneNeighbour;
  const vm::RoleInfo info = program_.role(role);
  *value = info.fields[field];
  // Where many play the role, each has another value.
  const vm::Text name = info.name;
  if (std::string_view(name.data, name.size) != "Many" || connector_mask == 0) return result;
  const int connector = std::countr_zero(connector_mask);
  const vm::ValueType type = info.fields.type(field);
  if (type == vm::ValueType::kInt) value->bits += static_cast<uint32_t>(connector);
  if (type == vm::ValueType::kFloat) {
    *value = Cell::Float(value->AsFloat() + static_cast<float>(connector));
  }
  if (type == vm::ValueType::kBool) *value = Cell::Bool(value->AsBool() != (connector == 2));
  return result;
}
OpResult FakeHost::Print(int text, const Cell* values, int count) {
  return Note("print " + vm::PrintText(program_, nullptr, text, values, count), false);
}

namespace {

// The role under test, with storage for its fields and labels.
class RoleRunner {
 public:
  RoleRunner(const vm::VerifiedProgram& program, int role)
      : program_(program), role_(program.role(role)), host_(program) {
    for (int i = 0; i < role_.num_fields; ++i) fields_[i] = role_.fields[i];
    std::fill(std::begin(labels_), std::end(labels_), int8_t{-1});
    context_.role = role;
    context_.fields = fields_;
    context_.labels = labels_;
  }

  std::vector<std::string> Run() {
    for (int i = 0; i < role_.num_requirements; ++i) {
      const vm::RunResult result = Evaluate(role_.requirements[i]);
      if (result.status == vm::RunStatus::kFinished) {
        host_.log.push_back(result.value.AsBool() ? "require true" : "require false");
      }
    }
    for (int i = 0; i < role_.num_labels; ++i) {
      const vm::RunResult result = Evaluate(role_.labels[i]);
      if (result.status != vm::RunStatus::kFinished) continue;
      labels_[i] = static_cast<int8_t>(result.value.AsInt());
      const bool is_joint = program_.function(role_.labels[i]).return_type == vm::ValueType::kJoint;
      host_.log.push_back("label " + Str(program_.member_name(role_.labels[i])) +
                          (is_joint ? " joint " : " link ") + std::to_string(labels_[i]));
    }
    for (int i = 0; i < role_.num_startups; ++i) RunFunction(role_.startups[i]);
    for (int i = 0; i < role_.num_behaviors; ++i) RunFunction(role_.behaviors[i]);
    for (int i = 0; i < role_.num_commands; ++i) {
      if (program_.function(role_.commands[i]).num_arguments == 0) {
        RunFunction(role_.commands[i]);
      }
    }
    for (int i = 0; i < role_.num_handlers; ++i) RunFunction(role_.handlers[i].function);
    return host_.log;
  }

 private:
  static std::string Str(vm::Text text) { return std::string(text.data, text.size); }

  vm::RunResult Evaluate(int function) {
    int32_t budget = 1000;
    const vm::RunResult result = vm::Evaluate(program_, function, context_, host_, &budget);
    Report(result);
    return result;
  }

  void Report(const vm::RunResult& result) {
    if (result.status == vm::RunStatus::kFinished) return;
    host_.log.push_back(fmt::format(
        "{} in line {}",
        result.status == vm::RunStatus::kFaulted ? vm::FaultName(result.fault) : "out of budget",
        program_.LineOf(result.function, result.pc)));
  }

  void RunFunction(int function) {
    vm::TaskState task;
    vm::StartTask(program_, function, nullptr, 0, &task);
    int32_t budget = 5000;
    vm::RunResult result;
    do {
      result = vm::RunTask(program_, context_, host_, &task, &budget);
    } while (result.status == vm::RunStatus::kWaiting);
    Report(result);
  }

  const vm::VerifiedProgram& program_;
  const vm::RoleInfo role_;
  FakeHost host_;
  vm::RoleContext context_;
  Cell fields_[vm::kMaxFields];
  int8_t labels_[vm::kMaxLabels];
};

}  // namespace

std::vector<std::string> RunRoleNumber(const vm::VerifiedProgram& program, int role) {
  return RoleRunner(program, role).Run();
}

std::vector<std::string> RunRole(const vm::VerifiedProgram& program, const std::string& role_name) {
  for (int i = 0; i < program.num_roles(); ++i) {
    const vm::Text name = program.role(i).name;
    if (std::string(name.data, name.size) == role_name) return RunRoleNumber(program, i);
  }
  return {"no role " + role_name};
}

}  // namespace morphbus::dynarole
