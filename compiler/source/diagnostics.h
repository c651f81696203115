#pragma once
// Diagnostics for user text: a list, never exceptions; compilation goes on after an error.

#include <optional>
#include <string>
#include <vector>

#include "compiler/source/source_text.h"

namespace morphbus::source {

/// Errors make a compilation fail, warnings do not.
enum class Severity { kError, kWarning };

/// A further place that explains a diagnostic ("first used here").
struct Note {
  /// The place that is shown, with a caret line under it.
  Span span;
  std::string message;
};

/// One error or warning about user text. A stage makes it by Diagnostics::Error or Warning, and the
/// compiler's caller prints all of them at the end.
struct Diagnostic {
  Severity severity = Severity::kError;
  /// The place of the text that is wrong; file -1 stands for the command line.
  Span span;
  /// One sentence that begins in lower case, without a full stop.
  std::string message;
  /// What would be accepted instead, or the way out; it may be empty.
  std::string hint;
  /// Further places, in the order in which they are printed.
  std::vector<struct Note> notes;

  /// Sets the hint, and returns the diagnostic for more to be said of it.
  Diagnostic& Hint(std::string text);
  /// Adds a note, likewise.
  Diagnostic& Note(const Span& at, std::string text);
  /// Nothing, so that a function without a result for what is wrong reports it in its return
  /// statement.
  template <typename T>
  operator std::optional<T>() const {
    return std::nullopt;
  }
};

/// The diagnostics of one compilation, in the order in which they were found.
class Diagnostics {
 public:
  /// Errors beyond this many are counted but not kept: they would not be read.
  static constexpr int kMaxErrors = 200;

  /// Records an error and returns it, so that a hint or notes can be added at once (the reference
  /// is valid until the next call).
  Diagnostic& Error(const Span& span, std::string message);
  /// The same for a warning, which does not stop anything.
  Diagnostic& Warning(const Span& span, std::string message);

  /// True if the compilation has failed. Warnings do not count.
  [[nodiscard]] bool had_errors() const { return errors_ > 0; }
  /// Number of errors so far; a stage compares it before and after to know whether a part is sound.
  [[nodiscard]] int error_count() const { return errors_; }
  /// True when further errors are not kept; loops over user text may stop then.
  [[nodiscard]] bool full() const { return errors_ >= kMaxErrors; }
  /// All that was kept, in the order in which it was found; Render sorts by place.
  [[nodiscard]] const std::vector<Diagnostic>& all() const { return all_; }

 private:
  std::vector<Diagnostic> all_;
  /// What Error() hands out when the list is full or has this already; it is never shown.
  Diagnostic surplus_;
  int errors_ = 0;
};

/// All of them by their places; those at one place in the order in which they were found. The
/// pointers are good as long as `diagnostics` is not changed.
std::vector<const Diagnostic*> ByPlace(const Diagnostics& diagnostics);

/// Text for stderr, sorted by place: `file:line:column: error: message`, the source line, a caret
/// line under the span, `hint:` and `note:` lines. `color` adds ANSI colours.
std::string Render(const Diagnostics& diagnostics, const SourceSet& sources, bool color);

/// One further place for stderr or an explanation: `file:line:column: note: message` and the source
/// line with a caret line.
std::string RenderNote(const Note& note, const SourceSet& sources, bool color);

/// The candidate that differs from `name` in capitals only, else the nearest by edit distance, if
/// near enough to be a likely slip; else "".
std::string NearestName(const std::string& name, const std::vector<std::string>& candidates);

/// "did you mean 'x'?" for the nearest name x, `otherwise` if there is none.
std::string NearestHint(const std::string& name, const std::vector<std::string>& candidates,
                        const std::string& otherwise = "");

/// What the hint of a diagnostic proposes in place of its span, for editors that can put it there:
/// the name of "did you mean 'x'?", of a call without what stands in its parentheses. Empty for all
/// other hints.
std::string ReplacementIn(const Diagnostic& diagnostic);

/// Reports one error at the first byte of file `file` that is not UTF-8, if there is one: before
/// anything is made of it, so that names, strings and excerpts can go to JSON, XML and terminals as
/// they are.
void CheckUtf8(const SourceSet& sources, int file, Diagnostics* diagnostics);

}  // namespace morphbus::source
