// Any bytes as a DynaRole program: diagnostics or an image that the verifier accepts, and a
// canonical layout that changes neither; never a crash, a hang or unbounded memory.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "compiler/dynarole/compile.h"
#include "compiler/dynarole/format.h"
#include "vm/image/verifier.h"

namespace {

/// Keywords of a module type like M-TRAN, with one of every kind.
morphbus::keywords::KeywordTable Keywords() {
  morphbus::keywords::ModuleKeywords type;
  type.links = {{"connecting_bar", "LINK_CONNECTING_BAR"}};
  type.joints = {{"joint_1", "JOINT_1"}, {"joint_2", "JOINT_2"}};
  type.connectors = {{"c1", "C1", {{"extended", "EXTENDED", {false, true}}}}};
  return *morphbus::keywords::KeywordTable::Of({type});
}

std::optional<std::string> Layout(const std::string& text) {
  morphbus::source::SourceSet sources;
  morphbus::source::Diagnostics diagnostics;
  const int file = sources.AddText("fuzz.dyn", text);
  return morphbus::dynarole::Format(sources, file, &diagnostics);
}

/// A file that the text may import.
constexpr const char* kLibrary =
    "const k = 2.5;\n"
    "param p = 3 in [1, 5];\n"
    "enum One { A, B }\n"
    "function f(float x) {\n  return k * x + p;\n}\n"
    "function g(x) {\n  print(f(x), A);\n}\n"
    "abstract role R extends Module {\n  y = 1;\n  startup s() {\n    g(y);\n  }\n}\n";

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const morphbus::keywords::KeywordTable kKeywords = Keywords();
  const std::string text(reinterpret_cast<const char*>(data), size);
  morphbus::source::NameTable names;
  // Nothing is read from disk: there are two files to import, which import each other, and whatever
  // else is imported is missing.
  const auto read = [](const std::string& path) -> morphbus::Result<std::string> {
    if (path == "a.dyn") return std::string(kLibrary);
    if (path == "b.dyn") return std::string("import \"a.dyn\";\nenum Two { C, D }\n");
    return morphbus::Fail("no such file");
  };
  const auto result = morphbus::dynarole::CompileProgram(
      "fuzz.dyn", text, kKeywords, morphbus::dynarole::Dump::kNone, &names, read);
  for (const morphbus::source::NameUse& use : names.uses) {
    // A name stands in one of the texts, and means something.
    if (use.span.file < 0 || use.span.file >= result.sources.size()) __builtin_trap();
    if (use.span.begin >= use.span.end ||
        use.span.end > result.sources.text(use.span.file).size()) {
      __builtin_trap();
    }
    if (use.thing < 0 || use.thing >= std::ssize(names.things)) __builtin_trap();
  }
  const std::string rendered =
      morphbus::source::Render(result.diagnostics, result.sources, /*color=*/false);
  if (result.image.has_value() == result.diagnostics.had_errors()) __builtin_trap();
  if (result.image) {
    const auto program = std::make_unique<morphbus::vm::VerifiedProgram>();
    const auto error = morphbus::vm::Verifier::Verify(
        result.image->data(), static_cast<uint32_t>(result.image->size()), program.get());
    if (error.message != nullptr) __builtin_trap();
  }
  const std::optional<std::string> formatted = Layout(text);
  if (result.image && !formatted) __builtin_trap();
  if (formatted && Layout(*formatted) != formatted) __builtin_trap();
  return 0;
}
