// Any bytes as an M3L text: diagnostics or a model, never a crash, a hang or unbounded memory.

#include <cstdint>
#include <string>

#include "compiler/m3l/compile.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto output = morphbus::m3l::CompileText("fuzz.m3l", text);
  // Rendering walks every span, so a span outside the text is found here.
  const std::string rendered =
      morphbus::source::Render(output.diagnostics, output.sources, /*color=*/false);
  if (output.model.has_value() == output.diagnostics.had_errors()) __builtin_trap();
  if (output.diagnostics.had_errors() && rendered.empty()) __builtin_trap();
  return 0;
}
