#pragma once
// What the parts of the checker share in one pass over a program: whether messages are recorded,
// and what may settle a type.

#include <string>
#include <vector>

#include "compiler/dynarole/types.h"
#include "compiler/source/diagnostics.h"

namespace morphbus::dynarole {

/// What may settle types in a pass, the most telling first: what bodies need (a parameter handed to
/// jointRotateDegrees is a float), what calls give, what a number beside a parameter suggests. In
/// the last nothing does, and messages are recorded: only when types are complete can what does not
/// fit be told from what is not known yet.
enum class Phase : uint8_t { kBodies, kCalls, kDefaults, kFinal };

/// The passes of the checker, one after the other.
class CheckPass {
 public:
  /// `diagnostics` must outlive it. Begins in the final phase, for what needs one pass only.
  explicit CheckPass(source::Diagnostics* diagnostics) : diagnostics_(*diagnostics) {}

  /// Begins another pass.
  void Begin(Phase phase);
  [[nodiscard]] Phase phase() const { return phase_; }
  /// Whether messages are recorded in this pass.
  [[nodiscard]] bool is_final() const { return phase_ == Phase::kFinal; }
  /// A type was settled in this pass, so that another must follow.
  [[nodiscard]] bool changed() const { return changed_; }
  /// An error has been recorded, by whichever stage of the compiler.
  [[nodiscard]] bool had_errors() const { return diagnostics_.had_errors(); }

  // Messages are recorded in the final pass only; before it the caller gets one that is dropped.
  // The reference is good until the next message, for adding a hint or a note.
  source::Diagnostic& Error(const source::Span& span, std::string message);
  source::Diagnostic& Warning(const source::Span& span, std::string message);
  /// An error in an expression, whose type is then this: kError.
  Type Wrong(const source::Span& span, std::string message, std::string hint = "");
  /// Gives the error a hint: the candidate nearest to `name`, behind `prefix`, or `otherwise`.
  void Suggest(source::Diagnostic* error, const std::string& name,
               const std::vector<std::string>& candidates, const std::string& prefix = "",
               const std::string& otherwise = "");

  /// Gives a type that is not known yet, unless the pass is the final one; says whether it did.
  bool Settle(Type* slot, Type type);
  /// Gives another type, if it is another.
  void Change(Type* slot, Type type);

 private:
  source::Diagnostics& diagnostics_;
  source::Diagnostic muted_;  ///< What Error() and Warning() hand out where nothing is recorded.
  Phase phase_ = Phase::kFinal;
  bool changed_ = false;
  int errors_ = 0, warnings_ = 0;  ///< Recorded so far.
};

}  // namespace morphbus::dynarole
