#include "compiler/dynarole/checker.h"

#include <algorithm>

#include "compiler/dynarole/constants.h"
#include "vm/image/fault_text.h"

namespace morphbus::dynarole {

using source::Diagnostic;
using source::Span;

void Check(const source::SourceSet& sources, const keywords::KeywordTable& keywords,
           ProgramModel* model, source::Diagnostics* diagnostics) {
  // Everything happens in Run; the object holds what its passes share.
  Checker(sources, keywords, model, diagnostics).Run();
}

// Beyond so many nobody reads on; a hostile text could cause one a word.
constexpr int kEnoughMessages = 100;

Diagnostic& Checker::Error(const Span& span, std::string message) {
  // The caller may add hints and notes to what is dropped as to what is kept.
  muted_ = {};
  if (phase_ != Phase::kFinal || ++errors_ > kEnoughMessages) return muted_;
  return diagnostics_.Error(span, std::move(message));
}

Diagnostic& Checker::Warning(const Span& span, std::string message) {
  muted_ = {};
  if (phase_ != Phase::kFinal || ++warnings_ > kEnoughMessages) return muted_;
  return diagnostics_.Warning(span, std::move(message));
}

Type Checker::Wrong(const Span& span, std::string message, std::string hint) {
  Error(span, std::move(message)).hint = std::move(hint);
  return Type::kError;
}

void Checker::Suggest(Diagnostic* error, const std::string& name,
                      const std::vector<std::string>& candidates, const std::string& prefix,
                      const std::string& otherwise) {
  if (error == &muted_) return;
  const std::string near = source::NearestName(name, candidates);
  error->hint = near.empty() ? otherwise : "did you mean '" + prefix + near + "'?";
}

// Gives a type that is not known yet; says whether it did.
bool Checker::Settle(Type* slot, Type type) {
  if (*slot != Type::kUnknown || type == Type::kUnknown || type == Type::kError ||
      type == Type::kVoid || phase_ == Phase::kFinal) {
    return false;
  }
  Change(slot, type);
  return true;
}

void Checker::Change(Type* slot, Type type) {
  changed_ = changed_ || *slot != type;
  *slot = type;
}

// Bodies say what they need (a parameter handed to jointRotateDegrees is a float); where they do
// not, calls say what is given; where neither does, a comparison or sum with a number must do.
void Checker::Run() {
  CheckConstants();
  // Each phase repeats until it finds nothing new: what one body needs may tell a parameter of
  // another.
  for (const Phase phase : {Phase::kBodies, Phase::kCalls, Phase::kDefaults}) {
    // Every round settles at least one type or is the last; programs need two or three.
    for (int round = 0; round < 100; ++round) {
      phase_ = phase;
      changed_ = false;
      Pass();
      if (!changed_) break;
    }
  }
  // Only now are types complete, so only now can what does not fit be told from what is not known
  // yet.
  phase_ = Phase::kFinal;
  for (Routine& routine : model_.routines) routine.calls.clear();
  Pass();
  // What follows needs the whole program.
  for (size_t i = 0; i < model_.roles.size(); ++i) CheckFieldsSet(static_cast<int>(i));
  CheckSignatures();
  CheckCalls();
}

void Checker::Pass() {
  for (size_t i = 0; i < model_.roles.size(); ++i) CheckFieldValues(static_cast<int>(i));
  for (size_t i = 0; i < model_.routines.size(); ++i) CheckRoutine(static_cast<int>(i));
}

void Checker::CheckFieldValues(int role) {
  RoleModel& model = model_.roles[role];
  routine_ = nullptr;
  role_ = role;
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
      const Type type = Infer(value);
      const std::optional<Type> joined = Join(decl.type, type);
      if (!joined) {
        Error(value->span,
              "field '" + decl.name + "' is " + NameOf(decl.type) + ", but this is " + NameOf(type))
            .Note(decl.type_span, "its type follows from this value");
        continue;
      }
      if (decl.type == Type::kUnknown) decl.type_span = value->span;
      if (*joined != Type::kVoid) Change(&decl.type, *joined);
      // `$ANY` alone is a direction once nothing else has been said.
      if (decl.type == Type::kAny && phase_ == Phase::kDefaults) {
        Change(&decl.type, Type::kDirection);
      }
      Want(value, decl.type, "the field '" + decl.name + "'");
    }
    // The image holds the value, so it must be known now.
    const FoldResult folded = Fold(*value);
    if (folded.value) slot.cell = folded.value->cell;
    if (!own || folded.value || value->type == Type::kError) continue;
    if (folded.fault != vm::FaultCode::kNone) {
      Error(value->span,
            std::string("value of the field cannot be computed: ") + vm::FaultName(folded.fault));
    } else {
      Error(value->span, "value of a field must be known at compile time").hint =
          "numbers, true, false, directions, axes and roles are; to name a joint or link, use a "
          "label";
    }
  }
}

