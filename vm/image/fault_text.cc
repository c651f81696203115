#include "vm/image/fault_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace morphbus::vm {

namespace {

/// The few words of each code.
constexpr const char* kShortTexts[kNumFaultCodes] = {
#define FAULT(name, short_text) short_text,
#include "vm/image/faults.def"
#undef FAULT
};

/// Texts of an image are not NUL-terminated.
std::string ToString(Text text) { return std::string(text.data, text.size); }

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

/// Words one fault. Every look-up may fail: a fault may come from another program or module type
/// than the images at hand.
class Wording {
 public:
  Wording(const Fault& fault, const FaultContext& context) : fault_(fault), context_(context) {}

  [[nodiscard]] std::string Sentence() const {
    switch (fault_.code) {
      case FaultCode::kIntegerOverflow:
        return "integer overflow: the result does not fit into 32 bits";
      case FaultCode::kDivisionByZero:
      case FaultCode::kNotFinite:
        return FaultName(fault_.code);
      case FaultCode::kUnresolved:
        return fmt::format("exactly one joint or link is wanted, and {} fit", Measured());
      case FaultCode::kMissingKeyword:
        return fmt::format("{} has no {}", TypeName(), Keyword());
      case FaultCode::kBudget:
        return fmt::format("the instruction budget of {} is used up", Limit());
      case FaultCode::kStalePose:
        return fmt::format("the pose is stale: nothing newer came from the root for {} ticks",
                           Measured());
      case FaultCode::kAmbiguousRole:
        return fmt::format(
            "{} and {} both fit this module and neither extends the other; it plays "
            "{}",
            Role(fault_.role), Role(fault_.rival_role), Role(fault_.role));
      case FaultCode::kRoleFlicker:
        return fmt::format("the role changed more than {} times in {} s; the module is frozen {}",
                           Limit(), Measured(),
                           fault_.role < 0 ? "without a role" : "in " + Role(fault_.role));
      default:
        return fault_.code <= FaultCode::kNoSuchValue ? ActuatorSentence() : CapacitySentence();
    }
  }

 private:
  /// Of joints and connectors.
  [[nodiscard]] std::string ActuatorSentence() const {
    switch (fault_.code) {
      // setJointAxis.
      case FaultCode::kLinkNotOnJoint:
        return fmt::format("{} does not touch {}", Joint(), Link());
      case FaultCode::kAxisNotAligned:
        return fmt::format(
            "{} turns {} about a direction {}; {} ({}) was asked for, which is {} "
            "off, either way, and may be {}° off at most",
            Joint(), Link(), DirectionText(fault_.direction_R), AskedAxis(),
            DirectionText(UnitOf(fault_.asked_axis)), AngleOff(), Limit());
      // Where the joint was to go, how far it came, and what would have been enough.
      case FaultCode::kTargetClamped:
        return fmt::format("{} was asked for {} and can go to {} only: clamped", Joint(),
                           Amount(fault_.asked), Amount(fault_.limit));
      case FaultCode::kSpeedClamped:
        return fmt::format("{} was asked for {}/s and can turn at {}/s only: clamped", Joint(),
                           Amount(fault_.asked), Amount(fault_.limit));
      case FaultCode::kStalled:
        return fmt::format(
            "{} stalled at {}: {} was asked for, and within {} of it counts as "
            "arrived",
            Joint(), Amount(fault_.measured), Amount(fault_.asked), Amount(fault_.limit));
      case FaultCode::kTurnStalled:
        return fmt::format(
            "{} stalled at {}/s: {}/s was asked for, and below {}/s counts as "
            "stalled",
            Joint(), Amount(fault_.measured), Amount(fault_.asked), Amount(fault_.limit));
      // Calls that do not suit the kind of joint.
      case FaultCode::kNotContinuous:
        return fmt::format("{} is {} and cannot turn endlessly", Joint(),
                           JointKindName("not continuous"));
      case FaultCode::kNotPrismatic:
        return fmt::format("{} is {} and cannot move by millimetres; ask for degrees", Joint(),
                           JointKindName("not prismatic"));
      case FaultCode::kNotRotary:
        return fmt::format("{} is prismatic and cannot turn by degrees; ask for millimetres",
                           Joint());
      case FaultCode::kFixedJoint:
        return fmt::format("{} is fixed and does not move", Joint());
      case FaultCode::kNoSuchValue:
        // The limit is the number of values; 0 says that there is no such state.
        if (fault_.limit <= 0) return fmt::format("{} has no {}", Connector(), Keyword());
        return fmt::format("{} of {} has the values 0 to {}, and {} was asked for", Keyword(),
                           Connector(), Number(fault_.limit - 1), Asked());
      default:
        return FaultName(fault_.code);
    }
  }

