#include "test/support/compiled.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <variant>

#include "compiler/dynarole/compile.h"
#include "compiler/m3l/compile.h"
#include "compiler/source/check.h"

namespace morphbus::test {

namespace {

std::string Capitals(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return name;
}

}  // namespace

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
  dynarole::KeywordTable table;
  for (size_t t = 0; t < model.module_types.size(); ++t) {
    const model::ModuleType& type = model.module_types[t];
    const int number = static_cast<int>(t);
    table.type_names.push_back(type.name);
    for (const model::Link& link : type.links) {
      const std::string name = Capitals(link.name);
      table.Add(number, vm::KeywordKind::kLink, "LINK_" + name, name, true);
    }
    for (const model::Joint& joint : type.joints) {
      const std::string name = Capitals(joint.name);
      table.Add(number, vm::KeywordKind::kJoint, name, name, true);
    }
    for (const model::Connector& connector : type.connectors) {
      const std::string name = Capitals(connector.name);
      table.Add(number, vm::KeywordKind::kConnector, name, name, true);
      for (const model::StateVariable& state : connector.states) {
        const bool is_bool = std::holds_alternative<bool>(state.values[0]);
        const std::string variable = Capitals(state.name);
        table.Add(number, vm::KeywordKind::kConnectorState, variable, variable, is_bool);
      }
    }
  }
  return table;
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