void Checker::CheckRoutine(int index) {
  // Every pass finds locals and effect of the routine anew.
  Routine& routine = model_.routines[index];
  routine_ = &routine;
  role_ = routine.role;
  locals_.clear();
  loops_ = 0;
  routine.locals.clear();
  routine.local_names.clear();
  routine.effect = vm::Effect::kPure;
  Member& member = *routine.member;
  if (routine.kind == MemberKind::kRequire) {
    // A requirement is one expression, which must be a bool.
    Infer(member.expr.get());
    Want(member.expr.get(), Type::kBool, "a requirement");
    routine.result = Type::kBool;
    return;
  }
  if (routine.kind == MemberKind::kLabel) {
    // A label is one expression too; a set of joints or links stands for the one member that it
    // must have.
    const Type type = Infer(member.expr.get());
    // Of a label that has been found wrong nothing follows where it is used.
    routine.result = type == Type::kLink || type == Type::kLinkSet ? Type::kLink
                     : type == Type::kError                        ? Type::kError
                                                                   : Type::kJoint;
    if (type != Type::kError && type != Type::kUnknown && !Fits(type, routine.result)) {
      Error(member.expr->span, "a label names a joint or a link, but this is " + NameOf(type))
          .hint = "for example self.joints($ANY, 1), self.links(1) or a keyword such as $LINK_...";
    } else {
      Want(member.expr.get(), routine.result, "a label");
    }
    return;
  }
  if (member.period != nullptr) CheckPeriod(&member);
  // All others have a body, whose first locals are the parameters.
  Signature& signature = model_.signatures[routine.signature];
  for (size_t i = 0; i < member.parameters.size(); ++i) {
    AddLocal(member.parameters[i].name, member.parameters[i].span, signature.parameters[i], true);
  }
  routine.result = signature.result;
  CheckBlock(member.body.get());
  if (signature.result != Type::kVoid && !AlwaysReturns(*member.body)) {
    // The message points at the closing brace, behind which the result is missing.
    const size_t end = member.body->span.end;
    Error({member.body->span.file, end > 0 ? end - 1 : 0, end},
          "function '" + member.name + "' can end here without a result")
        .hint = "end it with 'return ...;' on every way";
  }
  CloseScope(0);
}

void Checker::CheckPeriod(Member* member) {
  Expr* period = member->period.get();
  Infer(period);
  Want(period, Type::kFloat, "a period");
  if (period->type == Type::kError) return;
  const FoldResult folded = Fold(*period);
  if (!folded.value || folded.value->type != Type::kFloat) {
    Error(period->span, "a period must be known at compile time").hint =
        "write a number of seconds or a constant";
    return;
  }
  member->period_s = folded.value->cell.AsFloat();
  if (member->period_s >= vm::kMinPeriodS && member->period_s <= vm::kMaxPeriodS) return;
  Error(period->span, "a period is a number of seconds from 0.001 to 1000000");
}

void Checker::CheckFieldsSet(int role) {
  const RoleModel& model = model_.roles[role];
  for (const FieldSlot& slot : model.fields) {
    const FieldDecl& decl = model_.fields[slot.decl];
    // Only concrete roles are played, so abstract ones may leave fields open.
    if (slot.value == nullptr && !model.role->abstract_role && !model.broken) {
      Error(model.role->name_span,
            "role '" + model.name + "' does not set the field '" + decl.name + "'")
          .Hint("give it a value: " + decl.name + " = ...; or make the role abstract")
          .Note(decl.span, "declared without a value here");
    }
  }
}

