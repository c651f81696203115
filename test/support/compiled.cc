#include "test/support/compiled.h"

#include <cstdio>
#include <fstream>
#include <sstream>

#include "compiler/dynarole/compile.h"
#include "compiler/dynarole/module_keywords.h"
#include "compiler/m3l/compile.h"
#include "compiler/source/check.h"

namespace morphbus::test {

model::Model ModelFrom(const std::string& path) {
  m3l::CompileOutput output = m3l::CompileFiles({std::string(MORPHBUS_SOURCE_DIR) + "/" + path});
  if (!output.model) {
    std::fprintf(stderr, "%s", source::Render(output.diagnostics, output.sources, false).c_str());
  }
  MORPHBUS_CHECK(output.model.has_value());
  return *output.model;
}

std::string TextOf(const std::string& path) {
  std::ifstream file(std::string(MORPHBUS_SOURCE_DIR) + "/" + path);
  MORPHBUS_CHECK(file.good());
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

dynarole::KeywordTable KeywordsOf(const model::Model& model) {
  std::vector<emit::ModuleKeywords> types;
  for (const model::ModuleType& type : model.module_types) {
    Result<emit::ModuleKeywords> keywords = emit::KeywordsOf(type);
    MORPHBUS_CHECK(keywords.has_value());
    types.push_back(*std::move(keywords));
  }
  return dynarole::KeywordTableOf(types);
}

std::vector<uint8_t> ProgramFrom(const std::string& text, const model::Model& model) {
  const dynarole::CompileResult result =
      dynarole::CompileProgram("test.dyn", text, KeywordsOf(model));
  if (!result.image) {
    std::fprintf(stderr, "%s", source::Render(result.diagnostics, result.sources, false).c_str());
  }
  MORPHBUS_CHECK(result.image.has_value());
  return *result.image;
}

}  // namespace morphbus::test
