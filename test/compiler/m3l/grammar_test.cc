// The editors' grammars in tools/editor name the words that the lexers know, all and no others.

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>

#include "compiler/dynarole/lexer.h"
#include "compiler/m3l/lexer.h"
#include "test/support/source_dir.h"

namespace morphbus {
namespace {

using Words = std::set<std::string>;

nlohmann::json ReadGrammar(const std::string& name) {
  std::ifstream file(test::SourcePath("tools/editor/") + name);
  return nlohmann::json::parse(file, nullptr, false);
}

/// The words of the alternatives `\b(a|b|c)\b` of all rules of the group "words" whose scope begins
/// with one of `scopes`.
Words WordsIn(const nlohmann::json& grammar, const std::vector<std::string>& scopes) {
  Words words;
  for (const nlohmann::json& rule : grammar["repository"]["words"]["patterns"]) {
    const std::string scope = rule["name"];
    bool wanted = false;
    for (const std::string& prefix : scopes) wanted = wanted || scope.rfind(prefix, 0) == 0;
    const std::string match = rule["match"];
    std::smatch list;
    if (!wanted || !std::regex_search(match, list, std::regex(R"(\\b\(([a-z|]+)\)\\b)"))) continue;
    std::stringstream alternatives(list[1]);
    for (std::string word; std::getline(alternatives, word, '|');) words.insert(word);
  }
  return words;
}

template <typename List>
Words AsSet(const List& list) {
  Words words;
  for (const std::string_view word : list) words.emplace(word);
  return words;
}

TEST(EditorGrammar, OfM3lHasTheLexersKeywords) {
  const nlohmann::json grammar = ReadGrammar("m3l.tmLanguage.json");
  ASSERT_FALSE(grammar.is_discarded());
  EXPECT_EQ(grammar["scopeName"], "source.m3l");
  EXPECT_EQ(WordsIn(grammar, {"keyword.declaration"}), AsSet(m3l::Keywords()));
  EXPECT_EQ(WordsIn(grammar, {"keyword.operator.word"}), AsSet(m3l::OperatorWords()));
}

TEST(EditorGrammar, OfDynaRoleHasTheLexersWords) {
  const nlohmann::json grammar = ReadGrammar("dynarole.tmLanguage.json");
  ASSERT_FALSE(grammar.is_discarded());
  EXPECT_EQ(grammar["scopeName"], "source.dynarole");
  EXPECT_EQ(WordsIn(grammar, {"keyword", "constant.language", "variable.language"}),
            AsSet(dynarole::ReservedWords()));
}

TEST(EditorGrammar, HasPatternsThatCompileAndGroupsThatExist) {
  for (const char* name : {"m3l.tmLanguage.json", "dynarole.tmLanguage.json"}) {
    const nlohmann::json grammar = ReadGrammar(name);
    ASSERT_FALSE(grammar.is_discarded());
    for (const nlohmann::json& rule : grammar["patterns"]) {
      const std::string group = rule["include"].get<std::string>().substr(1);
      EXPECT_TRUE(grammar["repository"].contains(group)) << name << " " << group;
    }
    const std::function<void(const nlohmann::json&)> visit = [&](const nlohmann::json& node) {
      for (const auto& [key, value] : node.items()) {
        const bool pattern = key == "match" || key == "begin" || key == "end";
        if (pattern && value.get<std::string>().find("(?<") == std::string::npos) {
          // ECMAScript has no look-behind; the rest is the same in both dialects.
          EXPECT_NO_THROW(std::regex{value.get<std::string>()}) << value;
        } else if (value.is_structured()) {
          visit(value);
        }
      }
    };
    visit(grammar["repository"]);
  }
}

}  // namespace
}  // namespace morphbus
