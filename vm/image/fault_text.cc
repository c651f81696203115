#include "vm/image/fault_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "vm/image/image_texts.h"
#include "vm/image/source_places.h"

namespace morphbus::vm {

namespace {

/// The sentence of each code; empty where its few words say it all.
constexpr const char* kSentences[kNumFaultCodes] = {
#define FAULT(name, short_text, sentence) sentence,
#include "vm/image/faults.def"
#undef FAULT
};

/// A number with at most two decimals, without zeros at its end: "90", "90.02", "-0.5".
std::string Number(float value) {
  // Rounding may leave a minus before a zero, which nobody wants to read.
  std::string text = fmt::format("{:.2f}", static_cast<double>(value));
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

/// The angle between two directions whose cosine is given.
std::string AngleText(float cosine) {
  // Rounding may bring a cosine beyond 1.
  const double degrees = std::acos(std::clamp(static_cast<double>(cosine), -1.0, 1.0)) * 180 / M_PI;
  return fmt::format("{:.1f}°", degrees);
}

/// A direction of the robot frame (unit vector) by its angles to the named ones.
std::string DirectionText(const Vec3& direction_R) {
  return AngleText(direction_R.x) + " from $NORTH, " + AngleText(direction_R.y) + " from $UP, " +
         AngleText(direction_R.z) + " from $EAST";
}

/// "link FOOT", or "link 3" where there is no image to look it up in or it has no such thing: a
/// fault may come from another program or module type.
template <class NameOf>
std::string Named(const char* kind, int index, int count, const NameOf& name_of) {
  const std::string number = std::to_string(index);
  return std::string(kind) + (index >= 0 && index < count ? ToString(name_of(index)) : number);
}

/// A function's name; "function 3" without a program that has it, empty for -1.
std::string FunctionText(int function, const VerifiedProgram* program) {
  if (function < 0) return "";
  const bool known = program != nullptr && function < program->num_functions();
  return known ? ToString(program->function_name(function)) : fmt::format("function {}", function);
}

/// What follows from the end of a task, after its name.
const char* Consequence(TaskKind kind) {
  switch (kind) {
    case TaskKind::kStartup:
      return "has ended, and nothing else of the role starts while it is held";
    case TaskKind::kBehavior:
      return "has ended and does not start again while the role is held";
    case TaskKind::kCommand:
      return "has ended; the next invocation starts it anew";
    case TaskKind::kHandler:
      return "has ended; the next event starts it anew";
  }
  return "has ended";
}

/// What becomes of the task that a fault has ended; empty if it has ended none.
std::string Ending(const Fault& fault, const VerifiedProgram* program) {
  // A behavior that found no free task has not begun.
  if (fault.ended_task < 0 || fault.code == FaultCode::kTooManyTasks) return "";
  const auto kind = static_cast<TaskKind>(fault.ended_task);
  // The function in which it happened stands behind the sentence; the task may be that of a caller.
  const bool other = fault.task_function != fault.function;
  return fmt::format("; the {}{}{} {}", TaskKindName(kind), other ? " " : "",
                     other ? FunctionText(fault.task_function, program) : "", Consequence(kind));
}

/// Words one fault.
class Wording {
 public:
  Wording(const Fault& fault, const FaultContext& context) : fault_(fault), context_(context) {}

  [[nodiscard]] std::string Sentence() const {
    const VerifiedKinematics* kin = context_.kinematics;
    const VerifiedProgram* program = context_.program;
    const int num_roles = program != nullptr ? program->num_roles() : 0;
    const auto role = [&](int i) { return program->role(i).name; };
    const std::string function = FaultFunction(fault_, program);
    // Every value that a sentence may ask for, by the name that it has in faults.def.
    return fmt::format(
        fmt::runtime(Template(function)), fmt::arg("joint", Joint()),
        fmt::arg("joint_kind", JointKindName()),
        fmt::arg("link", Named("link ", fault_.link, kin != nullptr ? kin->num_links() : 0,
                               [&](int i) { return kin->link(i).name; })),
        fmt::arg("connector",
                 Named("connector ", fault_.connector, kin != nullptr ? kin->num_connectors() : 0,
                       [&](int i) { return kin->connector(i).name; })),
        fmt::arg("type",
                 kin != nullptr ? "module type " + ToString(kin->type_name()) : "the module type"),
        fmt::arg("keyword", Keyword()),
        fmt::arg("role", Named("role ", fault_.role, num_roles, role)),
        fmt::arg("rival_role", Named("role ", fault_.rival_role, num_roles, role)),
        fmt::arg("function", function),
        fmt::arg("of_function", function.empty() ? "" : " of " + function),
        // What was asked, found and allowed: as it is, and in degrees or millimetres.
        fmt::arg("asked", Number(fault_.asked)), fmt::arg("asked_amount", Amount(fault_.asked)),
        fmt::arg("measured", Number(fault_.measured)),
        fmt::arg("measured_amount", Amount(fault_.measured)),
        fmt::arg("limit", Number(fault_.limit)), fmt::arg("limit_amount", Amount(fault_.limit)),
        fmt::arg("last_value", Number(fault_.limit - 1)),
        // Of setJointAxis.
        fmt::arg("axis", kAxisRows[static_cast<int>(fault_.asked_axis)].name),
        fmt::arg("axis_direction", DirectionText(UnitOf(fault_.asked_axis))),
        fmt::arg("direction", DirectionText(fault_.direction_R)),
        fmt::arg("angle", fmt::format("{:.1f}", static_cast<double>(fault_.measured))));
  }

 private:
  /// The sentence of faults.def, but where what it speaks of is not there.
  [[nodiscard]] const char* Template(const std::string& function) const {
    if (fault_.code == FaultCode::kRoleFlicker && fault_.role < 0) {
      return "the role changed more than {limit} times in {measured} s; the module is frozen "
             "without "
             "a role";
    }
    // The limit is the number of values; 0 says that there is no such state.
    if (fault_.code == FaultCode::kNoSuchValue && fault_.limit <= 0) {
      return "{connector} has no {keyword}";
    }
    if (fault_.code == FaultCode::kBadInvocation && function.empty()) {
      return "an invocation is refused: the program has no such command";
    }
    const auto code = static_cast<int>(fault_.code);
    const bool has_sentence = code < kNumFaultCodes && *kSentences[code] != '\0';
    return has_sentence ? kSentences[code] : FaultName(fault_.code);
  }

  /// An angle or length of the joint concerned, with its unit if the joint's kind is known.
  [[nodiscard]] std::string Amount(float value) const {
    const KinJoint* joint = FindJoint();
    if (joint == nullptr) return Number(value);
    return Number(value) + (joint->kind == JointKind::kPrismatic ? " mm" : "°");
  }

  [[nodiscard]] const KinJoint* FindJoint() const {
    // The index comes from the fault, so it is checked against the image at hand.
    const VerifiedKinematics* kin = context_.kinematics;
    const bool known = kin != nullptr && fault_.joint >= 0 && fault_.joint < kin->num_joints();
    return known ? &kin->joint(fault_.joint) : nullptr;
  }

  /// "revolute", "prismatic" …, or what it is not where the kind is not known.
  [[nodiscard]] const char* JointKindName() const {
    constexpr const char* kNames[] = {"revolute", "continuous", "prismatic", "fixed"};
    if (const KinJoint* joint = FindJoint()) return kNames[static_cast<int>(joint->kind)];
    return fault_.code == FaultCode::kNotContinuous ? "not continuous" : "not prismatic";
  }

  [[nodiscard]] std::string Joint() const {
    const KinJoint* joint = FindJoint();
    return joint != nullptr ? "joint " + ToString(joint->name)
                            : fmt::format("joint {}", fault_.joint);
  }

  [[nodiscard]] std::string Keyword() const {
    const VerifiedProgram* program = context_.program;
    const int k = fault_.keyword;
    const bool known = program != nullptr && k >= 0 && k < program->num_keywords();
    return known ? ToString(program->keyword(k).name) : fmt::format("keyword {}", k);
  }

  const Fault& fault_;
  const FaultContext& context_;
};

}  // namespace

const char* TaskKindName(TaskKind kind) {
  constexpr const char* kNames[] = {"startup", "behavior", "command", "handler"};
  const auto index = static_cast<size_t>(kind);
  return index < std::size(kNames) ? kNames[index] : "task";
}

std::string FaultSentence(const Fault& fault, const FaultContext& context) {
  return Wording(fault, context).Sentence() + Ending(fault, context.program);
}

std::string FaultFunction(const Fault& fault, const VerifiedProgram* program) {
  // Most faults happen in a function; those of bodies, poses and roles do not.
  return FunctionText(fault.function, program);
}

std::string FaultTask(const Fault& fault, const VerifiedProgram* program) {
  return FunctionText(fault.task_function, program);
}

std::string FaultLine(const std::string& file, int line, const std::string& sentence,
                      const std::string& function) {
  std::string text;
  // The place comes first, as compilers put it, so that editors can jump to it.
  if (line > 0) text = PlaceText({file, line}) + ": ";
  // A line without a file is still of use to whoever knows the program.
  text += sentence;
  if (!function.empty()) text += " (in " + function + ")";
  return text;
}

}  // namespace morphbus::vm
