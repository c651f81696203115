#include "compiler/dynarole/compile.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <string_view>

#include "compiler/dynarole/broken_program.h"
#include "compiler/dynarole/checker.h"
#include "compiler/dynarole/codegen.h"
#include "compiler/dynarole/dump.h"
#include "compiler/dynarole/image_writer.h"
#include "compiler/dynarole/lints.h"
#include "compiler/dynarole/name_index.h"
#include "compiler/dynarole/parser.h"
#include "vm/image/disassembler.h"
#include "vm/image/verifier.h"

namespace morphbus::dynarole {

namespace {

constexpr size_t kMaxTextBytes = size_t{1} << 20;

/// The first word of an M3L model, if the text is one and no program; else nothing. Both languages
/// have constants, so that what follows them decides.
std::optional<source::Span> BeginningOfModel(const source::SourceSet& sources, int file,
                                             const std::vector<Token>& tokens) {
  constexpr std::string_view kStatements[] = {"module", "connection", "robot"};
  for (size_t i = 0; i + 1 < tokens.size(); ++i) {
    if (tokens[i].kind == TokenKind::kRole || tokens[i].kind == TokenKind::kAbstract) break;
    const source::Span& span = tokens[i].span;
    const std::string_view word = sources.text(file).substr(span.begin, span.end - span.begin);
    const bool named = tokens[i + 1].kind == TokenKind::kName;
    if (named && std::ranges::count(kStatements, word) > 0) return span;
    if (word == "import" && tokens[i + 1].kind == TokenKind::kText) return span;
  }
  return std::nullopt;
}

// The last line of defence against our own slips: nothing leaves that the VM would refuse.
void VerifyOwnImage(const std::vector<uint8_t>& image, CompileResult* result) {
  // The verified program is too large for the stack.
  const auto program = std::make_unique<vm::VerifiedProgram>();
  const vm::VerifyError error =
      vm::Verifier::Verify(image.data(), static_cast<uint32_t>(image.size()), program.get());
  if (error.message == nullptr) return;
  result->diagnostics
      .Error({0, 0, 0}, std::string("the virtual machine refuses the code: ") + error.message +
                            " (at byte " + std::to_string(error.offset) + ")")
      .hint = "this is a fault of the compiler; please report it with the program";
}

}  // namespace

std::optional<Dump> DumpFromName(const std::string& name) {
  if (name == "tokens") return Dump::kTokens;
  if (name == "ast") return Dump::kAst;
  if (name == "code") return Dump::kCode;
  return std::nullopt;
}

CompileResult CompileProgram(const std::string& name, const std::string& text,
                             const keywords::KeywordTable& keywords, Dump dump,
                             source::NameTable* names) {
  // A text that is too large is not even kept, as diagnostics show lines of it.
  CompileResult result;
  const bool too_large = text.size() > kMaxTextBytes;
  const int file = result.sources.AddText(name, too_large ? std::string() : text);
  if (too_large) {
    result.diagnostics.Error({file, 0, 0}, "program is larger than 1 MiB");
    return result;
  }
  // Each stage goes on after errors and reports all it can.
  source::Diagnostics unreadable;
  // The tokens are kept: both languages have words and names alike.
  const std::vector<Token> tokens = Tokenize(result.sources, file, &unreadable);
  // Of a text in another language every line is wrong; that it is one says all.
  if (const std::optional<source::Span> word = BeginningOfModel(result.sources, file, tokens)) {
    result.diagnostics.Error(*word, "this is an M3L model, not a program")
        .Hint("where a command takes both, the model comes first: MODEL.m3l PROGRAM.dyn");
    return result;
  }
  // What could not be read is reported only now that it is known to be meant as a program.
  if (!unreadable.all().empty()) Tokenize(result.sources, file, &result.diagnostics);
  if (dump == Dump::kTokens) result.dump = DumpTokens(result.sources, tokens);
  Program program = Parse(result.sources, file, tokens, &result.diagnostics);
  if (dump == Dump::kAst) result.dump = DumpAst(program);
  // What could not be read would only cause complaints about what it would have declared.
  if (result.diagnostics.had_errors()) {
    if (names != nullptr) *names = NamesOfBroken(result.sources, keywords, &program);
    return result;
  }
  if (program.roles.empty()) {
    result.diagnostics.Error({file, 0, 0}, "program has no roles").hint =
        "a program is a list of roles: role NAME extends Module { ... }";
    return result;
  }
  // From here on the tree is sound. The model gives names their meanings, the checker types.
  ProgramModel model = BuildModel(&program, &result.diagnostics);
  Check(keywords, &model, &result.diagnostics);
  if (names != nullptr) *names = IndexNames(result.sources, keywords, model);
  if (result.diagnostics.had_errors()) return result;
  // Warnings are for programs that can run; a broken one has worse to be told.
  Lint(keywords, model, &result.diagnostics);
  const ProgramCode code = Generate(result.sources, model, &result.diagnostics);
  if (result.diagnostics.had_errors()) return result;

  // Last, the bytes, checked as every virtual machine will check them.
  std::vector<uint8_t> image = WriteImage(name, keywords, model, code);
  if (image.empty()) {
    result.diagnostics.Error({file, 0, 0}, "program is too large for an image").hint =
        "an image has at most " + std::to_string(vm::kMaxImageBytes) + " bytes";
    return result;
  }
  VerifyOwnImage(image, &result);
  if (result.diagnostics.had_errors()) return result;
  if (dump == Dump::kCode) {
    result.dump = vm::DisassembleImage(image.data(), static_cast<uint32_t>(image.size()));
  }
  result.image = std::move(image);
  return result;
}

}  // namespace morphbus::dynarole
