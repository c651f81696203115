#include "compiler/keywords/keywords_xml.h"

#include <gtest/gtest.h>

#include "test/compiler/solver/known_modules.h"

namespace morphbus::keywords {
namespace {

TEST(Keywords, MtranHasThoseOfThePaper) {
  const Result<ModuleKeywords> keywords = KeywordsOf(test::Mtran());
  ASSERT_TRUE(keywords.has_value());
  EXPECT_EQ(keywords->links[2].keyword, "LINK_CONNECTING_BAR");
  EXPECT_EQ(keywords->joints[0].keyword, "JOINT_1");
  EXPECT_EQ(keywords->connectors[0].keyword, "C1");
  ASSERT_EQ(keywords->connectors[0].states.size(), 1u);
  EXPECT_EQ(keywords->connectors[0].states[0].keyword, "EXTENDED");
  EXPECT_TRUE(keywords->connectors[3].states.empty());
}

TEST(Keywords, OneKeywordForTwoPartsIsRefused) {
  model::ModuleType type = test::Mtran();
  type.links[0].name = "Bar";
  type.links[1].name = "bar";
  const Result<ModuleKeywords> keywords = KeywordsOf(type);
  ASSERT_FALSE(keywords.has_value());
  EXPECT_EQ(keywords.error().message, "links 'Bar' and 'bar' of module 'MTRAN' are both LINK_BAR");
}

TEST(KeywordsXml, ReadsBackUnchanged) {
  model::ModuleType type = test::Mtran();
  type.name = "A<&\">B";
  type.connectors[1].states.push_back(
      {"mode", {std::string("a&b"), std::string(" "), std::string("")}});
  type.connectors[1].states.push_back({"gain", {0.1, -2.0}});
  type.joints[1].type = model::JointType::kPrismatic;
  const std::string xml = KeywordsXml(*KeywordsOf(type));
  const Result<ModuleKeywords> again = ParseKeywordsXml(xml);
  ASSERT_TRUE(again.has_value()) << again.error().message;
  EXPECT_EQ(KeywordsXml(*again), xml);
  EXPECT_EQ(again->type_name, type.name);
  EXPECT_EQ(again->connectors[1].states[1].values, type.connectors[1].states[1].values);
  EXPECT_EQ(again->connectors[1].states[2].values, type.connectors[1].states[2].values);
  EXPECT_EQ(again->joints[1].type, model::JointType::kPrismatic);
}

TEST(KeywordsXml, IsAsDocumented) {
  model::ModuleType type = test::Mtran();
  type.links.resize(1);
  type.joints.resize(1);
  type.connectors.resize(1);
  EXPECT_EQ(KeywordsXml(*KeywordsOf(type)),
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
            "<module version=\"1\" name=\"MTRAN\">\n"
            "  <link name=\"active_block\" keyword=\"LINK_ACTIVE_BLOCK\" />\n"
            "  <joint name=\"joint_1\" keyword=\"JOINT_1\" type=\"revolute\" />\n"
            "  <connector name=\"c1\" keyword=\"C1\">\n"
            "    <state name=\"extended\" keyword=\"EXTENDED\" type=\"bool\" />\n"
            "  </connector>\n"
            "</module>\n");
}

TEST(KeywordsXml, ReadsAllTextOfAValue) {
  const Result<ModuleKeywords> keywords = ParseKeywordsXml(
      "<module version=\"1\" name=\"M\" xmlns:x=\"urn:x\">\n"
      "<connector name=\"c\" keyword=\"C\"> <!-- one -->\n"
      "<state name=\"s\" keyword=\"S\" type=\"string\"><value>a<!-- x -->b</value>"
      "<value> <!-- x --> </value><value>c<![CDATA[<d>]]></value></state>\n"
      "<state name=\"t\" keyword=\"T\" type=\"number\"><value>1<!-- x -->2</value></state>\n"
      "</connector></module>\n<!-- the end -->\n");
  ASSERT_TRUE(keywords.has_value()) << keywords.error().message;
  using Values = std::vector<model::AttributeValue>;
  const auto& states = keywords->connectors.at(0).states;
  EXPECT_EQ(states.at(0).values,
            (Values{std::string("ab"), std::string("  "), std::string("c<d>")}));
  EXPECT_EQ(states.at(1).values, Values{12.0});
}

TEST(KeywordsXml, CountsCharactersOfANameNotBytes) {
  std::string name;
  for (int i = 0; i < 200; ++i) name += "\u00e9";
  EXPECT_TRUE(ParseKeywordsXml("<module version=\"1\" name=\"" + name + "\"/>").has_value());
}

TEST(KeywordsXml, RefusesWhatItDoesNotUnderstand) {
  const auto wrap = [](const std::string& body) {
    return "<module version=\"1\" name=\"M\">\n" + body + "\n</module>";
  };
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "line 1"},
      {"<modul/>", "not <module>"},
      {"<module name=\"M\"/>", "lacks its attribute 'version'"},
      {"<module version=\"2\" name=\"M\"/>", "version 2"},
      {"<module version=\"1\" name=\"\"/>", "empty"},
      {wrap("<link name=\"a\"/>"), "line 2: <link> lacks its attribute 'keyword'"},
      {wrap("<link name=\"a\" keyword=\"A\"/>"), "begins with LINK_"},
      {wrap("<link name=\"a\" keyword=\"LINK_a\"/>"), "no keyword"},
      {wrap("<link name=\"a\" keyword=\"LINK_A\" mass=\"1\"/>"), "unexpected attribute 'mass'"},
      {wrap("<link name=\"a\" keyword=\"LINK_A\"><x/></link>"), "unexpected element <x>"},
      {wrap("<link name=\"a\" keyword=\"LINK_A\"/><link name=\"b\" keyword=\"LINK_A\"/>"),
       "LINK_A twice"},
      {wrap("<joint name=\"a\" keyword=\"A\" type=\"ball\"/>"), "'ball' is no type of joint"},
      {wrap("<wheel/>"), "unexpected element <wheel>"},
      {wrap("text"), "unexpected text"},
      {wrap("<connector name=\"c\" keyword=\"C\"><state name=\"s\" keyword=\"S\" "
            "type=\"string\"/></connector>"),
       "has no values"},
      {wrap("<connector name=\"c\" keyword=\"C\"><state name=\"s\" keyword=\"S\" "
            "type=\"number\"><value>x</value></state></connector>"),
       "'x' is no number"},
      {wrap("<connector name=\"c\" keyword=\"C\"><state name=\"s\" keyword=\"S\" "
            "type=\"number\"><value>infinity</value></state></connector>"),
       "'infinity' is no number"},
      {wrap("<connector name=\"c\" keyword=\"C\"><state name=\"s\" keyword=\"S\" "
            "type=\"string\"><value>a<b/></value></state></connector>"),
       "line 2: unexpected element <b>"},
      {wrap("<link name=\"a\" keyword=\"LINK_\"/>"), "begins with LINK_ and goes on"},
      {wrap("<link name=\"a\" keyword=\"LINK_A\"> x</link>"), "unexpected text"},
      {wrap("") + "\n<module/>", "line 4: unexpected element <module>"},
      {wrap("") + " x", "unexpected text"},
      {"x " + wrap(""), "unexpected text"},
      {"<module version=\"1\" name=\"" + std::string(256, 'x') + "\"/>", "too long"},
      {wrap("<link"), "line"},
      {std::string(2 << 20, ' '), "larger than 1 MiB"},
  };
  for (const auto& [xml, expected] : cases) {
    const Result<ModuleKeywords> result = ParseKeywordsXml(xml);
    ASSERT_FALSE(result.has_value()) << xml.substr(0, 200);
    EXPECT_NE(result.error().message.find(expected), std::string::npos) << result.error().message;
  }
}

}  // namespace
}  // namespace morphbus::keywords
