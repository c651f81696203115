#include "tools/lsp/edits.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compiler/base/utf8.h"
#include "compiler/dynarole/format.h"
#include "compiler/m3l/format.h"

namespace morphbus::tools {
namespace {

/// The diagnostics of a document and the texts that they refer to; the document is file 0.
struct Findings {
  const source::Diagnostics* diagnostics = nullptr;
  const source::SourceSet* sources = nullptr;
};

Findings FindingsOf(Workspace* workspace, const Document& document) {
  if (document.is_model()) {
    const ModelFile& model = workspace->Model(document.path);
    return {&model.compiled.diagnostics, &model.compiled.sources};
  }
  const ProgramFile& program = workspace->Program(document.path);
  return {&program.compiled.diagnostics, &program.compiled.sources};
}

/// An empty span covers the character behind it, so that there is something to see.
source::Span Visible(const source::SourceSet& sources, source::Span span) {
  const size_t size = sources.text(span.file).size();
  if (span.begin >= span.end) span.end = std::min(span.begin + 1, size);
  span.end = std::min(span.end, size);
  span.begin = std::min(span.begin, span.end);
  return span;
}

/// The document's own imports: paths, and where they stand.
std::vector<std::pair<std::string, source::Span>> ImportsOf(Workspace* workspace,
                                                            const Document& document) {
  std::vector<std::pair<std::string, source::Span>> imports;
  const auto add = [&imports](const auto& import) {
    if (import.span.file == 0) imports.emplace_back(import.path, import.span);
  };
  if (document.is_model()) {
    for (const m3l::FileAst& file : workspace->Model(document.path).compiled.files) {
      std::ranges::for_each(file.imports, add);
    }
  } else {
    std::ranges::for_each(workspace->Program(document.path).compiled.imports, add);
  }
  return imports;
}

/// Where in the document a diagnostic is shown: itself, or at the import of the file that it is
/// about. For a file that another import reads that is the first import.
source::Span PlaceOf(Workspace* workspace, const Document& document, const source::Span& span) {
  if (span.file == 0) return span;
  const Findings found = FindingsOf(workspace, document);
  const std::filesystem::path folder = std::filesystem::path(document.path).parent_path();
  const std::string wrong = span.file < 0 ? "" : CanonicalPath(found.sources->name(span.file));
  std::optional<source::Span> first;
  for (const auto& [path, import] : ImportsOf(workspace, document)) {
    if (CanonicalPath(folder / path) == wrong) return import;
    if (!first) first = import;
  }
  return first.value_or(source::Span{0, 0, 0});
}

/// "mtran.m3l:12: ": the place of what is not in the document.
std::string Elsewhere(const source::SourceSet& sources, const source::Span& span) {
  if (span.file <= 0) return "";
  return fmt::format("{}:{}: ", sources.name(span.file), sources.LineOf(span.file, span.begin));
}

Json RelatedOf(const Workspace& workspace, const source::SourceSet& sources,
               const source::Diagnostic& diagnostic, PositionEncoding encoding) {
  Json related = Json::array();
  for (const source::Note& note : diagnostic.notes) {
    if (note.span.file < 0) continue;
    related.push_back({{"location",
                        {{"uri", workspace.UriOf(CanonicalPath(sources.name(note.span.file)))},
                         {"range", RangeJson(sources, Visible(sources, note.span), encoding)}}},
                       {"message", note.message}});
  }
  return related;
}

Json DiagnosticJson(const Workspace& workspace, const Findings& found,
                    const source::Diagnostic& diagnostic, const source::Span& place,
                    PositionEncoding encoding) {
  std::string message = Elsewhere(*found.sources, diagnostic.span) + diagnostic.message;
  if (!diagnostic.hint.empty()) message += "\nhint: " + diagnostic.hint;
  Json json = {{"range", RangeJson(*found.sources, Visible(*found.sources, place), encoding)},
               {"severity", diagnostic.severity == source::Severity::kError ? 1 : 2},
               {"source", "morphbus"},
               {"message", message}};
  const Json related = RelatedOf(workspace, *found.sources, diagnostic, encoding);
  if (!related.empty()) json["relatedInformation"] = related;
  return json;
}

Json HintJson(const source::SourceSet& sources, size_t at, const std::string& label,
              PositionEncoding encoding) {
  return {{"position", PositionJson(sources, 0, at, encoding)}, {"label", label}, {"kind", 1}};
}

/// The number that each docking takes, where it does not say one.
Json DockingHints(const ModelFile& model, size_t begin, size_t end, PositionEncoding encoding) {
  Json hints = Json::array();
  if (!model.compiled.model) return hints;
  const source::SourceSet& sources = model.compiled.sources;
  for (size_t r = 0; r < model.compiled.dockings.size(); ++r) {
    for (size_t d = 0; d < model.compiled.dockings[r].size(); ++d) {
      const source::Span& span = model.compiled.dockings[r][d];
      if (span.file != 0 || span.end < begin || span.begin > end) continue;
      const std::string_view text = sources.text(span);
      // A number that stands there, alone or behind a name, needs no hint.
      const size_t second = text.find(',', text.find(',') + 1);
      if (second != std::string_view::npos && text.find("rot", second) == std::string_view::npos) {
        continue;
      }
      const model::Docking& docking = model.compiled.model->robots[r].dockings[d];
      const int number = model.compiled.model->OptionOf(docking).number;
      hints.push_back(HintJson(sources, span.end - 1, fmt::format(" :{}", number), encoding));
    }
  }
  return hints;
}

}  // namespace

Json DiagnosticsOf(Workspace* workspace, const Document& document, PositionEncoding encoding) {
  const Findings found = FindingsOf(workspace, document);
  Json list = Json::array();
  // That others import a text instead of running it is no fault of it.
  const bool library =
      document.is_program() && workspace->Program(document.path).compiled.is_library;
  for (const source::Diagnostic& diagnostic : found.diagnostics->all()) {
    if (library && diagnostic.message == dynarole::kNoRoles) continue;
    const source::Span place = PlaceOf(workspace, document, diagnostic.span);
    list.push_back(DiagnosticJson(*workspace, found, diagnostic, place, encoding));
  }
  return list;
}

Json InlayHintsOf(Workspace* workspace, const Document& document, size_t begin, size_t end,
                  PositionEncoding encoding) {
  if (document.is_model()) {
    return DockingHints(workspace->Model(document.path), begin, end, encoding);
  }
  const ProgramFile& program = workspace->Program(document.path);
  Json hints = Json::array();
  for (const source::InferredType& inferred : program.names.inferred) {
    if (inferred.span.file != 0 || inferred.span.end < begin || inferred.span.begin > end) continue;
    hints.push_back(
        HintJson(program.compiled.sources, inferred.span.end, ": " + inferred.type, encoding));
  }
  return hints;
}

Json FormattingOf(const Document& document, PositionEncoding encoding) {
  source::Diagnostics unsaid;
  const std::optional<std::string> formatted = document.is_model()
                                                   ? m3l::Format(document.sources, 0, &unsaid)
                                                   : dynarole::Format(document.sources, 0, &unsaid);
  if (!formatted || *formatted == document.text()) return Json::array();
  // Only what differs is replaced, so that the editor keeps its place.
  const std::string_view before = document.text(), after = *formatted;
  size_t same = 0;
  while (same < std::min(before.size(), after.size()) && before[same] == after[same]) ++same;
  while (same > 0 && same < after.size() && ContinuesCharacter(after[same])) --same;
  size_t tail = 0;
  while (tail < std::min(before.size(), after.size()) - same &&
         before[before.size() - 1 - tail] == after[after.size() - 1 - tail]) {
    ++tail;
  }
  while (tail > 0 && ContinuesCharacter(after[after.size() - tail])) --tail;
  const source::Span changed{0, same, before.size() - tail};
  return {{{"range", RangeJson(document.sources, changed, encoding)},
           {"newText", std::string(after.substr(same, after.size() - tail - same))}}};
}

Json FixesOf(Workspace* workspace, const Document& document, size_t begin, size_t end,
             PositionEncoding encoding) {
  const Findings found = FindingsOf(workspace, document);
  Json actions = Json::array();
  for (const source::Diagnostic& diagnostic : found.diagnostics->all()) {
    const source::Span& span = diagnostic.span;
    if (span.file != 0 || span.end < begin || span.begin > end) continue;
    std::string replacement = source::ReplacementIn(diagnostic);
    if (replacement.empty()) continue;
    // A sign of the proposal may stand before the span already: `self.`.
    const std::string_view before = document.text().substr(0, span.begin);
    const size_t sign = replacement.rfind('.') + 1;
    if (sign > 0 && before.ends_with(replacement.substr(0, sign))) replacement.erase(0, sign);
    actions.push_back(
        {{"title", fmt::format("Replace by '{}'", replacement)},
         {"kind", "quickfix"},
         {"isPreferred", true},
         {"diagnostics", {DiagnosticJson(*workspace, found, diagnostic, span, encoding)}},
         {"edit",
          {{"changes",
            {{document.uri,
              {{{"range", RangeJson(*found.sources, span, encoding)},
                {"newText", replacement}}}}}}}}});
  }
  return actions;
}

}  // namespace morphbus::tools
