#include "compiler/dynarole/checker.h"

#include <algorithm>
#include <optional>
#include <string>

#include "compiler/dynarole/check_pass.h"
#include "compiler/dynarole/constants.h"
#include "compiler/dynarole/expression_checker.h"
#include "compiler/dynarole/program_checks.h"
#include "compiler/dynarole/scope.h"
#include "compiler/dynarole/statement_checker.h"
#include "compiler/dynarole/statement_flow.h"
#include "vm/image/fault_text.h"

namespace morphbus::dynarole {

namespace {

/// Checks a whole program. Types of parameters, results and fields may follow from code anywhere in
/// it, so it goes over the program again until nothing new is found, and reports in a last pass.
class Checker {
 public:
  Checker(const keywords::KeywordTable& keywords, ProgramModel* model,
          source::Diagnostics* diagnostics)
      : model_(*model),
        pass_(diagnostics),
        scope_(model, &pass_),
        expressions_(keywords, model, &scope_, &pass_),
        statements_(model, &scope_, &expressions_, &pass_) {}

  void Run();

 private:
  /// One walk over all fields and routines.
  void CheckMembers();
  void CheckFieldValues(int role);
  /// A value that is kept means the same under another program.
  void CheckKept(const FieldDecl& decl, const FieldSlot& slot, const Expr& value);
  /// All elements of an array are of one type; a value that does not fit is reported where it
  /// stands.
  void CheckArrays(const RoleModel& role);
  void CheckRoutine(int index);
  void CheckRequirement(Routine* routine);
  void CheckLabel(Routine* routine);
  /// A routine with statements, whose first locals are its parameters.
  void CheckBody(Routine* routine);
  /// Computes the period of a timer.
  void CheckPeriod(Member* member);

