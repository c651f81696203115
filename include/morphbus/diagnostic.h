#pragma once
// What the compilers of M3L and DynaRole say about a text.

#include <morphbus/failure.h>

#include <string>
#include <utility>
#include <vector>

namespace morphbus {

/// A stretch of a text. Lines and columns are counted from 1, columns in characters (code points of
/// UTF-8); the end is the character behind the last one.
struct TextRange {
  /// The file's name as it was given, or found by an import; empty where no text is to blame.
  std::string file;
  int line = 1;
  int column = 1;
  int end_line = 1;
  int end_column = 1;
};

/// A further place that explains a diagnostic: "first used here".
struct DiagnosticNote {
  TextRange where;
  std::string message;
};

/// One error or warning.
struct Diagnostic {
  /// Errors make a compilation fail; warnings do not.
  bool is_error = true;
  TextRange where;
  /// One sentence that begins in lower case, without a full stop.
  std::string message;
  /// What would be accepted instead, or the way out; it may be empty.
  std::string hint;
  std::vector<DiagnosticNote> notes;
};

/// Thrown by the compilers for a text with errors. what() is all of the diagnostics as the command
/// line prints them, with the lines of the text and carets under them.
class MORPHBUS_EXPORT TextError : public Failure {
 public:
  TextError(const std::string& text, std::vector<Diagnostic> diagnostics)
      : Failure(text), diagnostics_(std::move(diagnostics)) {}
  /// Errors and warnings, in the order of their places.
  [[nodiscard]] const std::vector<Diagnostic>& diagnostics() const { return diagnostics_; }

 private:
  std::vector<Diagnostic> diagnostics_;
};

}  // namespace morphbus
