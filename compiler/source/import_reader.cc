#include "compiler/source/import_reader.h"

#include <system_error>
#include <utility>

namespace morphbus::source {
namespace {

// Far above any real model or program, low enough that neither the stack nor the list grows without
// bound.
constexpr size_t kMaxImportDepth = 64;
constexpr size_t kMaxFiles = 1000;
// A place that is in no file: the command line.
constexpr Span kNoPlace{-1, 0, 0};

}  // namespace

std::filesystem::path CanonicalPath(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::path canonical = std::filesystem::weakly_canonical(path, error);
  return error ? path.lexically_normal() : canonical;
}

TextReader ReaderOf(const OpenTexts* open) {
  return [open](const std::string& path) -> Result<std::string> {
    if (open != nullptr) {
      const auto text = open->find(CanonicalPath(path).string());
      if (text != open->end()) return text->second;
    }
    return ReadSourceFile(path);
  };
}

void ImportReader::LoadPath(const std::string& path) { Load(path, kNoPlace); }

void ImportReader::LoadText(const std::string& name, const std::string& text) {
  if (!Accepts(text, kNoPlace)) return;
  // The text counts as a file that is being read, so that an import of its own name is a cycle.
  const std::filesystem::path path(name);
  stack_.push_back({CanonicalPath(path), path.parent_path(), kNoPlace});
  Parse(sources_.AddText(name, text));
  stack_.pop_back();
}

bool ImportReader::Accepts(const std::string&, const Span&) { return true; }

void ImportReader::Import(const std::string& path, const Span& span) {
  // A path with a zero byte would silently name another file.
  if (path.empty() || path.find('\0') != std::string::npos) {
    diagnostics_.Error(span, "this is no file name");
  } else {
    Load(stack_.back().directory / path, span);
  }
}

void ImportReader::Load(const std::filesystem::path& path, const Span& import) {
  // Files are told apart by their canonical path: two spellings of one file are one file.
  std::filesystem::path identity = CanonicalPath(path);
  for (const Frame& frame : stack_) {
    if (frame.identity == identity) return ReportCycle(identity, import);
  }
  // A file that was read already counts once, wherever it was imported first.
  if (!seen_.insert(identity).second) return;
  if (stack_.size() >= kMaxImportDepth || seen_.size() > kMaxFiles) {
    diagnostics_.Error(import, stack_.size() >= kMaxImportDepth
                                   ? "imports nest deeper than " + std::to_string(kMaxImportDepth)
                                   : "more than " + std::to_string(kMaxFiles) + " files");
    return;
  }
  const Result<std::string> text = read_(path.string());
  if (!text) {
    diagnostics_.Error(import, text.error().message);
    return;
  }
  if (!Accepts(*text, import)) return;
  stack_.push_back({std::move(identity), path.parent_path(), import});
  Parse(sources_.AddText(path.string(), *text));
  stack_.pop_back();
}

void ImportReader::ReportCycle(const std::filesystem::path& identity, const Span& import) {
  // The files on the stack from the repeated one on are the cycle; each is told with the import
  // that led to it.
  size_t begin = 0;
  while (stack_[begin].identity != identity) ++begin;
  Diagnostic& d = diagnostics_.Error(
      import, begin + 1 == stack_.size() ? "a file cannot import itself"
                                         : "import cycle: '" + identity.filename().string() +
                                               "' is itself still being read");
  for (size_t i = begin + 1; i < stack_.size(); ++i) {
    d.notes.push_back(
        {stack_[i].import, "which imports '" + stack_[i].identity.filename().string() + "' here"});
  }
  if (d.notes.empty() && stack_[begin].import.file >= 0) {
    d.notes.push_back({stack_[begin].import, "it is first imported here"});
  }
}

}  // namespace morphbus::source
