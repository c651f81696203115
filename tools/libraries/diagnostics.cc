#include "tools/libraries/diagnostics.h"

#include <algorithm>
#include <utility>

namespace morphbus {
namespace {

/// The place of a span. The command line, which is file -1, is no text.
TextRange ToPublic(const source::Span& span, const source::SourceSet& sources) {
  TextRange range;
  if (span.file < 0) return range;
  const source::LineColumn begin = sources.Locate(span.file, span.begin);
  const source::LineColumn end = sources.Locate(span.file, std::max(span.begin, span.end));
  return {sources.name(span.file), begin.line, begin.column, end.line, end.column};
}

Diagnostic ToPublic(const source::Diagnostic& diagnostic, const source::SourceSet& sources) {
  Diagnostic told = {diagnostic.severity == source::Severity::kError,
                     ToPublic(diagnostic.span, sources),
                     diagnostic.message,
                     diagnostic.hint,
                     {}};
  for (const source::Note& note : diagnostic.notes) {
    told.notes.push_back({ToPublic(note.span, sources), note.message});
  }
  return told;
}

}  // namespace

void ThrowOnErrors(const source::Diagnostics& diagnostics, const source::SourceSet& sources,
                   std::vector<Diagnostic>* warnings) {
  std::vector<Diagnostic> told;
  for (const source::Diagnostic* one : source::ByPlace(diagnostics)) {
    told.push_back(ToPublic(*one, sources));
  }
  if (diagnostics.had_errors()) {
    throw TextError(source::Render(diagnostics, sources, false), std::move(told));
  }
  if (warnings != nullptr) *warnings = std::move(told);
}

std::string FormatOrThrow(const std::string& name, const std::string& text,
                          std::optional<std::string> (*format)(const source::SourceSet& sources,
                                                               int file,
                                                               source::Diagnostics* diagnostics)) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText(name, text);
  std::optional<std::string> formatted = format(sources, file, &diagnostics);
  ThrowOnErrors(diagnostics, sources, nullptr);
  return formatted.value_or(std::string());
}

}  // namespace morphbus
