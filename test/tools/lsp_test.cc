// What an editor is told: places in texts, messages on a stream, and words that agree with the
// compilers. Sessions as a whole are tested by test/e2e/lsp.py.

#include <gtest/gtest.h>

#include <regex>
#include <string>
#include <vector>

#include "compiler/dynarole/builtins.h"
#include "compiler/dynarole/format.h"
#include "compiler/dynarole/lexer.h"
#include "compiler/m3l/compile.h"
#include "compiler/m3l/format.h"
#include "compiler/m3l/lexer.h"
#include "tools/lsp/document.h"
#include "tools/lsp/language_server.h"
#include "tools/lsp/m3l_words.h"
#include "tools/lsp/message_stream.h"
#include "tools/lsp/program_words.h"

namespace morphbus::tools {
namespace {

Document DocumentOf(const std::string& text) {
  Document document;
  document.path = "/tmp/m.m3l";
  document.Set(text);
  return document;
}

size_t OffsetOf(const Document& document, int line, int character, PositionEncoding encoding) {
  return OffsetAt(document.sources, 0, {line, character}, encoding);
}

TEST(LspPosition, CountsUnitsOfUtf16OrBytes) {
  // Two, three and four bytes of UTF-8; one, one and two units of UTF-16.
  const Document document = DocumentOf("a\u00fcb\n\u20acx\n\U0001F916y");
  EXPECT_EQ(OffsetOf(document, 0, 2, PositionEncoding::kUtf16), 3u);
  EXPECT_EQ(OffsetOf(document, 0, 3, PositionEncoding::kUtf8), 3u);
  EXPECT_EQ(OffsetOf(document, 1, 1, PositionEncoding::kUtf16), 5u + 3u);
  EXPECT_EQ(OffsetOf(document, 2, 2, PositionEncoding::kUtf16), document.text().size() - 1);
  for (const PositionEncoding encoding : {PositionEncoding::kUtf8, PositionEncoding::kUtf16}) {
    for (size_t at = 0; at <= document.text().size(); ++at) {
      const std::optional<Position> position =
          PositionOf(PositionJson(document.sources, 0, at, encoding));
      ASSERT_TRUE(position);
      // Bytes within a character are at its end.
      EXPECT_GE(OffsetAt(document.sources, 0, *position, encoding), at);
    }
  }
}

TEST(LspPosition, BeyondTheTextIsItsEnd) {
  const Document document = DocumentOf("ab\r\ncd\r\n");
  EXPECT_EQ(OffsetOf(document, 0, 99, PositionEncoding::kUtf16), 2u);
  EXPECT_EQ(OffsetOf(document, 99, 0, PositionEncoding::kUtf16), document.text().size());
  EXPECT_EQ(OffsetOf(document, 1, 1, PositionEncoding::kUtf16), 5u);
  EXPECT_FALSE(PositionOf(Json{{"line", -1}, {"character", 0}}));
  EXPECT_FALSE(PositionOf(Json("x")));
}

TEST(LspDocument, TakesEditsInTurn) {
  Document document = DocumentOf("one\ntwo\n");
  const auto change = [&](int line, int from, int to, const char* text) {
    const Json range = {{"start", {{"line", line}, {"character", from}}},
                        {"end", {{"line", line}, {"character", to}}}};
    return document.Change({{"range", range}, {"text", text}}, PositionEncoding::kUtf16);
  };
  EXPECT_TRUE(change(0, 0, 3, "1\n1"));
  EXPECT_TRUE(change(2, 3, 3, "!"));
  EXPECT_EQ(document.text(), "1\n1\ntwo!\n");
  // The end before the beginning deletes nothing.
  EXPECT_TRUE(change(0, 1, 0, "x"));
  EXPECT_EQ(document.text(), "1x\n1\ntwo!\n");
  EXPECT_FALSE(
      document.Change(Json{{"range", Json::object()}, {"text", "y"}}, PositionEncoding::kUtf16));
}

TEST(LspUri, IsReadAsItIsWritten) {
  const std::string path = "/a b/%20\u00fc#?.m3l";
  EXPECT_EQ(UriOfPath("/a b"), "file:///a%20b");
  EXPECT_EQ(PathOfUri(UriOfPath(path)), path);
  EXPECT_EQ(PathOfUri("file://localhost/x"), "/x");
  EXPECT_FALSE(PathOfUri("untitled:Untitled-1"));
  EXPECT_FALSE(PathOfUri("file:///a%00b"));
  EXPECT_EQ(PathOfUri("file:///a%2"), "/a%2");
}

TEST(LspMessages, ComeInAnyPieces) {
  const std::string bytes =
      "Content-Length: 2\r\nContent-Type: x\r\n\r\n{}content-length:3\r\n\r\n[1]";
  for (size_t piece = 1; piece < bytes.size(); ++piece) {
    MessageReader reader;
    std::vector<std::string> messages;
    for (size_t at = 0; at < bytes.size(); at += piece) {
      reader.Add(std::string_view(bytes).substr(at, piece));
      while (true) {
        const auto next = reader.Next();
        ASSERT_TRUE(next) << next.error().message;
        if (!*next) break;
        messages.push_back(**next);
      }
    }
    EXPECT_EQ(messages, (std::vector<std::string>{"{}", "[1]"}));
  }
}

TEST(LspMessages, WithoutALengthEndTheSession) {
  for (const char* bytes : {"\r\n\r\n", "Content-Length: x\r\n\r\n", "Content-Length: 5 6\r\n\r\n",
                            "Content-Length: 99999999999999999999\r\n\r\n"}) {
    MessageReader reader;
    reader.Add(bytes);
    EXPECT_FALSE(reader.Next()) << bytes;
  }
}

TEST(LspWords, OfM3lAreThoseOfTheChecker) {
  for (const AttributeWord& word : AttributeWords()) {
    const std::string definition(word.definition);
    const bool hull = definition == "box" || definition == "cylinder" || definition == "sphere";
    std::string text = "module M: unit=1\n";
    if (definition == "module") text = "module M: ";
    if (hull) {
      text += "link l: hull=" + definition + "(" + std::string(word.name) + "=1)";
    } else {
      if (definition != "module") text += definition + " x: ";
      text += std::string(word.name) + "=1";
    }
    const m3l::CompileOutput output = m3l::CompileText("m.m3l", text);
    for (const source::Diagnostic& diagnostic : output.diagnostics.all()) {
      // A value of 1 may be wrong; that there is no such attribute or argument must not be said.
      EXPECT_EQ(diagnostic.message.find("has no a"), std::string::npos)
          << text << diagnostic.message;
    }
  }
}

TEST(LspWords, BeginEveryStatementOfM3l) {
  std::vector<std::string_view> words;
  for (const ModelWord& word : StatementWords()) words.push_back(word.word);
  for (const std::string_view keyword : m3l::Keywords()) {
    EXPECT_NE(std::find(words.begin(), words.end(), keyword), words.end()) << keyword;
  }
}

TEST(LspWords, ExplainAllThatDynaRoleOffers) {
  for (const auto* table :
       {&dynarole::SelfBuiltins(), &dynarole::FunctionBuiltins(), &dynarole::JointBuiltins(),
        &dynarole::ConnectorBuiltins(), &dynarole::SensorBuiltins()}) {
    for (const dynarole::Builtin& builtin : *table) {
      EXPECT_FALSE(BuiltinMeaning(builtin.name).empty()) << builtin.name;
    }
  }
  for (const dynarole::NamedDirection& direction : dynarole::kDirections) {
    EXPECT_FALSE(BuiltinMeaning(std::string("$") + direction.name).empty()) << direction.name;
  }
  std::string words;
  for (const ProgramWord& word : ProgramWords()) words += std::string(word.snippet) + " ";
  for (const std::string_view word : dynarole::ReservedWords()) {
    EXPECT_NE(words.find(word), std::string::npos) << word;
  }
}

/// A snippet as it is when its places are filled in: each with its default, the first choice, or a
/// name.
std::string Filled(std::string snippet) {
  snippet = std::regex_replace(snippet, std::regex(R"(\$\{\d+\|([^,|]*)[^}]*\})"), "$1");
  snippet = std::regex_replace(snippet, std::regex(R"(\$\{\d+:([^}]*)\})"), "$1");
  snippet = std::regex_replace(snippet, std::regex(R"(\$0)"), "");
  snippet = std::regex_replace(snippet, std::regex(R"(\$(\{\d+\}|\d+))"), "x");
  return std::regex_replace(snippet, std::regex(R"(\\\$)"), "$$");
}

TEST(LspWords, OfM3lBeginWhatParses) {
  for (const ModelWord& word : StatementWords()) {
    // Members belong to a module.
    const std::string text = "module Z: unit=1\n" + Filled(std::string(word.snippet));
    source::SourceSet sources;
    source::Diagnostics diagnostics;
    const int file = sources.AddText("m.m3l", text);
    EXPECT_TRUE(m3l::Format(sources, file, &diagnostics)) << text;
  }
}

TEST(LspWords, OfDynaRoleBeginWhatParses) {
  for (const ProgramWord& word : ProgramWords()) {
    std::string text = Filled(std::string(word.snippet));
    // Each stands where it is offered: an `else` behind its `if`, a value in a statement.
    if (word.word == "else") text = "if (true) {}\n" + text;
    if (word.word == "self") text += "hops";
    if (word.place == WordPlace::kValue) text = "var v = " + text + ";";
    if (word.place >= WordPlace::kTask) text = "startup s() {\n" + text + "\n}";
    if (word.place != WordPlace::kProgram) text = "role R extends Module {\n" + text + "\n}";
    source::SourceSet sources;
    source::Diagnostics diagnostics;
    const int file = sources.AddText("p.dyn", text);
    EXPECT_TRUE(dynarole::Format(sources, file, &diagnostics)) << text;
  }
}

/// A session in one process, without a file.
class LspSession : public testing::Test {
 protected:
  LspSession() : server_([this](const Json& message) { sent_.push_back(message); }) {
    Ask("initialize", {{"capabilities", Json::object()}});
  }
  /// The answer to a request.
  Json Ask(const std::string& method, const Json& parameters) {
    server_.Take(
        JsonText(Json{{"jsonrpc", "2.0"}, {"id", 1}, {"method", method}, {"params", parameters}}));
    return sent_.back();
  }
  void Tell(const std::string& method, const Json& parameters) {
    server_.Take(JsonText(Json{{"jsonrpc", "2.0"}, {"method", method}, {"params", parameters}}));
  }

