#include "compiler/dynarole/loader.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <string_view>
#include <utility>

#include "compiler/dynarole/dump.h"
#include "compiler/dynarole/lexer.h"
#include "compiler/dynarole/names_used.h"
#include "compiler/dynarole/parser.h"

namespace morphbus::dynarole {
namespace {

constexpr size_t kMaxTextBytes = size_t{1} << 20;
/// An image counts lines with 16 bits, over all files.
constexpr int kMaxLines = 65535;

/// The first word of an M3L model, if the text is one and no program; else nothing. Both languages
/// have constants and imports, so that what follows them decides, or what is imported.
std::optional<source::Span> BeginningOfModel(const source::SourceSet& sources, int file,
                                             const std::vector<Token>& tokens) {
  constexpr std::string_view kStatements[] = {"module", "connection", "robot"};
  for (size_t i = 0; i + 1 < tokens.size(); ++i) {
    if (tokens[i].kind == TokenKind::kRole || tokens[i].kind == TokenKind::kAbstract) break;
    const source::Span& span = tokens[i].span;
    const std::string_view word = sources.text(file).substr(span.begin, span.end - span.begin);
    const bool named = tokens[i + 1].kind == TokenKind::kName;
    if (named && std::ranges::count(kStatements, word) > 0) return span;
    const std::string_view next = sources.text(tokens[i + 1].span);
    if (word == "import" && next.ends_with(".m3l\"")) return span;
    if (word == "import" && next.ends_with(".dyn\"")) break;
  }
  return std::nullopt;
}

/// Moves the elements of one list to the end of another.
template <typename T>
void MoveTo(std::vector<T>* all, std::vector<T> more) {
  all->insert(all->end(), std::make_move_iterator(more.begin()),
              std::make_move_iterator(more.end()));
}

}  // namespace

bool Loader::Accepts(const std::string& text, const source::Span& import) {
  if (text.find('\0') != std::string::npos) {
    diagnostics_.Error(import, "this is a binary file, not a program");
    return false;
  }
  bytes_ += text.size();
  if (bytes_ <= kMaxTextBytes) return true;
  // A text that is too large is not even kept, as diagnostics show lines of it.
  diagnostics_.Error(import, import.file < 0 ? "program is larger than 1 MiB"
                                             : "with this file the program is larger than 1 MiB");
  return false;
}

void Loader::Parse(int file) {
  // Each stage goes on after errors and reports all it can.
  source::Diagnostics unreadable;
  // The tokens are kept: both languages have words and names alike.
  const std::vector<Token> tokens = Tokenize(sources_, file, &unreadable);
  // Of a text in another language every line is wrong; that it is one says all.
  if (const std::optional<source::Span> word = BeginningOfModel(sources_, file, tokens)) {
    source::Diagnostic& error = diagnostics_.Error(*word, "this is an M3L model, not a program");
    if (file == 0) {
      error.Hint("where a command takes both, the model comes first: MODEL.m3l PROGRAM.dyn");
    }
    return;
  }
  // What could not be read is reported only now that it is known to be meant as a program.
  if (!unreadable.all().empty()) Tokenize(sources_, file, &diagnostics_);
  if (dump_ == Dump::kTokens) result_.dump += DumpTokens(sources_, tokens);
  Program program = dynarole::Parse(sources_, file, tokens, &diagnostics_);
  // What is imported comes first, wherever the import stands.
  for (const ImportDecl& import : program.imports) {
    if (diagnostics_.full()) return;
    Import(import.path, import.span);
  }
  Append(std::move(program));
}

void Loader::Append(Program file) {
  // Enumerations are counted over all files.
  const int before = static_cast<int>(program_.enumerations.size());
  const auto renumber = [before](std::vector<ConstantDecl>* constants) {
    for (ConstantDecl& constant : *constants) {
      if (constant.enumeration >= 0) constant.enumeration += before;
    }
  };
  renumber(&file.constants);
  for (Role& role : file.roles) renumber(&role.constants);
  MoveTo(&program_.imports, std::move(file.imports));
  MoveTo(&program_.roles, std::move(file.roles));
  MoveTo(&program_.constants, std::move(file.constants));
  MoveTo(&program_.enumerations, std::move(file.enumerations));
  if (file.root == nullptr) return;
  if (program_.root == nullptr) {
    program_.root = std::move(file.root);
  } else {
    MoveTo(&program_.root->members, std::move(file.root->members));
  }
}

Program Loader::Take() {
  if (dump_ == Dump::kAst) result_.dump = DumpAst(program_);
  LeaveOutUnused(&program_);
  // The bounds of a single file hold for all together; beyond them later stages would take long.
  if (program_.constants.size() > kMaxMembers) {
    diagnostics_.Error(program_.constants[kMaxMembers].name_span, "too many constants")
        .Hint("at most " + std::to_string(kMaxMembers) + " outside roles, in all files together");
    program_.constants.resize(kMaxMembers);
  }
  if (program_.root != nullptr && program_.root->members.size() > kMaxMembers) {
    std::vector<Member>& members = program_.root->members;
    diagnostics_.Error(members[kMaxMembers].name_span, "too many functions outside roles")
        .Hint("at most " + std::to_string(kMaxMembers) + " in all files together");
    members.resize(kMaxMembers);
  }
  if (sources_.size() > 1 && sources_.num_lines() > kMaxLines) {
    diagnostics_.Error({0, 0, 0}, "the program's files have more than " +
                                      std::to_string(kMaxLines) + " lines together");
  }
  return std::move(program_);
}

}  // namespace morphbus::dynarole
