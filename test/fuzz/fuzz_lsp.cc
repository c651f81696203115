// Any bytes as the edits of somebody who types, and as messages: the language server answers each
// request, and never crashes, hangs or grows without bound.
//
// A byte chooses what is done, those behind it where and with what; bytes that begin with '{' are
// messages, a line each.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tools/lsp/language_server.h"

namespace {

using morphbus::tools::Json;
using morphbus::tools::LanguageServer;

constexpr const char* kModel = "untitled:m.m3l";
constexpr const char* kProgram = "untitled:p.dyn";

// Texts with one of everything that can be asked about.
constexpr const char* kModelText =
    "const r = 0.5\nmodule M: unit=0.05\n"
    "point c: (point _1: coords=(1, 0, r)) coords=(1, 0, 0), connector, normal=(1, 0, 0), "
    "g=[bool]\n"
    "point d: (point _1: coords=(-1, 0, r)) coords=(-1, 0, 0), connector, normal=(-1, 0, 0)\n"
    "link a: (point e: coords=(0, 0, 1)) grouping=(c), hull=box(size=(1, 1, 1)), mass=0.1\n"
    "link b: grouping=(d), hull=convex(d.point, a.e)+sphere(radius=r)\n"
    "axis x: origin=(0, 0, 0), direction=(0, 0, 1)\naxis y: origin=(0, 0, 0), direction=(0, 0, "
    "-1)\n"
    "joint j: type=revolute, value=[-pi/2, 90deg], pair=((a, x), (b, y)), torque=1\n"
    "sensor s: type=distance, link=a, origin=(0, 0, 0), direction=(1, 0, 0), range=2\n"
    "connection C: members=(M a, M b), conditions=(a.point p coincident b.point q and p._1 "
    "coincident q._1 and p.g == true)\n"
    "robot t: modules=(M m1, M m2), connections=((m1.c, m2.d, rot=0)), joints=(m1.j=0),\n"
    "  frame=(m1.a.(axis: origin=(0,0,0), direction=(1,0,0)), m1.a.x, m1.a.y)\n";
constexpr const char* kProgramText =
    "param p = 1.5 in [0, 9];\nconst k = 2;\nabstract role A extends Module {\n  side;\n"
    "  require self.connected(side) == 1;\n  label l = self.joints($ANY, 1);\n"
    "  function f(x) { return x * k; }\n  command go(float d, n) { side = $NORTH; }\n"
    "  startup s() { var v = f(p); self.jointSetDegrees(l, v); A.go(v, 1); print(\"v\", v); }\n}\n"
    "role B extends A {\n  side = $UP;\n  shared w = 1;\n  startup s() { super.s(); }\n"
    "  behavior b() { for (var i = 0; i < k; i += 1) { w += i; } self.sleepds(1); }\n"
    "  handler h() every 0.5 { if (self.connected($UP, $B) == 1) { w = self.connected($UP, $B).w; "
    "} }\n"
    "}\n";

constexpr const char* kPieces[] = {"(",     ")",       ",",  ".",    "\"",     "$",
                                   "{",     "}",       ":",  "=",    ";",      "x",
                                   "1e9",   "\n",      "/*", "//",   "self.",  "m1.",
                                   "role ", "module ", "p.", "and ", "\u00fc", "\U0001F916"};

constexpr const char* kQuestions[] = {
    "textDocument/hover",         "textDocument/completion", "textDocument/signatureHelp",
    "textDocument/definition",    "textDocument/references", "textDocument/documentHighlight",
    "textDocument/prepareRename", "textDocument/rename",     "textDocument/documentSymbol",
    "textDocument/formatting",    "textDocument/codeAction", "textDocument/inlayHint",
    "workspace/symbol",           "morphbus/preview"};

/// A session that notes whether each request was answered.
class Session {
 public:
  Session()
      : server_([this](const Json& message) { answered_ = answered_ || message.contains("id"); }) {
    Ask("initialize",
        {{"capabilities", Json::object()}, {"initializationOptions", {{"models", {kModel}}}}});
    Open(kModel, kModelText);
    Open(kProgram, kProgramText);
  }

  void Take(const std::string& text) { server_.Take(text); }

  void Ask(const std::string& method, const Json& parameters) {
    answered_ = false;
    server_.Take(morphbus::tools::JsonText(
        Json{{"jsonrpc", "2.0"}, {"id", 1}, {"method", method}, {"params", parameters}}));
    if (!answered_) __builtin_trap();
  }

  void Change(const char* uri, const Json& from, const Json& to, const std::string& text) {
    Tell("textDocument/didChange",
         {{"textDocument", {{"uri", uri}, {"version", 2}}},
          {"contentChanges", {{{"range", {{"start", from}, {"end", to}}}, {"text", text}}}}});
  }

  /// Publishes what has changed; which robots fit is tested elsewhere, for each takes a simulation.
  void Work() {
    for (int i = 0; i < 2; ++i) server_.WorkAhead();
  }

 private:
  void Tell(const std::string& method, const Json& parameters) {
    server_.Take(morphbus::tools::JsonText(
        Json{{"jsonrpc", "2.0"}, {"method", method}, {"params", parameters}}));
  }
  void Open(const char* uri, const char* text) {
    Tell("textDocument/didOpen",
         {{"textDocument", {{"uri", uri}, {"version", 1}, {"text", text}}}});
  }

  bool answered_ = false;
  LanguageServer server_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  Session session;
  if (size > 0 && data[0] == '{') {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    for (size_t begin = 0; begin < size;) {
      const size_t end = std::min(text.find('\n', begin), size);
      session.Take(std::string(text.substr(begin, end - begin)));
      begin = end + 1;
    }
    return 0;
  }
  // Six bytes an action: which document, where, how much goes, what comes, what is asked.
  constexpr size_t kBytes = 6, kMostActions = 40;
  for (size_t i = 0; i + kBytes <= size && i < kBytes * kMostActions; i += kBytes) {
    const uint8_t* byte = data + i;
    const char* uri = (byte[0] & 1) != 0 ? kModel : kProgram;
    const Json from = {{"line", byte[1] % 20}, {"character", byte[2] % 120}};
    const Json to = {{"line", byte[1] % 20 + (byte[3] & 1)},
                     {"character", byte[2] % 120 + byte[3] % 16}};
    if ((byte[0] & 2) != 0) session.Change(uri, from, to, kPieces[byte[4] % std::size(kPieces)]);
    Json parameters = {{"textDocument", {{"uri", uri}}},
                       {"position", from},
                       {"range", {{"start", from}, {"end", to}}},
                       {"newName", "z"},
                       {"query", "a"}};
    session.Ask(kQuestions[byte[5] % std::size(kQuestions)], parameters);
    if ((byte[0] & 4) != 0) session.Work();
  }
  return 0;
}
