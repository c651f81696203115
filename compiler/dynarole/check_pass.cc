#include "compiler/dynarole/check_pass.h"

#include <utility>

namespace morphbus::dynarole {

using source::Diagnostic;
using source::Span;

// Beyond so many nobody reads on; a hostile text could cause one a word.
constexpr int kEnoughMessages = 100;

void CheckPass::Begin(Phase phase) {
  phase_ = phase;
  changed_ = false;
}

Diagnostic& CheckPass::Error(const Span& span, std::string message) {
  // The caller may add hints and notes to what is dropped as to what is kept.
  muted_ = {};
  if (!is_final() || ++errors_ > kEnoughMessages) return muted_;
  return diagnostics_.Error(span, std::move(message));
}

// Errors and warnings are counted apart, so that many of one kind leave room for the other.
Diagnostic& CheckPass::Warning(const Span& span, std::string message) {
  muted_ = {};
  if (!is_final() || ++warnings_ > kEnoughMessages) return muted_;
  return diagnostics_.Warning(span, std::move(message));
}

Type CheckPass::Wrong(const Span& span, std::string message, std::string hint) {
  Error(span, std::move(message)).hint = std::move(hint);
  return Type::kError;
}

void CheckPass::Suggest(Diagnostic* error, const std::string& name,
                        const std::vector<std::string>& candidates, const std::string& prefix,
                        const std::string& otherwise) {
  // Looking for the nearest name takes long, and in all but the final pass it would be dropped.
  if (error == &muted_) return;
  const std::string near = source::NearestName(name, candidates);
  error->hint = near.empty() ? otherwise : "did you mean '" + prefix + near + "'?";
}

bool CheckPass::Settle(Type* slot, Type type) {
  // What is known stays: the first to tell a type decides. The final pass must find what the others
  // have left, and not change it.
  if (*slot != Type::kUnknown || type == Type::kUnknown || type == Type::kError ||
      type == Type::kVoid || is_final()) {
    return false;
  }
  Change(slot, type);
  return true;
}

// What is set to what it was begins no further pass, so that the passes come to an end.
void CheckPass::Change(Type* slot, Type type) {
  changed_ = changed_ || *slot != type;
  *slot = type;
}

}  // namespace morphbus::dynarole
