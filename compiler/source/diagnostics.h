#pragma once
// Diagnostics for user text: a list, never exceptions; compilation goes on after an error.

#include <string>
#include <vector>

#include "compiler/source/source_text.h"

namespace morphbus::source {

enum class Severity { kError, kWarning };

/// A further place that explains a diagnostic ("first used here").
struct Note {
  Span span;
  std::string message;
};

struct Diagnostic {
  Severity severity = Severity::kError;
  Span span;
  std::string message;  ///< One sentence, lower case first, no full stop.
  std::string hint;     ///< What would be accepted; may be empty.
  std::vector<Note> notes;
};

class Diagnostics {
 public:
  /// Errors beyond this many are counted but not kept: nobody reads them.
  static constexpr int kMaxErrors = 200;

  /// Records an error and returns it, so that a hint or notes can be added at once (the reference
  /// is valid until the next call).
  Diagnostic& Error(const Span& span, std::string message);
  Diagnostic& Warning(const Span& span, std::string message);

  [[nodiscard]] bool had_errors() const { return errors_ > 0; }
  /// Number of errors so far; a stage compares it before and after to know whether a part is sound.
  [[nodiscard]] int error_count() const { return errors_; }
  /// True when further errors are not kept; loops over user text may stop then.
  [[nodiscard]] bool full() const { return errors_ >= kMaxErrors; }
  [[nodiscard]] const std::vector<Diagnostic>& all() const { return all_; }

 private:
  std::vector<Diagnostic> all_;
  Diagnostic surplus_;  ///< What Error() hands out when full.
  int errors_ = 0;
};

/// Text for stderr, sorted by place: `file:line:column: error: message`, the source line, a caret
/// line under the span, `hint:` and `note:` lines. `color` adds ANSI colours.
std::string Render(const Diagnostics& diagnostics, const SourceSet& sources, bool color);

/// One further place for stderr or an explanation: `file:line:column: note: message` and the source
/// line with a caret line.
std::string RenderNote(const Note& note, const SourceSet& sources, bool color);

/// The candidate nearest to `name` by edit distance, if near enough to be a likely slip; else "".
std::string NearestName(const std::string& name, const std::vector<std::string>& candidates);

}  // namespace morphbus::source
