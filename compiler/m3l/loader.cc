#include "compiler/m3l/loader.h"

#include <system_error>

#include "compiler/m3l/lexer.h"
#include "compiler/m3l/parser.h"

namespace morphbus::m3l {
namespace {

// Far above any real model, low enough that neither the stack nor the list grows without bound.
constexpr size_t kMaxImportDepth = 64;
constexpr size_t kMaxFiles = 1000;
// A place that is in no file: the command line.
constexpr source::Span kNoPlace{-1, 0, 0};

/// The first word of a DynaRole program, if the file is one and no model; else nothing. Both
/// languages have constants, so that what follows them decides.
const Token* BeginningOfProgram(const std::vector<Token>& tokens) {
  for (size_t i = 0; i + 1 < tokens.size(); ++i) {
    const bool statement = StartsStatement(tokens, i);
    if (statement && tokens[i].text != "const") return nullptr;
    const bool role = tokens[i].text == "role" || tokens[i].text == "abstract";
    if (role && !statement && tokens[i + 1].kind == TokenKind::kWord) return &tokens[i];
  }
  return nullptr;
}

}  // namespace

void Loader::LoadPath(const std::string& path) { Load(path, kNoPlace); }

void Loader::LoadText(const std::string& name, const std::string& text) {
  // The text counts as a file that is being read, so that an import of its own name is a cycle.
  const std::filesystem::path path(name);
  std::error_code error;
  stack_.push_back({std::filesystem::weakly_canonical(path, error), kNoPlace});
  ParseFile(sources_.AddText(name, text), path.parent_path());
  stack_.pop_back();
}

void Loader::Load(const std::filesystem::path& path, const source::Span& import) {
  std::error_code error;
  // Files are told apart by their canonical path: two spellings of one file are one file.
  std::filesystem::path identity = std::filesystem::weakly_canonical(path, error);
  if (error) identity = path.lexically_normal();
  for (const Frame& frame : stack_) {
    if (frame.identity == identity) return ReportCycle(identity, import);
  }
  // A file that was read already counts once, wherever it was imported first.
  if (!seen_.emplace(identity, true).second) return;
  if (stack_.size() >= kMaxImportDepth || seen_.size() > kMaxFiles) {
    diagnostics_.Error(import, stack_.size() >= kMaxImportDepth
                                   ? "imports nest deeper than " + std::to_string(kMaxImportDepth)
                                   : "more than " + std::to_string(kMaxFiles) + " files");
    return;
  }
  const Result<int> file = AddFile(path, identity);
  if (!file) {
    diagnostics_.Error(import, file.error().message);
    return;
  }
  stack_.push_back({identity, import});
  ParseFile(*file, path.parent_path());
  stack_.pop_back();
}

Result<int> Loader::AddFile(const std::filesystem::path& path,
                            const std::filesystem::path& identity) {
  if (open_ != nullptr) {
    const auto text = open_->find(identity.string());
    if (text != open_->end()) return sources_.AddText(path.string(), text->second);
  }
  return sources_.AddFile(path.string());
}

void Loader::ParseFile(int file, const std::filesystem::path& directory) {
  // The bound on tokens is for all files together.
  const size_t most = kMaxTokens - tokens_;
  source::Diagnostics unreadable;
  std::vector<Token> tokens = Tokenize(sources_, file, most, &unreadable);
  // Of a text in another language every line is wrong; that it is one says all.
  if (const Token* word = BeginningOfProgram(tokens)) {
    diagnostics_.Error(word->span, "this is a DynaRole program, not a model")
        .Hint("where a command takes both, the model comes first: MODEL.m3l PROGRAM.dyn");
    return;
  }
  // What could not be read is reported only now that it is known to be meant as a model.
  if (!unreadable.all().empty()) tokens = Tokenize(sources_, file, most, &diagnostics_);
  tokens_ += tokens.size() - 1;
  FileAst ast = Parse(tokens, &diagnostics_);
  // Imported files are loaded before this one is added, so that their definitions come first.
  for (const ImportDecl& import : ast.imports) {
    // A path with a zero byte would silently name another file.
    if (import.path.empty() || import.path.find('\0') != std::string::npos) {
      diagnostics_.Error(import.span, "this is no file name");
    } else {
      Load(directory / import.path, import.span);
    }
  }
  if (dump_ == Dump::kTokens) output_.dump += DumpTokens(sources_, tokens);
  if (dump_ == Dump::kAst) output_.dump += DumpAst(ast);
  output_.files.push_back(std::move(ast));
}

void Loader::ReportCycle(const std::filesystem::path& identity, const source::Span& import) {
  // The files on the stack from the repeated one on are the cycle; each is told with the import
  // that led to it.
  size_t begin = 0;
  while (stack_[begin].identity != identity) ++begin;
  source::Diagnostic& d = diagnostics_.Error(
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

}  // namespace morphbus::m3l
