// Any bytes as a file of tolerances: refused with a message and its place, or read as numbers that
// are tolerances.

#include <cmath>
#include <cstdint>
#include <string>

#include "logger/compare/tolerances.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace morphbus;
  source::SourceSet sources;
  const int file = sources.AddText("fuzz.toml", std::string(data, data + size));
  source::Diagnostics diagnostics;
  source::CheckUtf8(sources, file, &diagnostics);
  if (diagnostics.had_errors()) return 0;
  for (const auto& entry : logger::ParseTolerances(sources, file, &diagnostics)) {
    if (entry.which == nullptr || !(entry.value >= 0) || !std::isfinite(entry.value)) {
      __builtin_trap();
    }
    static_cast<void>(entry.Fits("FrontLeftLowerHalf", "knee"));
  }
  // Every error has its place within the text.
  for (const source::Diagnostic& diagnostic : diagnostics.all()) {
    if (diagnostic.message.empty() || diagnostic.span.end > size) __builtin_trap();
  }
  static_cast<void>(source::Render(diagnostics, sources, false));
  return 0;
}
