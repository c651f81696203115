#include "compiler/source/diagnostics.h"

#include <algorithm>
#include <tuple>

#include "compiler/base/nearest_name.h"
#include "compiler/base/text.h"
#include "compiler/base/utf8.h"

namespace morphbus::source {
namespace {

// An excerpt shows at most this many bytes of a line, so that a file of one endless line stays
// readable (and rendering stays linear).
constexpr size_t kExcerptBytes = 160;

/// Terminal codes for the parts of a diagnostic; all empty without colours.
struct Colors {
  std::string bold, red, magenta, cyan, green, reset;
};

Colors MakeColors(bool color) {
  if (!color) return {};
  return {"\033[1m", "\033[1;31m", "\033[1;35m", "\033[1;36m", "\033[1;32m", "\033[0m"};
}

/// The byte at `i` of a line as it can go to a terminal: control characters and what is not UTF-8
/// would upset it; a tab is kept so that the caret stays aligned. Columns count no stray
/// continuation bytes, so none is shown.
std::string_view Shown(std::string_view line, size_t i) {
  const auto byte = static_cast<unsigned char>(line[i]);
  if (byte < 0x80) return (byte < 0x20 && byte != '\t') || byte == 0x7F ? "?" : line.substr(i, 1);
  if (!ContinuesCharacter(line[i])) return Utf8Length(line, i) > 0 ? line.substr(i, 1) : "?";
  for (size_t back = 1; back <= 3 && back <= i; ++back) {
    if (ContinuesCharacter(line[i - back])) continue;
    return Utf8Length(line, i - back) > back ? line.substr(i, 1) : "";
  }
  return "";
}

/// `file:line:column: `, or nothing for a place in no file.
std::string Place(const Span& span, const SourceSet& sources) {
  if (span.file < 0 || span.file >= sources.size()) return "";
  const LineColumn at = sources.Locate(span.file, span.begin);
  return sources.name(span.file) + ":" + std::to_string(at.line) + ":" + std::to_string(at.column) +
         ": ";
}

/// The source line and a caret line under the span; nothing for an empty or absent file.
std::string Excerpt(const Span& span, const SourceSet& sources, const Colors& colors) {
  if (span.file < 0 || span.file >= sources.size() || sources.text(span.file).empty()) return "";
  const std::string_view line = sources.LineAt(span.file, span.begin);
  // The place within the line; a span may begin behind its end.
  const size_t line_begin = static_cast<size_t>(line.data() - sources.text(span.file).data());
  const size_t at = std::min(span.begin - std::min(span.begin, line_begin), line.size());

  // Of a long line, show the part around the span, cut between characters.
  size_t from = at > kExcerptBytes / 2 ? at - kExcerptBytes / 2 : 0;
  if (line.size() <= kExcerptBytes) from = 0;
  size_t to = std::min(line.size(), from + kExcerptBytes);
  while (from > 0 && ContinuesCharacter(line[from])) --from;
  while (to < line.size() && ContinuesCharacter(line[to])) ++to;

  // The caret line copies tabs, so that it stays aligned under the text.
  std::string text = from > 0 ? "..." : "";
  std::string caret = from > 0 ? "   " : "";
  for (size_t i = from; i < to; ++i) {
    const char c = line[i];
    text += Shown(line, i);
    if (i < at && !ContinuesCharacter(c)) caret += c == '\t' ? '\t' : ' ';
  }
  if (to < line.size()) text += "...";
  // Carets are counted in characters, not in bytes.
  size_t width = 0;
  const size_t end = std::min(to, at + (span.end > span.begin ? span.end - span.begin : 0));
  for (size_t i = at; i < end; ++i) width += ContinuesCharacter(line[i]) ? 0 : 1;
  const std::string marks = "^" + std::string(width > 1 ? width - 1 : 0, '~');
  return "  " + text + "\n  " + caret + colors.green + marks + colors.reset + "\n";
}

/// A note with its place and excerpt.
std::string NoteText(const Note& note, const SourceSet& sources, const Colors& colors) {
  return colors.bold + Place(note.span, sources) + colors.cyan + "note: " + colors.reset +
         note.message + "\n" + Excerpt(note.span, sources, colors);
}

void RenderOne(const Diagnostic& d, const SourceSet& sources, const Colors& colors,
               std::string& out) {
  // The headline has the place, the severity and the message.
  const bool error = d.severity == Severity::kError;
  out += colors.bold + Place(d.span, sources) + colors.reset;
  out += (error ? colors.red + "error: " : colors.magenta + "warning: ") + colors.reset;
  out += colors.bold + d.message + colors.reset + "\n";
  out += Excerpt(d.span, sources, colors);
  // What helps to mend it stands below the source line.
  if (!d.hint.empty()) out += "  " + colors.green + "hint: " + colors.reset + d.hint + "\n";
  for (const Note& note : d.notes) out += NoteText(note, sources, colors);
}

}  // namespace

Diagnostic& Diagnostic::Hint(std::string text) {
  hint = std::move(text);
  return *this;
}

Diagnostic& Diagnostic::Note(const Span& at, std::string text) {
  notes.push_back({at, std::move(text)});
  return *this;
}

Diagnostic& Diagnostics::Error(const Span& span, std::string message) {
  ++errors_;
  // The first error beyond the bound says so; the others are only counted.
  if (errors_ > kMaxErrors) {
    if (errors_ == kMaxErrors + 1) {
      all_.push_back({Severity::kError, span, "too many errors, no more are shown", "", {}});
    }
    surplus_ = {};
    return surplus_;
  }
  // What stands in the text once may be looked at for each element of an array: it is told once.
  const auto told = [&](const Diagnostic& d) {
    return d.severity == Severity::kError && d.span.file == span.file &&
           d.span.begin == span.begin && d.span.end == span.end && d.message == message;
  };
  if (std::ranges::any_of(all_, told)) {
    surplus_ = {};
    return surplus_;
  }
  all_.push_back({Severity::kError, span, std::move(message), "", {}});
  return all_.back();
}

Diagnostic& Diagnostics::Warning(const Span& span, std::string message) {
  all_.push_back({Severity::kWarning, span, std::move(message), "", {}});
  return all_.back();
}

std::vector<const Diagnostic*> ByPlace(const Diagnostics& diagnostics) {
  std::vector<const Diagnostic*> order;
  for (const Diagnostic& d : diagnostics.all()) order.push_back(&d);
  // The sort is stable, so that diagnostics at one place keep the order in which they were found.
  std::stable_sort(order.begin(), order.end(), [](const Diagnostic* a, const Diagnostic* b) {
    return std::tie(a->span.file, a->span.begin) < std::tie(b->span.file, b->span.begin);
  });
  return order;
}

std::string Render(const Diagnostics& diagnostics, const SourceSet& sources, bool color) {
  const Colors colors = MakeColors(color);
  std::string out;
  for (const Diagnostic* d : ByPlace(diagnostics)) RenderOne(*d, sources, colors, out);
  return out;
}

std::string RenderNote(const Note& note, const SourceSet& sources, bool color) {
  return NoteText(note, sources, MakeColors(color));
}

std::string NearestName(const std::string& name, const std::vector<std::string>& candidates) {
  return morphbus::NearestName(name, candidates);
}

std::string NearestHint(const std::string& name, const std::vector<std::string>& candidates,
                        const std::string& otherwise) {
  const std::string near = NearestName(name, candidates);
  return near.empty() ? otherwise : "did you mean '" + near + "'?";
}

std::string ReplacementIn(const Diagnostic& diagnostic) {
  constexpr std::string_view kBegin = "did you mean '", kEnd = "'?";
  const std::string_view hint = diagnostic.hint;
  if (!hint.starts_with(kBegin) || !hint.ends_with(kEnd)) return "";
  std::string_view name = hint.substr(kBegin.size());
  name.remove_suffix(kEnd.size());
  // Two names are a question that nobody can answer for the user.
  if (name.find('\'') != std::string_view::npos) return "";
  // Of several forms of a call the name is the same.
  name = name.substr(0, name.find(" or "));
  return std::string(name.substr(0, name.find('(')));
}

void CheckUtf8(const SourceSet& sources, int file, Diagnostics* diagnostics) {
  const std::string_view text = sources.text(file);
  const size_t at = FirstNotUtf8(text);
  if (at == text.size()) return;
  // One error is enough: a file in another encoding has thousands of such bytes.
  const bool more = FirstNotUtf8(text, at + 1) < text.size();
  // The message names the byte, which tells one encoding from another.
  diagnostics
      ->Error({file, at, at + 1}, "byte \\x" + Hex(static_cast<unsigned char>(text[at]), 2) +
                                      " is not UTF-8" + (more ? ", nor are others" : ""))
      .hint = "save the file as UTF-8";
}

}  // namespace morphbus::source