void Checker::CheckSignatures() {
  // One complaint a parameter, where it was first declared.
  for (const Routine& routine : model_.routines) {
    if (routine.signature < 0) continue;
    const Signature& signature = model_.signatures[routine.signature];
    // Routines that override each other share a signature; the first of them speaks for all.
    if (routine.member->name_span.begin != signature.span.begin) continue;
    for (size_t i = 0; i < signature.parameters.size(); ++i) {
      const Type type = signature.parameters[i];
      const Parameter& parameter = routine.member->parameters[i];
      if (type == Type::kUnknown) {
        Error(parameter.span, "cannot tell the type of the parameter '" + parameter.name + "'")
            .hint = "write it before the name, for example: float " + parameter.name;
      } else if (routine.kind == MemberKind::kCommand && ValueTypeOf(type) > vm::ValueType::kRole) {
        Error(parameter.span, "parameter '" + parameter.name + "' is " + NameOf(type) +
                                  ", which means nothing to another module")
            .hint = "commands take bools, ints, floats, directions, axes and roles";
      }
    }
  }
  // A field that no role sets has no type to find.
  std::vector<bool> is_set(model_.fields.size());
  for (const RoleModel& role : model_.roles) {
    for (const FieldSlot& slot : role.fields) {
      if (slot.value != nullptr) is_set[slot.decl] = true;
    }
  }
  for (size_t i = 0; i < model_.fields.size(); ++i) {
    const FieldDecl& decl = model_.fields[i];
    if (decl.type == Type::kUnknown && !is_set[i]) {
      Error(decl.span, "no role sets the field '" + decl.name + "', so it has no type").hint =
          "give it a value here or in a subrole";
    }
  }
}

void Checker::CheckCalls() {
  // Calls must end and fit the fixed stack of frames, whichever role is played.
  std::vector<int> path;
  heights_.assign(model_.routines.size(), 0);
  for (size_t i = 0; i < model_.routines.size(); ++i) {
    if (!VisitCalls(static_cast<int>(i), &path)) return;
  }
  for (const Routine& routine : model_.routines) CheckPurity(routine);
}

// Depth-first, every routine once: heights_ holds how many frames each needs.
bool Checker::VisitCalls(int index, std::vector<int>* path) {
  Routine& routine = model_.routines[index];
  int& height = heights_[index];
  // The routine stands on the path if it calls itself over others.
  const bool circle = std::find(path->begin(), path->end(), index) != path->end();
  const int frames = static_cast<int>(path->size()) + std::max(height, 1);
  if (circle || frames > vm::kMaxCallDepth) {
    // The hint shows the whole chain, as the call that closes it may stand far away.
    std::string chain;
    for (const int step : *path) chain += model_.routines[step].name + " -> ";
    Error(routine.member->name_span,
          circle ? "function '" + routine.member->name + "' calls itself" : "calls nest too deep")
        .hint = chain + routine.name +
                (circle ? "; use 'while' instead"
                        : "; at most " + std::to_string(vm::kMaxCallDepth) + " deep");
    return false;
  }
  if (height > 0) return true;
  // What a routine may do and how many frames it needs follows from all that it may call.
  path->push_back(index);
  int highest = 0;
  for (const int callee : model_.CalleesOf(routine)) {
    if (!VisitCalls(callee, path)) return false;
    highest = std::max(highest, heights_[callee]);
    routine.effect = std::max(routine.effect, model_.routines[callee].effect);
  }
  path->pop_back();
  height = highest + 1;
  return true;
}

void Checker::CheckPurity(const Routine& routine) {
  // What the routine itself does was checked where it stands; this is about what it calls.
  if (routine.kind != MemberKind::kRequire && routine.kind != MemberKind::kLabel) return;
  for (const CallSite& call : routine.calls) {
    const int callee =
        call.routine >= 0 ? call.routine : model_.roles[routine.role].methods[call.slot].routine;
    const Routine& called = model_.routines[callee];
    if (called.effect == vm::Effect::kPure) continue;
    Error(call.span, "function '" + called.member->name + "' acts on the module, which a " +
                         NameOf(routine.kind) + " must not")
        .Hint("requirements and labels only ask about the robot's structure")
        .Note(called.member->name_span, "declared here");
  }
}

}  // namespace morphbus::dynarole
