#include "compiler/dynarole/scope.h"

#include <algorithm>
#include <utility>

#include "vm/image/image.h"

namespace morphbus::dynarole {

using source::Span;

// Passes before may have known less, so nothing that they found out about the routine is kept.
void Scope::EnterRoutine(int index) {
  Routine& routine = model_.routines[index];
  routine_ = &routine;
  role_ = routine.role;
  locals_.clear();
  hidden_.clear();
  routine.locals.clear();
  routine.local_names.clear();
  // What the routine calls is added when the whole program has been checked.
  routine.effect = vm::Effect::kPure;
}

// A value is no routine: it has no variables and no effect.
void Scope::EnterValue(int role) {
  routine_ = nullptr;
  role_ = role;
  locals_.clear();
  hidden_.clear();
}

bool Scope::InTask() const {
  return routine_ != nullptr && routine_->kind != MemberKind::kRequire &&
         routine_->kind != MemberKind::kLabel;
}

// Instructions that act cannot stand in requirements and labels, which are evaluated at any time.
void Scope::Uses(vm::Opcode opcode, const Span& span, const std::string& name) {
  // A field's value has no routine, and is refused elsewhere.
  // The strongest effect of all instructions is that of the routine.
  const vm::Effect effect = vm::InfoOf(opcode).effect;
  if (routine_ == nullptr) return;
  routine_->effect = std::max(routine_->effect, effect);
  if (effect != vm::Effect::kPure && !InTask()) {
    pass_
        .Error(span,
               "'" + name + "' acts on the module, which a " + NameOf(routine_->kind) + " must not")
        .hint = "requirements and labels only ask about the robot's structure";
  }
}

int Scope::AddLocal(const std::string& name, const Span& span, Type type, bool parameter) {
  return Declare(name, span, type, parameter, 0);
}

int Scope::AddArray(const std::string& name, const Span& span, Type type, int length) {
  return Declare(name, span, type, false, length);
}

int Scope::Declare(const std::string& name, const Span& span, Type type, bool parameter,
                   int length) {
  // A name is declared once in a scope and all scopes around it.
  if (const Local* before = FindLocal(name)) {
    pass_.Error(span, "'" + name + "' is declared twice").Note(before->span, "first declared here");
  }
  // One more than fits is enough to say so; the rest would only cost time.
  if (routine_->locals.size() > vm::image::kMaxLocals) {
    return static_cast<int>(routine_->locals.size()) - 1;
  }
  Local local;
  local.name = name;
  local.span = span;
  local.parameter = parameter;
  local.used = FindLocal(name) != nullptr;  // One complaint is enough.
  local.length = length;
  local.slot = AddSlot(length > 0 ? name + "[0]" : name, span, type);
  // All that do not fit are one error.
  for (int i = 1; i < length && routine_->locals.size() <= vm::image::kMaxLocals; ++i) {
    AddSlot(name + "[" + std::to_string(i) + "]", span, type);
  }
  locals_.push_back(std::move(local));
  return locals_.back().slot;
}

int Scope::Hidden(const std::string& purpose, const Span& span, Type type, int use) {
  const auto [slot, fresh] = hidden_.try_emplace({type, use}, 0);
  if (fresh) slot->second = AddSlot(purpose, span, type);
  return slot->second;
}

// Slots are never used again, so that the verifier can give each one type.
int Scope::AddSlot(const std::string& name, const Span& span, Type type) {
  if (routine_->locals.size() == vm::image::kMaxLocals) {
    pass_.Error(span, "too many variables and parameters").hint =
        "at most " + std::to_string(vm::image::kMaxLocals) +
        ", of which each element of an array is one; split it into functions";
  }
  if (routine_->locals.size() <= vm::image::kMaxLocals) {
    routine_->locals.push_back(type);
    routine_->local_names.push_back(name);
  }
  return static_cast<int>(routine_->locals.size()) - 1;
}

// Names are unique among the locals in scope, so the first one found is the only one.
Local* Scope::FindLocal(const std::string& name) {
  for (Local& local : locals_) {
    if (local.name == name) return &local;
  }
  return nullptr;
}

bool Scope::IsNeighbour(const Expr& expr) {
  const bool named = expr.kind == ExprKind::kName && expr.meaning == Meaning::kLocal;
  const Local* local = named ? FindLocal(expr.name) : nullptr;
  return local != nullptr && local->neighbour;
}

void Scope::Close(size_t size) {
  for (size_t i = size; i < locals_.size(); ++i) {
    if (!locals_[i].used && !locals_[i].parameter) {
      pass_.Warning(locals_[i].span, "variable '" + locals_[i].name + "' is never used");
    }
  }
  // Their slots stay taken, so that a later variable of the same name gets another.
  locals_.resize(std::min(size, locals_.size()));
}

std::vector<std::string> Scope::Names() const {
  std::vector<std::string> names;
  for (const Local& local : locals_) names.push_back(local.name);
  for (const FieldSlot& slot : role().fields) {
    const FieldDecl& decl = model_.fields[slot.decl];
    if (decl.element == 0) names.push_back(decl.declared_name());
  }
  // Constants of other roles mean nothing here.
  for (const ConstantModel& constant : model_.constants) {
    if (constant.role < 0 || model_.IsA(role_, constant.role)) names.push_back(constant.name);
  }
  return names;
}

}  // namespace morphbus::dynarole
