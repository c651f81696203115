#include "compiler/m3l/lexer.h"

#include "compiler/m3l/parser.h"
#include "test/support/diagnostics_test.h"

namespace morphbus::m3l {
namespace {

class LexerTest : public test::DiagnosticsTest {
 protected:
  std::vector<Token> Tokens(const std::string& text, size_t max = kMaxTokens) {
    const int file = sources_.AddText("t.m3l", text);
    source::Diagnostics diagnostics;
    std::vector<Token> tokens = Tokenize(sources_, file, max, &diagnostics);
    Collect(diagnostics, sources_);
    return tokens;
  }
  /// Texts of all tokens, one space between.
  std::string Words(const std::string& text) {
    std::string words;
    for (const Token& token : Tokens(text)) {
      words += (words.empty() ? "" : " ") + std::string(sources_.text(token.span));
    }
    if (!words.empty() && words.back() == ' ') words.pop_back();
    return words;
  }
  source::SourceSet sources_;
};

TEST_F(LexerTest, DumpShowsPlaceKindAndText) {
  const std::vector<Token> tokens = Tokens("point c1: \\\n coords=(-.5, 1e-3) \"a b\" >=");
  EXPECT_EQ(DumpTokens(sources_, tokens),
            "1:1 word point\n1:7 word c1\n1:9 symbol :\n2:2 word coords\n2:8 symbol =\n"
            "2:9 symbol (\n2:10 symbol -\n2:11 number .5\n2:13 symbol ,\n2:15 number 1e-3\n"
            "2:19 symbol )\n2:21 string \"a b\"\n2:27 symbol >=\n2:29 end\n");
}

TEST_F(LexerTest, CommentsOfAllThreeKindsAreBlank) {
  EXPECT_EQ(Words("a // b\nc # d\ne /* f\n g */ h"), "a c e h");
  EXPECT_EQ(Words("a //"), "a");
  EXPECT_EQ(Words("a #"), "a");
}

TEST_F(LexerTest, BackslashMayEndALine) { EXPECT_EQ(Words("a\\\nb\\  \r\nc\\"), "a b c"); }

TEST_F(LexerTest, BackslashElsewhereIsReported) {
  EXPECT_EQ(Words("a \\ b"), "a b");
  EXPECT_EQ(TakeError("unexpected character '\\'").hint, "a backslash may only end a line");
}

TEST_F(LexerTest, SubPointNamesAreNoNumbers) { EXPECT_EQ(Words("p_a._1"), "p_a . _1"); }

TEST_F(LexerTest, NumbersInAllForms) {
  EXPECT_EQ(Words("1 1. .5 1.5 1e3 1E+3 1.5e-3"), "1 1. .5 1.5 1e3 1E+3 1.5e-3");
  EXPECT_EQ(Words("1,2)"), "1 , 2 )");
}

TEST_F(LexerTest, NumberThatRunsIntoANameIsReported) {
  Words("2x");
  TakeError("'2x' is neither a number nor a name");
  Words("1e");
  TakeError("'1e' is neither");
}

TEST_F(LexerTest, StringsResolveEscapes) {
  EXPECT_EQ(StringValue(R"("a\"b\\c\nd\te")"), "a\"b\\c\nd\te");
  EXPECT_EQ(StringValue("\"never closed"), "never closed");
  Words(R"("a\q")");
  TakeError("unknown escape");
}

TEST_F(LexerTest, UnclosedStringEndsWithItsLine) {
  EXPECT_EQ(Words("\"abc\nd"), "\"abc d");
  EXPECT_EQ(TakeError("string is never closed").span.begin, 0U);
}

TEST_F(LexerTest, UnclosedCommentIsReportedWhereItBegins) {
  EXPECT_EQ(Words("a /* b"), "a");
  EXPECT_EQ(TakeError("comment is never closed").span.begin, 2U);
}

TEST_F(LexerTest, EllipsisIsNoSyntax) {
  EXPECT_EQ(Words("a, ..."), "a ,");
  TakeError("'...' stands for something left out");
}

TEST_F(LexerTest, TypographicQuotesAreReportedAndRead) {
  const std::string quoted = "\xE2\x80\x9Cmale\xE2\x80\x9D";
  EXPECT_EQ(Words("a=" + quoted), "a = " + quoted);
  EXPECT_EQ(StringValue(quoted), "male");
  TakeError("typographic quotes");
  Words("\xE2\x80\x9Cnever closed\nb");
  TakeError("typographic quotes");
}

TEST_F(LexerTest, ForeignCharactersAreOneErrorARun) {
  EXPECT_EQ(Words("a \xC2\xB0\xC2\xB0 b"), "a b");  // Two degree signs.
  TakeError("unexpected characters '\\xc2\\xb0\\xc2\\xb0'");
  Words(std::string("a\0\0b", 4));
  TakeError("unexpected characters '\\x00\\x00'");
}

TEST_F(LexerTest, HabitsFromOtherLanguagesGetAHint) {
  Words("a;");
  EXPECT_EQ(TakeError("unexpected character ';'").hint, "statements need no separator");
  Words("'");
  EXPECT_EQ(TakeError("unexpected").hint, "strings are written with double quotes");
}

TEST_F(LexerTest, CarriageReturnsEndLinesAndTheirComments) {
  EXPECT_EQ(Words("a // b\rc # d\re \\\rf // g\r\nh"), "a c e f h");
  Words("\"a\rb");
  TakeError("string is never closed");
}

TEST_F(LexerTest, ControlCharactersInStringsAreReported) {
  EXPECT_EQ(Tokens("\"a\x01\x7f\"").size(), 2U);
  TakeError("control character '\\x01' in a string");
  TakeError("control character '\\x7f' in a string");
  Words("\"a\tb\"");
  EXPECT_EQ(TakeError("control character").hint, "write \\t for a tab");
}

TEST_F(LexerTest, WhatIsNotUtf8IsReportedOnceAFile) {
  EXPECT_EQ(Words("a \xE9 b // \xE9"), "a b");
  TakeError("byte \\xe9 is not UTF-8");
}

TEST_F(LexerTest, UnitsGetAHintAtTheNumberWithoutThem) {
  for (const auto& [text, hint] :
       {std::pair("45degrees", "write 45deg"),
        std::pair("10cm",
                  "lengths are in model units, metres unless 'unit=' says otherwise: 10cm "
                  "are 0.1 m"),
        std::pair("5mm",
                  "lengths are in model units, metres unless 'unit=' says otherwise: 5mm "
                  "are 0.005 m"),
        std::pair("3kg", "masses are in kg: write 3"),
        std::pair("3x", "a name starts with a letter or '_'; a product is written with '*'")}) {
    Words(text);
    EXPECT_EQ(TakeError("is neither a number nor a name").hint, hint);
  }
}

TEST_F(LexerTest, SignsOfOtherLanguagesAreReadAsTheWordsForThem) {
  std::string read;
  for (const Token& token : Tokens("a && b || !c")) read += std::string(token.text) + " ";
  EXPECT_EQ(read, "a and b or not c  ");
  EXPECT_EQ(TakeError("unexpected characters '&&'").hint, "write 'and'");
  EXPECT_EQ(TakeError("unexpected characters '||'").hint, "write 'or'");
  EXPECT_EQ(TakeError("unexpected character '!'").hint, "write 'not'");
}

TEST_F(LexerTest, ByteOrderMarkIsSkipped) {
  EXPECT_EQ(Words("\xEF\xBB\xBF"
                  "a"),
            "a");
}

TEST_F(LexerTest, ErrorsAreBounded) {
  const std::vector<Token> tokens = Tokens(std::string(100'000, ';'));
  EXPECT_EQ(tokens.size(), 1U);
  for (int i = 0; i < kMaxSyntaxErrors; ++i) TakeError("unexpected character ';'");
  TakeError("too many errors");
}

TEST_F(LexerTest, TokensAreBounded) {
  EXPECT_EQ(Tokens("a a a a a", 3).size(), 4U);
  TakeError("tokens, the rest is not read");
}

}  // namespace
}  // namespace morphbus::m3l