  /// Of invocations and of the capacities of vm/limits.h.
  [[nodiscard]] std::string CapacitySentence() const {
    // Most of these concern a command, which is named by its function.
    const std::string function = FaultFunction(fault_, context_.program);
    switch (fault_.code) {
      // The command is named by its function.
      case FaultCode::kQueueOverflow:
        return fmt::format("{} invocations wait for {} already; one more is dropped", Limit(),
                           function);
      case FaultCode::kInvocationNotSent:
        return fmt::format("{} invocations are under way already; one more is not sent", Limit());
      case FaultCode::kInvocationGivenUp:
        return fmt::format(
            "an invocation{} is given up: all {} places are full and the neighbours "
            "took none for {} ticks",
            function.empty() ? "" : " of " + function, Limit(), Measured());
      case FaultCode::kBadInvocation:
        return function.empty()
                   ? "an invocation is refused: the program has no such command"
                   : fmt::format("an invocation of {} is refused: its arguments do not fit",
                                 function);
      // Capacities: how much there is, and what is left out.
      case FaultCode::kTooManyTasks:
        return fmt::format("{} tasks run already; {} does not start", Limit(), function);
      case FaultCode::kTooManyNeighbours:
        return fmt::format("{} connectors are docked; neighbours are told of {} only", Measured(),
                           Limit());
      case FaultCode::kTooManyBodyJoints:
        return fmt::format("more than {} joints touch the body of {}; the others are not counted",
                           Limit(), Link());
      case FaultCode::kTooManyOrigins:
        return fmt::format("{} modules have invoked commands; those of one more are ignored",
                           Limit());
      case FaultCode::kTooManyConnectorCommands:
        return fmt::format("{} connector commands are given in this tick already; {} gets none",
                           Limit(), Connector());
      default:
        return FaultName(fault_.code);
    }
  }

  // The numbers of the fault as text.
  [[nodiscard]] std::string Asked() const { return Number(fault_.asked); }
  [[nodiscard]] std::string Measured() const { return Number(fault_.measured); }
  [[nodiscard]] std::string Limit() const { return Number(fault_.limit); }
  [[nodiscard]] std::string AngleOff() const {
    return fmt::format("{:.1f}°", static_cast<double>(fault_.measured));
  }

  /// An angle or length of the joint concerned, with its unit if the joint's kind is known.
  [[nodiscard]] std::string Amount(float value) const {
    const KinJoint* joint = FindJoint();
    if (joint == nullptr) return Number(value);
    return Number(value) + (joint->kind == JointKind::kPrismatic ? " mm" : "°");
  }

  // Things by name, or by number where there is no image to look them up in or it has no such
  // thing.
  [[nodiscard]] const KinJoint* FindJoint() const {
    // The index comes from the fault, so it is checked against the image at hand.
    const VerifiedKinematics* kin = context_.kinematics;
    const bool known = kin != nullptr && fault_.joint >= 0 && fault_.joint < kin->num_joints();
    return known ? &kin->joint(fault_.joint) : nullptr;
  }

  [[nodiscard]] std::string Joint() const {
    const KinJoint* joint = FindJoint();
    return joint != nullptr ? "joint " + ToString(joint->name)
                            : fmt::format("joint {}", fault_.joint);
  }

  /// "revolute", "prismatic" …, or `unknown` where the kind is not known.
  [[nodiscard]] const char* JointKindName(const char* unknown) const {
    constexpr const char* kNames[] = {"revolute", "continuous", "prismatic", "fixed"};
    const KinJoint* joint = FindJoint();
    return joint == nullptr ? unknown : kNames[static_cast<int>(joint->kind)];
  }

  [[nodiscard]] std::string Link() const {
    const VerifiedKinematics* kin = context_.kinematics;
    const bool known = kin != nullptr && fault_.link >= 0 && fault_.link < kin->num_links();
    return known ? "link " + ToString(kin->link(fault_.link).name)
                 : fmt::format("link {}", fault_.link);
  }

  [[nodiscard]] std::string Connector() const {
    const VerifiedKinematics* kin = context_.kinematics;
    const int c = fault_.connector;
    const bool known = kin != nullptr && c >= 0 && c < kin->num_connectors();
    return known ? "connector " + ToString(kin->connector(c).name) : fmt::format("connector {}", c);
  }

  [[nodiscard]] std::string TypeName() const {
    const VerifiedKinematics* kin = context_.kinematics;
    return kin != nullptr ? "module type " + ToString(kin->type_name()) : "the module type";
  }

  [[nodiscard]] std::string Keyword() const {
    const VerifiedProgram* program = context_.program;
    const int k = fault_.keyword;
    const bool known = program != nullptr && k >= 0 && k < program->num_keywords();
    return known ? ToString(program->keyword(k).name) : fmt::format("keyword {}", k);
  }

  [[nodiscard]] std::string Role(int role) const {
    const VerifiedProgram* program = context_.program;
    const bool known = program != nullptr && role >= 0 && role < program->num_roles();
    return known ? "role " + ToString(program->role(role).name) : fmt::format("role {}", role);
  }

  [[nodiscard]] const char* AskedAxis() const {
    return kAxisNames[static_cast<int>(fault_.asked_axis)];
  }

  const Fault& fault_;
  const FaultContext& context_;
};

}  // namespace

const char* FaultName(FaultCode code) {
  // A code may come from a message of a newer version.
  const auto index = static_cast<int>(code);
  return index < kNumFaultCodes ? kShortTexts[index] : "unknown fault";
}

std::string FaultSentence(const Fault& fault, const FaultContext& context) {
  return Wording(fault, context).Sentence();
}

std::string FaultFunction(const Fault& fault, const VerifiedProgram* program) {
  // Most faults happen in a function; those of bodies, poses and roles do not.
  if (fault.function < 0) return "";
  const bool known = program != nullptr && fault.function < program->num_functions();
  return known ? ToString(program->function(fault.function).name)
               : fmt::format("function {}", fault.function);
}

std::string FaultLine(const std::string& file, int line, const std::string& sentence,
                      const std::string& function) {
  std::string text;
  // The place comes first, as compilers put it, so that editors can jump to it.
  if (line > 0)
    text = file.empty() ? fmt::format("line {}: ", line) : fmt::format("{}:{}: ", file, line);
  // A line without a file is still of use to whoever knows the program.
  text += sentence;
  if (!function.empty()) text += " (in " + function + ")";
  return text;
}

}  // namespace morphbus::vm
