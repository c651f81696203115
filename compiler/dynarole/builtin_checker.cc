#include "compiler/dynarole/builtin_checker.h"

#include <algorithm>

#include "compiler/base/text.h"
#include "compiler/dynarole/constants.h"

namespace morphbus::dynarole {

namespace {

/// A member without parentheses has no arguments.
size_t CountArguments(const Expr* call) { return call != nullptr ? call->operands.size() - 1 : 0; }

}  // namespace

Type BuiltinChecker::Infer(const std::vector<Builtin>& table, const std::string& prefix,
                           Expr* member, Expr* call) {
  // A property stands without parentheses, so that the member itself is the expression.
  Expr* expr = call != nullptr ? call : member;
  // Forms of a name differ in their numbers of arguments, so that at most one fits.
  const Builtin* form = nullptr;
  for (const Builtin& builtin : table) {
    if (member->name != builtin.name) continue;
    if (std::string(builtin.arguments).size() == CountArguments(call) &&
        (call != nullptr || builtin.property)) {
      form = &builtin;
    }
  }
  const std::string usages = UsagesOf(table, member->name);
  if (usages.empty()) {
    pass_.Suggest(&pass_.Error(member->name_span, "a joint has no '" + member->name + "'"),
                  member->name, NamesOf(table), "",
                  "joints have AXIS, SET_POSITION(degrees) and GET_POSITION()");
    return Type::kError;
  }
  // The name is right but no form of it takes so many arguments.
  if (form == nullptr) {
    return pass_.Wrong(expr->span,
                       call == nullptr ? "'" + prefix + member->name + "' must be called"
                                       : "'" + prefix + member->name + "' does not take " +
                                             Counted(std::ssize(call->operands) - 1, "argument"),
                       "write " + usages);
  }
  // The letters of the form are the types of its arguments.
  for (size_t i = 0; i < CountArguments(call); ++i) {
    conversions_.Want(call->operands[i + 1].get(), TypeOfLetter(form->arguments[i]),
                      "argument " + std::to_string(i + 1) + " of '" + prefix + member->name + "'");
  }
  // From here on the call is its instruction; what is left are demands that types do not show.
  expr->meaning = Meaning::kBuiltin;
  expr->opcode = form->opcode;
  if (form->motion != Motion::kAny) CheckMotion(*form, *call->operands[1]);
  if (form->opcode == vm::Opcode::kPlace) {
    const FoldResult axis = Fold(*call->operands[1]);
    if (axis.value && axis.value->cell.bits == 0) {
      pass_.Error(call->operands[1]->span, "'self.place' needs one axis").hint =
          "for example self.place($NORTH_SOUTH): millimetres to the north";
    }
  }
  if (form->opcode == vm::Opcode::kJoints || form->opcode == vm::Opcode::kLinks) {
    CheckCount(*form, *call->operands.back());
  }
  // Where the call stands it must be allowed to do what it does.
  scope_.Uses(form->opcode, member->name_span, prefix + member->name);
  if (vm::InfoOf(form->opcode).operand == vm::OperandKind::kSensorKindKeyword) {
    return parts_.UseSensorKind(expr, member->name_span);
  }
  return IsWholeNumber(*expr) ? Type::kInt : TypePushedBy(form->opcode);
}

void BuiltinChecker::CheckMotion(const Builtin& builtin, const Expr& joint) {
  const Motions motions = MotionsOf(joint);
  if (motions.turns == motions.slides) return;  // Either may be, or nothing is known.
  // What all joints in question do is what the call wants.
  if (motions.turns == (builtin.motion == Motion::kTurns)) return;
  pass_
      .Error(joint.span,
             std::string("'self.") + builtin.name + "' needs a joint that " +
                 (motions.turns ? "slides, but this joint turns" : "turns, but this joint slides"))
      .hint = "write " + UsagesOf(SelfBuiltins(), builtin.counterpart);
}

BuiltinChecker::Motions BuiltinChecker::MotionsOf(const Expr& joint) const {
  Motions motions;
  const auto add = [&motions](const auto& other) {
    motions.turns |= other.turns;
    motions.slides |= other.slides;
  };
  if (joint.meaning == Meaning::kKeyword) {
    add(keywords_.all()[model_.keywords[joint.index]]);
  } else if (joint.meaning == Meaning::kLabel) {
    for (int role = 0; role < std::ssize(model_.roles); ++role) {
      // The code runs for subroles too, each with a label of its own in the slot.
      if (!model_.IsA(role, scope_.role_index())) continue;
      const Routine& label = model_.routines[model_.roles[role].labels[joint.index].routine];
      add(MotionsOf(*label.member->expr));
    }
  } else {
    // It may be any joint of any module.
    for (const keywords::Keyword& keyword : keywords_.all()) add(keyword);
  }
  return motions;
}

void BuiltinChecker::CheckCount(const Builtin& builtin, const Expr& count) {
  // Only a number that stands in the text can be judged now.
  const FoldResult folded = Fold(count);
  if (!folded.value || folded.value->type != Type::kInt) return;
  const int value = folded.value->cell.AsInt();
  const bool joints = builtin.opcode == vm::Opcode::kJoints;
  // Two bodies meet at a joint, and each holds so many joints at most.
  const int most = joints ? 2 * (vm::kMaxBodyJoints - 1) : vm::kMaxBodyJoints;
  // Within the bounds some body may be so.
  if (value >= 0 && value <= most) return;
  pass_
      .Error(count.span, (joints ? "no joint has " : "no link has ") + std::to_string(value) +
                             (joints ? " adjacent joints" : " joints on its body") +
                             ", so this matches nothing")
      .hint = "write a number from 0 to " + std::to_string(most);
}

}  // namespace morphbus::dynarole
