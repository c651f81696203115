#include "compiler/dynarole/compile.h"

#include <memory>
#include <optional>
#include <utility>

#include "compiler/dynarole/broken_program.h"
#include "compiler/dynarole/checker.h"
#include "compiler/dynarole/codegen.h"
#include "compiler/dynarole/dump.h"
#include "compiler/dynarole/image_writer.h"
#include "compiler/dynarole/lints.h"
#include "compiler/dynarole/loader.h"
#include "compiler/dynarole/name_index.h"
#include "vm/image/disassembler.h"
#include "vm/image/verifier.h"

namespace morphbus::dynarole {

namespace {

/// The last component of the program's path.
std::string FileName(const CompileResult& result) {
  const std::string& path = result.sources.name(0);
  return path.substr(path.find_last_of('/') + 1);
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

/// All stages behind the loader.
void CompileLoaded(const keywords::KeywordTable& keywords, Dump dump, Program* program,
                   source::NameTable* names, CompileResult* result) {
  // What could not be read would only cause complaints about what it would have declared.
  if (result->diagnostics.had_errors()) {
    if (names != nullptr) *names = NamesOfBroken(result->sources, keywords, program);
    return;
  }
  // What others import is checked as far as it can be by itself.
  const bool empty =
      program->root == nullptr && program->constants.empty() && program->enumerations.empty();
  result->is_library = program->roles.empty() && !empty;
  // From here on the tree is sound. The model gives names their meanings, the checker types.
  ProgramModel model = BuildModel(program, &result->diagnostics);
  Check(keywords, &model, &result->diagnostics);
  if (names != nullptr) *names = IndexNames(result->sources, keywords, model);
  if (program->roles.empty()) {
    result->diagnostics.Error({0, 0, 0}, kNoRoles).hint =
        empty ? "a program is a list of roles: role NAME extends Module { ... }"
              : "a program with roles can import it: import \"" + FileName(*result) + "\";";
  }
  if (result->diagnostics.had_errors()) return;
  // Warnings are for programs that can run; a broken one has worse to be told.
  Lint(keywords, model, &result->diagnostics);
  const ProgramCode code = Generate(result->sources, model, &result->diagnostics);
  if (result->diagnostics.had_errors()) return;

  // Last, the bytes, checked as every virtual machine will check them.
  std::vector<uint8_t> image = WriteImage(result->sources, keywords, model, code);
  if (image.empty()) {
    result->diagnostics.Error({0, 0, 0}, "program is too large for an image").hint =
        "an image has at most " + std::to_string(vm::kMaxImageBytes) + " bytes";
    return;
  }
  VerifyOwnImage(image, result);
  if (result->diagnostics.had_errors()) return;
  if (dump == Dump::kCode) {
    result->dump = vm::DisassembleImage(image.data(), static_cast<uint32_t>(image.size()));
  }
  result->image = std::move(image);
}

/// Makes what was left out members of the root again.
void TakeBack(Program* program) {
  if (program->root == nullptr) {
    program->root = std::make_unique<Role>();
    program->root->abstract_role = true;
    program->root->name = "Module";
    program->root->span = program->root->name_span = program->left_out.front().span;
  }
  for (Member& member : program->left_out) program->root->members.push_back(std::move(member));
  program->left_out.clear();
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
                             source::NameTable* names, source::TextReader read) {
  CompileResult result;
  Loader loader(std::move(read), dump, &result);
  loader.LoadText(name, text);
  // The program's own text is the first one, also where it could not be taken.
  if (result.sources.size() == 0) result.sources.AddText(name, "");
  Program program = loader.Take();
  result.imports = program.imports;
  CompileLoaded(keywords, dump, &program, names, &result);
  // Editors propose also what is left out of the image.
  if (names != nullptr && !program.left_out.empty()) {
    TakeBack(&program);
    *names = NamesOfBroken(result.sources, keywords, &program);
  }
  return result;
}

}  // namespace morphbus::dynarole
