#include "compiler/m3l/loader.h"

#include "compiler/m3l/lexer.h"
#include "compiler/m3l/parser.h"

namespace morphbus::m3l {
namespace {

/// The first word of a DynaRole program, if the file is one and no model; else nothing. Both
/// languages have constants and imports, so that what follows them decides, or what is imported.
const Token* BeginningOfProgram(const std::vector<Token>& tokens) {
  for (size_t i = 0; i + 1 < tokens.size(); ++i) {
    const bool statement = StartsStatement(tokens, i);
    const bool import = statement && tokens[i].text == "import";
    if (import && tokens[i + 1].text.ends_with(".dyn\"")) return &tokens[i];
    if (statement && tokens[i].text != "const" && !import) return nullptr;
    if (import && tokens[i + 1].text.ends_with(".m3l\"")) return nullptr;
    const bool role = tokens[i].text == "role" || tokens[i].text == "abstract";
    if (role && !statement && tokens[i + 1].kind == TokenKind::kWord) return &tokens[i];
  }
  return nullptr;
}

}  // namespace

void Loader::Parse(int file) {
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
  FileAst ast = m3l::Parse(tokens, &diagnostics_);
  // Imported files are loaded before this one is added, so that their definitions come first.
  for (const ImportDecl& import : ast.imports) Import(import.path, import.span);
  if (dump_ == Dump::kTokens) output_.dump += DumpTokens(sources_, tokens);
  if (dump_ == Dump::kAst) output_.dump += DumpAst(ast);
  output_.files.push_back(std::move(ast));
}

}  // namespace morphbus::m3l