  std::vector<Json> sent_;
  LanguageServer server_;
};

TEST_F(LspSession, PublishesEachStateOnce) {
  Tell("textDocument/didOpen",
       {{"textDocument", {{"uri", "untitled:x.m3l"}, {"version", 4}, {"text", "modul M:"}}}});
  EXPECT_TRUE(server_.WorkAhead());
  EXPECT_EQ(sent_.back()["params"]["version"], 4);
  EXPECT_FALSE(sent_.back()["params"]["diagnostics"].empty());
  EXPECT_FALSE(server_.WorkAhead());
  Tell("textDocument/didClose", {{"textDocument", {{"uri", "untitled:x.m3l"}}}});
  EXPECT_TRUE(sent_.back()["params"]["diagnostics"].empty());
  EXPECT_FALSE(server_.WorkAhead());
}

/// A program and what it imports, as an editor has them open: no disk has either.
class LspImports : public LspSession {
 protected:
  LspImports() {
    Show(kLibraryUri, kLibrary);
    Show(kMainUri, kMain);
  }
  void Show(const char* uri, const char* text) {
    Tell("textDocument/didOpen",
         {{"textDocument",
           {{"uri", uri}, {"languageId", "dynarole"}, {"version", 1}, {"text", text}}}});
  }
  /// What is said of a text, as the messages of its diagnostics.
  std::vector<std::string> Said(const std::string& uri) {
    while (server_.WorkAhead()) {
    }
    std::vector<std::string> said;
    for (const Json& message : sent_) {
      if (!message.contains("params") || message["params"]["uri"] != uri) continue;
      if (!message["params"].contains("diagnostics")) continue;
      said.clear();
      for (const Json& one : message["params"]["diagnostics"]) said.push_back(one["message"]);
    }
    return said;
  }
  Json At(const char* uri, int line, int character) {
    return {{"textDocument", {{"uri", uri}}},
            {"position", {{"line", line}, {"character", character}}}};
  }

