// Any bytes as an M3L text: diagnostics or a model, and a canonical layout that changes neither;
// never a crash, a hang or unbounded memory.

#include <cstdint>
#include <optional>
#include <string>

#include "compiler/m3l/compile.h"
#include "compiler/m3l/format.h"

namespace {

std::optional<std::string> Layout(const std::string& text) {
  morphbus::source::SourceSet sources;
  morphbus::source::Diagnostics diagnostics;
  const int file = sources.AddText("fuzz.m3l", text);
  return morphbus::m3l::Format(sources, file, diagnostics);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto output = morphbus::m3l::CompileText("fuzz.m3l", text);
  // Rendering walks every span, so a span outside the text is found here.
  const std::string rendered =
      morphbus::source::Render(output.diagnostics, output.sources, /*color=*/false);
  if (output.model.has_value() == output.diagnostics.had_errors()) __builtin_trap();
  if (output.diagnostics.had_errors() && rendered.empty()) __builtin_trap();

  const std::optional<std::string> formatted = Layout(text);
  if (output.model && !formatted) __builtin_trap();
  if (formatted) {
    if (Layout(*formatted) != formatted) __builtin_trap();
    if (!output.model != !morphbus::m3l::CompileText("fuzz.m3l", *formatted).model) {
      __builtin_trap();
    }
  }
  return 0;
}
