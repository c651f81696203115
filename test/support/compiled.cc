#include "test/support/compiled.h"

#include <cstdio>
#include <fstream>
#include <sstream>

#include "compiler/base/check.h"
#include "compiler/dynarole/compile.h"
#include "compiler/keywords/keyword_table.h"
#include "compiler/m3l/compile.h"
#include "test/support/source_dir.h"

namespace morphbus::test {

model::Model ModelFrom(const std::string& path) {
  m3l::CompileOutput output = m3l::CompileFiles({test::SourcePath(path)});
  if (!output.model) {
    std::fprintf(stderr, "%s", source::Render(output.diagnostics, output.sources, false).c_str());
  }
  MORPHBUS_CHECK(output.model.has_value());
  return *output.model;
}

std::string TextOf(const std::string& path) {
  std::ifstream file(test::SourcePath(path));
  MORPHBUS_CHECK(file.good());
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::vector<uint8_t> ProgramFrom(const std::string& text, const model::Model& model) {
  const auto keywords = keywords::KeywordsOf(model).and_then(keywords::KeywordTable::Of);
  MORPHBUS_CHECK(keywords.has_value());
  const dynarole::CompileResult result = dynarole::CompileProgram("test.dyn", text, *keywords);
  if (!result.image) {
    std::fprintf(stderr, "%s", source::Render(result.diagnostics, result.sources, false).c_str());
  }
  MORPHBUS_CHECK(result.image.has_value());
  return *result.image;
}

}  // namespace morphbus::test
