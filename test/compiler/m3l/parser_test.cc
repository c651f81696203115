#include "compiler/m3l/parser.h"

#include <fstream>
#include <sstream>

#include "test/support/diagnostics_test.h"
#include "test/support/source_dir.h"

namespace morphbus::m3l {
namespace {

std::string Listing(const std::string& name) {
  std::ifstream file(test::SourcePath("test/compiler/m3l/listings/") + name);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

class ParserTest : public test::DiagnosticsTest {
 protected:
  FileAst ParseText(const std::string& text) {
    const int file = sources_.AddText("t.m3l", text);
    source::Diagnostics diagnostics;
    FileAst ast = Parse(Tokenize(sources_, file, kMaxTokens, &diagnostics), &diagnostics);
    Collect(diagnostics, sources_);
    return ast;
  }
  std::string Dump(const std::string& text) { return DumpAst(ParseText(text)); }
  /// The dump of one attribute value.
  std::string Value(const std::string& text) {
    const std::string dump = Dump("robot r: x=" + text);
    const std::string head = "robot r\n  x=";
    return dump.substr(0, head.size()) == head
               ? dump.substr(head.size(), dump.size() - head.size() - 1)
               : dump;
  }
  source::SourceSet sources_;
};

TEST_F(ParserTest, DumpShowsTheWholeTree) {
  EXPECT_EQ(Dump("import \"a.m3l\"\n"
                 "module M: unit=0.5\n"
                 "point c: (point _1: coords=(1,0,0)) (point _2: coords=(0,1,0))\\\n"
                 "coords=(0,0,0), connector, extended=[bool]\n"
                 "link l: (point own: coords=(0,0,1)) grouping=(c), hull=convex(c.point,l.point)\n"
                 "axis x: origin=(0,0,0), direction=(0,0,1)\n"
                 "joint j: type=revolute,value=[-pi/2,pi/2],pair=((l,x),(k,y))\n"
                 "connection C: members=(M a, M b), conditions=(a.point p coincident b.point q)\n"
                 "robot R: modules=(M m1), connections=((m1.c,m1.d,3))\n"),
            "import \"a.m3l\"\n"
            "module M\n"
            "  unit=0.5\n"
            "  point c\n"
            "    coords={tuple 0 0 0}\n"
            "    connector\n"
            "    extended={list bool}\n"
            "    point _1\n"
            "      coords={tuple 1 0 0}\n"
            "    point _2\n"
            "      coords={tuple 0 1 0}\n"
            "  link l\n"
            "    grouping={tuple c}\n"
            "    hull={call convex c.point l.point}\n"
            "    point own\n"
            "      coords={tuple 0 0 1}\n"
            "  axis x\n"
            "    origin={tuple 0 0 0}\n"
            "    direction={tuple 0 0 1}\n"
            "  joint j\n"
            "    type=revolute\n"
            "    value={list {/ {- pi} 2} {/ pi 2}}\n"
            "    pair={tuple {tuple l x} {tuple k y}}\n"
            "connection C\n"
            "  members={tuple {M as a} {M as b}}\n"
            "  conditions={tuple {coincident {a.point as p} {b.point as q}}}\n"
            "robot R\n"
            "  modules={tuple {M as m1}}\n"
            "  connections={tuple {tuple m1.c m1.d 3}}\n");
}

TEST_F(ParserTest, OperatorsBindAsInMathematics) {
  EXPECT_EQ(Value("1+2*3-4/2"), "{+- 1 {* 2 3} {/ 4 2}}");
  EXPECT_EQ(Value("-2*3"), "{* {- 2} 3}");
  EXPECT_EQ(Value("--2"), "{- {- 2}}");
  EXPECT_EQ(Value("a==1 and b!=2 or not c<3"), "{or {and {== a 1} {!= b 2}} {not {< c 3}}}");
  EXPECT_EQ(Value("(a+1)*2"), "{* {tuple {+ a 1}} 2}");
  EXPECT_EQ(Value("1 < sqrt(2)+1"), "{< 1 {+ {call sqrt 2} 1}}");
}

TEST_F(ParserTest, RelationsOfAllKinds) {
  EXPECT_EQ(Value("(p parallel q and p antiparallel r)"),
            "{tuple {and {parallel p q} {antiparallel p r}}}");
  EXPECT_EQ(Value("(a >= 1 and a > 0 and a <= 2)"), "{tuple {and {>= a 1} {> a 0} {<= a 2}}}");
}

TEST_F(ParserTest, DockingArgumentsInAllForms) {
  EXPECT_EQ(Value("((a.c,b.d), (a.c,b.d,-3), (a.c,b.d,rot=180), (a.c,b.d,N:2))"),
            "{tuple {tuple a.c b.d} {tuple a.c b.d {- 3}} {tuple a.c b.d {set rot 180}} "
            "{tuple a.c b.d {option N 2}}}");
}

TEST_F(ParserTest, AnonymousAxesInAFrame) {
  EXPECT_EQ(Value("(m5.l.(axis: origin=(1,0,0), direction=(0,1,0)), m5.l.x)"),
            "{tuple {axis m5.l origin={tuple 1 0 0} direction={tuple 0 1 0}} m5.l.x}");
}

TEST_F(ParserTest, KeywordsMayBeAttributesAndFollowADot) {
  EXPECT_EQ(Dump("robot r: link=1, x=a.point"), "robot r\n  link=1\n  x=a.point\n");
}

TEST_F(ParserTest, EmptyAndBlankFilesAreFine) {
  EXPECT_EQ(Dump(""), "");
  EXPECT_EQ(Dump(" // nothing\n"), "");
  EXPECT_EQ(Value("()"), "{tuple}");
}

TEST_F(ParserTest, ListingOfFigure8ParsesAsPrinted) {
  const FileAst ast = ParseText(Listing("fig8.m3l"));
  ASSERT_EQ(ast.modules.size(), 1U);
  EXPECT_EQ(ast.modules[0].points.size(), 6U);
  EXPECT_EQ(ast.modules[0].points[5].subpoints.size(), 4U);
  EXPECT_EQ(ast.modules[0].links.size(), 3U);
  EXPECT_EQ(ast.modules[0].axes.size(), 4U);
  EXPECT_EQ(ast.modules[0].joints.size(), 2U);
  ASSERT_EQ(ast.connections.size(), 1U);
  const Expr& conditions = *ast.connections[0].Find("conditions")->value;
  EXPECT_EQ(conditions.children[0].children.size(), 6U);
}

TEST_F(ParserTest, ListingOfFigure9ParsesButForItsElision) {
  const FileAst ast = ParseText(Listing("fig9.m3l"));
  TakeError("'...' stands for something left out");
  ASSERT_EQ(ast.robots.size(), 2U);
  EXPECT_EQ(ast.robots[0].attributes.size(), 3U);
  EXPECT_EQ(ast.robots[1].attributes.size(), 2U);
  EXPECT_EQ(ast.robots[1].Find("connections")->value->children.size(), 10U);
}

TEST_F(ParserTest, UnclosedParenthesisIsShownWhereItOpens) {
  ParseText("module M:\npoint a: coords=(1,2,3\npoint b: coords=(1,2,3)\n");
  const source::Diagnostic d = TakeError("'(' is never closed");
  EXPECT_EQ(LineOf(d.span), 2);
  EXPECT_EQ(TextAt(d.span), "(");
}

TEST_F(ParserTest, IndependentErrorsAreAllFound) {
  const FileAst ast = ParseText(
      "module M:\npoint a: coords=(1,,3), flag\npoint b: coords=(1 2), x=)\n"
      "joint j: type=, value=[1,2]\nrobot r: modules=(M m1");
  EXPECT_EQ(LineOf(TakeError("expected a value, found ','").span), 2);
  EXPECT_EQ(LineOf(TakeError("expected ',' or ')', found '2'").span), 3);
  EXPECT_EQ(LineOf(TakeError("expected a value, found ')'").span), 3);
  EXPECT_EQ(LineOf(TakeError("expected a value, found ','").span), 4);
  EXPECT_EQ(LineOf(TakeError("'(' is never closed").span), 5);
  // What follows a broken attribute is still there.
  EXPECT_NE(ast.modules[0].points[0].Find("flag"), nullptr);
  EXPECT_TRUE(ast.modules[0].points[0].broken);
  EXPECT_NE(ast.modules[0].joints[0].Find("value"), nullptr);
}

TEST_F(ParserTest, MisspeltKeywordsAreMended) {
  const FileAst ast = ParseText("modul M:\npiont a: coords=(0,0,0)\nlnik l: grouping=(a)\n");
  EXPECT_EQ(TakeError("unknown statement 'modul'").hint, "did you mean 'module'?");
  EXPECT_EQ(TakeError("unknown statement 'piont'").hint, "did you mean 'point'?");
  EXPECT_EQ(TakeError("unknown statement 'lnik'").hint, "did you mean 'link'?");
  ASSERT_EQ(ast.modules.size(), 1U);
  EXPECT_EQ(ast.modules[0].points.size(), 1U);
  EXPECT_EQ(ast.modules[0].links.size(), 1U);
}

TEST_F(ParserTest, MembersOutsideOfAModuleAreReportedOnceARun) {
  ParseText("point a: coords=(0,0,0)\npoint b: coords=(0,0,0)\nmodule M:\nrobot r: x=1\nlink l:\n");
  EXPECT_EQ(LineOf(TakeError("'point' stands outside of a module").span), 1);
  EXPECT_EQ(LineOf(TakeError("'link' stands outside of a module").span), 5);
}

TEST_F(ParserTest, SubPointsHaveNoSubPoints) {
  ParseText(
      "module M:\npoint a: (point b: (point c: coords=(0,0,0)) coords=(0,0,0)) coords=(0,0,0)\n");
  TakeError("a 'point' cannot stand here");
}

TEST_F(ParserTest, PointsOfALinkMayHaveSubPoints) {
  const FileAst ast = ParseText(
      "module M:\nlink l: (point a: (point _1: coords=(0,0,0)) coords=(0,0,0), connector) "
      "mass=1\n");
  EXPECT_EQ(ast.modules[0].links[0].points[0].subpoints.size(), 1U);
}

TEST_F(ParserTest, MissingCommaIsReportedAndMended) {
  const FileAst ast = ParseText("module M:\npoint a: coords=(0,0,0) connector\n");
  TakeError("expected ',' before 'connector'");
  EXPECT_EQ(ast.modules[0].points[0].attributes.size(), 2U);
}

TEST_F(ParserTest, MissingNameAndColonAreReported) {
  ParseText("module :\npoint a coords=(0,0,0)\n");
  TakeError("expected a name, found ':'");
  TakeError("expected ':' after 'a', found 'coords'");
}

TEST_F(ParserTest, ComparisonInPlaceOfAnAttributeGetsAHint) {
  ParseText("module M:\npoint a: gender==\"male\", coords=(0,0,0)\n");
  EXPECT_NE(TakeError("expected '=' after 'gender', found '=='").hint, "");
}

TEST_F(ParserTest, ComparisonsDoNotChain) {
  ParseText("robot r: x=(1<2<3)");
  TakeError("comparisons do not chain");
}

TEST_F(ParserTest, KeywordsAreNoNames) {
  ParseText("module point: unit=1\nmodule M:\nlink and: mass=1\n");
  TakeError("'point' is a keyword");
  TakeError("'and' is a keyword");
}

TEST_F(ParserTest, NestingIsBounded) {
  for (const char* opener : {"(", "[", "-", "not ", "f("}) {
    std::string text = "robot r: x=";
    for (int i = 0; i < 100'000; ++i) text += opener;
    ParseText(text);
    TakeError("nested deeper than 100 levels");
  }
}

TEST_F(ParserTest, LongChainsAreFlat) {
  std::string text = "robot r: x=1";
  for (int i = 0; i < 100'000; ++i) text += "+1*2 and a";
  const FileAst ast = ParseText(text);
  EXPECT_EQ(ast.robots[0].attributes[0].value->children.size(), 100'001U);
}

TEST_F(ParserTest, SyntaxErrorsAreBounded) {
  std::string text;
  for (int i = 0; i < 50'000; ++i) text += "robot r: x=)\n";
  ParseText(text);
  for (int i = 0; i < kMaxSyntaxErrors; ++i) TakeError("expected a value, found ')'");
  TakeError("too many errors");
}

TEST_F(ParserTest, HugeNumbersBecomeInfinity) {
  EXPECT_EQ(Value("1e999"), "inf");
  EXPECT_EQ(Value("1" + std::string(400, '0')), "inf");
  EXPECT_EQ(Value("0." + std::string(400, '0') + "1"), "0");
  EXPECT_EQ(Value("1e-999"), "0");
}

TEST_F(ParserTest, ImportsNeedAFileName) {
  EXPECT_EQ(Dump("import mtran\nrobot r: x=1"), "robot r\n  x=1\n");
  TakeError("expected a file name, found 'mtran'");
}

}  // namespace
}  // namespace morphbus::m3l
