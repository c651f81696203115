#include "compiler/dynarole/module_keywords.h"

#include <variant>

namespace morphbus::dynarole {

namespace {

// Images name links as M3L does, in capitals; only programs write LINK_ before them.
std::string WithoutPrefix(const std::string& keyword) {
  constexpr size_t kPrefix = 5;
  return keyword.compare(0, kPrefix, "LINK_") == 0 ? keyword.substr(kPrefix) : keyword;
}

void AddType(int number, const emit::ModuleKeywords& type, KeywordTable* table) {
  table->type_names.push_back(type.type_name);
  for (const emit::LinkKeyword& link : type.links) {
    table->Add(number, vm::KeywordKind::kLink, link.keyword, WithoutPrefix(link.keyword), true);
  }
  for (const emit::JointKeyword& joint : type.joints) {
    table->Add(number, vm::KeywordKind::kJoint, joint.keyword, joint.keyword, true);
  }
  for (const emit::ConnectorKeyword& connector : type.connectors) {
    table->Add(number, vm::KeywordKind::kConnector, connector.keyword, connector.keyword, true);
    for (const emit::StateKeyword& state : connector.states) {
      const bool is_bool = state.values.empty() || std::holds_alternative<bool>(state.values[0]);
      table->Add(number, vm::KeywordKind::kConnectorState, state.keyword, state.keyword, is_bool);
    }
  }
}

}  // namespace

KeywordTable KeywordTableOf(const std::vector<emit::ModuleKeywords>& types) {
  KeywordTable table;
  int number = 0;
  for (const emit::ModuleKeywords& type : types) AddType(number++, type, &table);
  return table;
}

CompileResult CompileProgram(const std::string& name, const std::string& text,
                             const std::vector<emit::ModuleKeywords>& types, Dump dump) {
  return CompileProgram(name, text, KeywordTableOf(types), dump);
}

}  // namespace morphbus::dynarole