  ProgramModel& model_;
  CheckPass pass_;
  Scope scope_;
  ExpressionChecker expressions_;
  StatementChecker statements_;
};

// Bodies say what they need (a parameter handed to jointRotateDegrees is a float); where they do
// not, calls say what is given; where neither does, a comparison or sum with a number must do.
void Checker::Run() {
  expressions_.constants().CheckAll();
  // Each phase repeats until it finds nothing new: what one body needs may tell a parameter of
  // another.
  for (const Phase phase : {Phase::kBodies, Phase::kCalls, Phase::kDefaults}) {
    // Every round settles at least one type or is the last; programs need two or three.
    for (int round = 0; round < 100; ++round) {
      pass_.Begin(phase);
      CheckMembers();
      if (!pass_.changed()) break;
    }
  }
  // Only now are types complete, so only now can what does not fit be told from what is not known
  // yet.
  pass_.Begin(Phase::kFinal);
  for (Routine& routine : model_.routines) routine.calls.clear();
  CheckMembers();
  // What follows needs the whole program.
  CheckFieldsSet(model_, &pass_);
  CheckSignatures(model_, &pass_);
  CheckCalls(&model_, &pass_);
}

void Checker::CheckMembers() {
  for (int i = 0; i < std::ssize(model_.roles); ++i) CheckFieldValues(i);
  for (const RoleModel& role : model_.roles) CheckArrays(role);
  for (int i = 0; i < std::ssize(model_.routines); ++i) CheckRoutine(i);
}

void Checker::CheckFieldValues(int role) {
  RoleModel& model = model_.roles[role];
  scope_.EnterValue(role);
  for (FieldSlot& slot : model.fields) {
    // A value that was inherited is checked where it stands.
    if (slot.value == nullptr) continue;
    // A role holds the values that it inherits as well as its own.
    const bool own = std::any_of(model.role->members.begin(), model.role->members.end(),
                                 [&](const Member& member) { return &member == slot.value; });
    FieldDecl& decl = model_.fields[slot.decl];
    Expr* value = slot.value->expr.get();
    if (own) {
      // The first value decides the type of the field; later ones must fit it, or widen it from int
      // to float.
      const Type type = expressions_.Infer(value);
      const std::optional<Type> joined = Join(decl.type, type);
      if (!joined) {
        pass_
            .Error(value->span, "field '" + decl.name + "' is " + NameOf(decl.type) +
                                    ", but this is " + NameOf(type))
            .Note(decl.type_span, "its type follows from this value");
        continue;
      }
      if (decl.type != *joined) decl.type_span = value->span;
      if (*joined != Type::kVoid) pass_.Change(&decl.type, *joined);
      // `$ANY` alone is a direction once nothing else has been said.
      if (decl.type == Type::kAny && pass_.phase() == Phase::kDefaults) {
        pass_.Change(&decl.type, Type::kDirection);
      }
      expressions_.conversions().Want(value, decl.type, "the field '" + decl.name + "'");
    }
    // The image holds the value, so it must be known now, or be a parameter's, which the image
    // holds as well.
    slot.parameter = ParameterOf(*value);
    if (own && decl.kept) CheckKept(decl, slot, *value);
    if (own && slot.traced && pass_.is_final() && !IsNumber(decl.type) &&
        decl.type != Type::kBool && decl.type != Type::kError) {
      pass_.Error(value->span, "field '" + decl.name + "' is traced, but is " + NameOf(decl.type))
          .hint = "numbers and bools are traced";
    }
    if (slot.parameter >= 0) continue;
    const FoldResult folded = Fold(*value);
    if (folded.value) slot.cell = folded.value->cell;
    if (!own || folded.value || value->type == Type::kError) continue;
    if (folded.fault != vm::FaultCode::kNone) {
      pass_.Error(value->span, std::string("value of the field cannot be computed: ") +
                                   vm::FaultName(folded.fault));
    } else {
      pass_.Error(value->span, "value of a field must be known at compile time").hint =
          "numbers, true, false, directions, axes and roles are, and a parameter of the field's "
          "type may stand alone; to name a joint or link, use a label";
    }
  }
}

void Checker::CheckKept(const FieldDecl& decl, const FieldSlot& slot, const Expr& value) {
  if (slot.parameter >= 0) {
    pass_.Error(value.span, "a field that is kept cannot begin with a parameter").hint =
        "give it a number, and let a startup set it";
  }
  // Roles have other numbers in another program.
  if (decl.type == Type::kRole) {
    pass_.Error(value.span, "a role cannot be kept").hint =
        "bools, ints, floats, directions and axes can";
  }
}

void Checker::CheckArrays(const RoleModel& role) {
  for (size_t first = 0; first < role.fields.size();) {
    const FieldDecl& decl = model_.fields[role.fields[first].decl];
    const size_t length = std::max(1, decl.length);
    Type type = decl.type;
    // Where the value stands that tells it, for the notes.
    source::Span told = decl.type_span;
    for (size_t i = 1; i < length; ++i) {
      const FieldDecl& element = model_.fields[role.fields[first + i].decl];
      const std::optional<Type> joined = Join(type, element.type);
      if (!joined) break;
      if (*joined != type) told = element.type_span;
      type = *joined;
    }
    // What one of them tells is so for all; the values are converted in the next pass.
    for (size_t i = 0; i < length && !pass_.is_final() && type != Type::kVoid; ++i) {
      FieldDecl& element = model_.fields[role.fields[first + i].decl];
      if (element.type != type) element.type_span = told;
      pass_.Change(&element.type, type);
    }
    first += length;
  }
}

void Checker::CheckRoutine(int index) {
  scope_.EnterRoutine(index);
  Routine* routine = scope_.routine();
  if (routine->kind == MemberKind::kRequire) return CheckRequirement(routine);
  if (routine->kind == MemberKind::kLabel) return CheckLabel(routine);
  CheckBody(routine);
}

// A requirement is one expression, which must be a bool.
void Checker::CheckRequirement(Routine* routine) {
  expressions_.InferAs(routine->member->expr.get(), Type::kBool, "a requirement");
  routine->result = Type::kBool;
}

// A label is one expression too; a set of joints or links stands for the one member that it must
// have.
void Checker::CheckLabel(Routine* routine) {
  Expr* expr = routine->member->expr.get();
  const Type type = expressions_.Infer(expr);
  // Of a label that has been found wrong nothing follows where it is used.
  routine->result = type == Type::kLink || type == Type::kLinkSet ? Type::kLink
                    : type == Type::kError                        ? Type::kError
                                                                  : Type::kJoint;
  if (type != Type::kError && type != Type::kUnknown && !Fits(type, routine->result)) {
    pass_.Error(expr->span, "a label names a joint or a link, but this is " + NameOf(type)).hint =
        "for example self.joints($ANY, 1), self.links(1) or a keyword such as $LINK_...";
  } else {
    expressions_.conversions().Want(expr, routine->result, "a label");
  }
}

void Checker::CheckBody(Routine* routine) {
  Member& member = *routine->member;
  if (member.period != nullptr) CheckPeriod(&member);
  Signature& signature = scope_.signature();
  for (size_t i = 0; i < member.parameters.size(); ++i) {
    const Parameter& parameter = member.parameters[i];
    scope_.AddLocal(parameter.name, parameter.span, signature.parameters[i], true);
  }
  routine->result = signature.result;
  statements_.CheckBlock(member.body.get());
  if (signature.result != Type::kVoid && !AlwaysReturns(*member.body)) {
    // The message points at the closing brace, behind which the result is missing.
    const size_t end = member.body->span.end;
    pass_
        .Error({member.body->span.file, end > 0 ? end - 1 : 0, end},
               "function '" + member.name + "' can end here without a result")
        .hint = "end it with 'return ...;' on every way";
  }
  scope_.Close(0);
}

void Checker::CheckPeriod(Member* member) {
  Expr* period = member->period.get();
  expressions_.InferAs(period, Type::kFloat, "a period");
  if (period->type == Type::kError) return;
  if (const int parameter = ParameterOf(*period); parameter >= 0) {
    // Whatever a run chooses must be a period.
    const ConstantModel& range = model_.constants[parameter];
    member->period_parameter = parameter;
    if (range.least_cell.AsFloat() < vm::kMinPeriodS ||
        range.most_cell.AsFloat() > vm::kMaxPeriodS) {
      pass_.Error(period->span, "a period is a number of seconds from 0.001 to 1000000")
          .Note(range.least->span, "the parameter may have another value");
    }
    return;
  }
  const FoldResult folded = Fold(*period);
  if (!folded.value || folded.value->type != Type::kFloat) {
    pass_.Error(period->span, "a period must be known at compile time").hint =
        "write a number of seconds, a constant, or a parameter that is a float";
    return;
  }
  member->period_s = folded.value->cell.AsFloat();
  if (member->period_s >= vm::kMinPeriodS && member->period_s <= vm::kMaxPeriodS) return;
  pass_.Error(period->span, "a period is a number of seconds from 0.001 to 1000000");
}

}  // namespace

void Check(const keywords::KeywordTable& keywords, ProgramModel* model,
           source::Diagnostics* diagnostics) {
  // Everything happens in Run; the object holds what its passes share.
  Checker(keywords, model, diagnostics).Run();
}

}  // namespace morphbus::dynarole
