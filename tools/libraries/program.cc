#include <fmt/format.h>
#include <morphbus/dynarole/program.h>

#include <utility>

#include "compiler/dynarole/compile.h"
#include "compiler/dynarole/format.h"
#include "compiler/dynarole/parameters.h"
#include "compiler/keywords/keyword_table.h"
#include "compiler/keywords/module_keywords.h"
#include "tools/libraries/diagnostics.h"
#include "tools/libraries/model_content.h"
#include "tools/libraries/program_content.h"
#include "vm/image/disassembler.h"

namespace morphbus {
namespace {

const uint8_t* Bytes(std::string_view text) {
  return reinterpret_cast<const uint8_t*>(text.data());
}

/// An image begins with its magic number, which no program text does.
bool IsImage(std::string_view bytes) {
  return bytes.size() >= 4 && vm::image::ReadU32(Bytes(bytes)) == vm::image::kMagic;
}

}  // namespace

Program::Program(std::shared_ptr<const Content> content) : content_(std::move(content)) {}

Program Program::FromImage(std::string_view image) {
  return Program(std::make_shared<Content>(std::string(image)));
}

const std::string& Program::image() const { return content_->image; }
uint64_t Program::hash() const { return content_->verified.hash(); }

std::vector<Role> Program::Roles() const {
  const vm::VerifiedProgram& program = content_->verified;
  const auto name = [&program](int role) {
    const vm::Text text = program.role(role).name;
    return std::string(text.data, text.size);
  };
  std::vector<Role> roles;
  for (int r = 0; r < program.num_roles(); ++r) {
    const vm::RoleInfo role = program.role(r);
    roles.push_back({name(r), role.parent < 0 ? "" : name(role.parent), role.abstract_role});
  }
  return roles;
}

std::vector<Parameter> Program::Parameters() const {
  std::vector<Parameter> parameters;
  for (const dynarole::ProgramParameter& one : dynarole::ParametersOf(content_->verified)) {
    parameters.push_back({one.name, one.is_int, one.value, one.source_value, one.least, one.most});
  }
  return parameters;
}

Program Program::With(std::string_view parameter, double value) const {
  // Text that reads back as the same number goes through the checks of `run --set`.
  Result<std::string> image =
      dynarole::WithParameter(content_->verified, parameter, fmt::format("{}", value));
  if (!image) throw Failure(image.error().message);
  return Program(std::make_shared<Content>(std::move(*image)));
}

std::string Program::Disassemble() const { return vm::Disassemble(content_->verified); }

Program CompileDynaRole(const std::string& path, const Model& model,
                        std::vector<Diagnostic>* warnings) {
  Result<std::string> text = source::ReadSourceFile(path);
  if (!text) throw Failure(text.error().message);
  if (IsImage(*text)) return Program(std::make_shared<Program::Content>(std::move(*text)));
  return CompileDynaRoleText(path, *text, model, warnings);
}

Program CompileDynaRoleText(const std::string& name, const std::string& text, const Model& model,
                            std::vector<Diagnostic>* warnings) {
  const Result<keywords::KeywordTable> keywords =
      keywords::KeywordsOf(model.content()->model).and_then(keywords::KeywordTable::Of);
  if (!keywords) throw Failure(keywords.error().message);
  const dynarole::CompileResult result = dynarole::CompileProgram(name, text, *keywords);
  ThrowOnErrors(result.diagnostics, result.sources, warnings);
  return Program(
      std::make_shared<Program::Content>(std::string(result.image->begin(), result.image->end())));
}

std::string FormatDynaRole(const std::string& name, const std::string& text) {
  return FormatOrThrow(name, text, dynarole::Format);
}

}  // namespace morphbus