  static constexpr const char* kMainUri = "file:///nowhere/main.dyn";
  static constexpr const char* kLibraryUri = "file:///nowhere/lib/waves.dyn";
  static constexpr const char* kMain =
      "import \"lib/waves.dyn\";\n"
      "role A extends Module {\n"
      "  startup s() { print(wave(3)); }\n"
      "}\n";
  static constexpr const char* kLibrary =
      "// A wave.\n"
      "function wave(int x) {\n"
      "  return 2 * x;\n"
      "}\n"
      "function still(int x) {\n"
      "  return x;\n"
      "}\n";
};

TEST_F(LspImports, AnImportedFileHasNoMarksForHavingNoRoles) {
  EXPECT_TRUE(Said(kMainUri).empty());
  EXPECT_TRUE(Said(kLibraryUri).empty());
}

TEST_F(LspImports, ErrorsOfAnImportedFileStandAtItsImportToo) {
  Show(kLibraryUri, "function wave(int x) {\n  return y;\n}\n");
  const std::vector<std::string> own = Said(kLibraryUri);
  ASSERT_EQ(own.size(), 1U);
  EXPECT_EQ(own[0].find("unknown name 'y'"), 0U) << own[0];
  const std::vector<std::string> main = Said(kMainUri);
  ASSERT_FALSE(main.empty());
  EXPECT_NE(main[0].find("lib/waves.dyn:2: unknown name 'y'"), std::string::npos) << main[0];
  // And go when it is mended.
  Show(kLibraryUri, kLibrary);
  EXPECT_TRUE(Said(kMainUri).empty());
}

TEST_F(LspImports, AMissingFileIsToldWhereItIsImported) {
  Show(kMainUri, "import \"gone.dyn\";\nrole A extends Module {\n}\n");
  const std::vector<std::string> said = Said(kMainUri);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_NE(said[0].find("gone.dyn': no such file"), std::string::npos) << said[0];
}

TEST_F(LspImports, DefinitionsAndReferencesLeadOverFiles) {
  const Json definition = Ask("textDocument/definition", At(kMainUri, 2, 24))["result"];
  ASSERT_EQ(definition.size(), 1U) << definition;
  EXPECT_EQ(definition[0]["uri"], kLibraryUri);
  EXPECT_EQ(definition[0]["range"]["start"]["line"], 1);
  // That of the import is the file.
  const Json file = Ask("textDocument/definition", At(kMainUri, 0, 12))["result"];
  ASSERT_EQ(file.size(), 1U) << file;
  EXPECT_EQ(file[0]["uri"], kLibraryUri);
  // From where it is declared all programs are found that call it.
  Json references = At(kLibraryUri, 1, 10);
  references["context"] = {{"includeDeclaration", false}};
  const Json calls = Ask("textDocument/references", references)["result"];
  ASSERT_EQ(calls.size(), 1U) << calls;
  EXPECT_EQ(calls[0]["uri"], kMainUri);
  const Json hover = Ask("textDocument/hover", At(kMainUri, 2, 24))["result"];
  EXPECT_NE(hover["contents"]["value"].get<std::string>().find("A wave."), std::string::npos);
}

TEST_F(LspImports, CompletionOffersWhatIsImported) {
  Show(kMainUri,
       "import \"lib/waves.dyn\";\nrole A extends Module {\n  startup s() {\n    st\n  }\n}\n");
  const Json offered = Ask("textDocument/completion", At(kMainUri, 3, 6))["result"];
  EXPECT_NE(JsonText(offered).find("\"still\""), std::string::npos) << offered;
}

TEST_F(LspImports, RenamingChangesAllFiles) {
  Json rename = At(kLibraryUri, 1, 10);
  rename["newName"] = "swing";
  const Json changes = Ask("textDocument/rename", rename)["result"]["changes"];
  ASSERT_EQ(changes.size(), 2U) << changes;
  EXPECT_EQ(changes[kMainUri].size(), 1U);
  EXPECT_EQ(changes[kLibraryUri].size(), 1U);
  // Not where it would mean something else in a program that imports it.
  Show(kMainUri,
       "import \"lib/waves.dyn\";\nfunction swing(int x) {\n  return x;\n}\n"
       "role A extends Module {\n  startup s() { print(swing(3)); }\n}\n");
  const Json refused = Ask("textDocument/rename", rename);
  ASSERT_TRUE(refused.contains("error")) << refused;
  EXPECT_NE(refused["error"]["message"].get<std::string>().find("main.dyn"), std::string::npos);
}

TEST_F(LspSession, EndsWithStatus0OnlyAfterShutdown) {
  Tell("exit", nullptr);
  EXPECT_TRUE(server_.ended());
  EXPECT_EQ(server_.exit_status(), 1);
  EXPECT_TRUE(Ask("shutdown", nullptr)["result"].is_null());
  EXPECT_TRUE(Ask("textDocument/hover", nullptr).contains("error"));
  Tell("exit", nullptr);
  EXPECT_EQ(server_.exit_status(), 0);
}

}  // namespace
}  // namespace morphbus::tools
