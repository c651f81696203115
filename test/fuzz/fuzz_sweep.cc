// Any bytes as the file of a sweep: refused with a message and its place, or read, and then its
// points can be told to runs.

#include <cmath>
#include <cstdint>
#include <string>

#include "tools/sweep/sampling.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace morphbus;
  source::SourceSet sources;
  const int file = sources.AddText("fuzz.toml", std::string(data, data + size));
  source::Diagnostics diagnostics;
  const auto sweep = tools::ReadSweepFile(&sources, file, "fuzz.toml", {}, &diagnostics);
  // Either there is a sweep or a reason why not, with its place within the text.
  if (sweep.has_value() == diagnostics.had_errors()) __builtin_trap();
  for (const source::Diagnostic& diagnostic : diagnostics.all()) {
    if (diagnostic.message.empty() || diagnostic.span.end > size + 1) __builtin_trap();
  }
  static_cast<void>(source::Render(diagnostics, sources, false));
  if (!sweep) return 0;
  // Few are enough: all points are made alike.
  double rows = (1.0 + sweep->variants) * std::max(1, sweep->samples) *
                static_cast<double>(sweep->runs.size());
  for (const auto& axis : sweep->axes)
    rows *= std::max<double>(1, static_cast<double>(axis.values.size()));
  if (rows > 1000) return 0;
  const auto points = tools::PointsOf(*sweep);
  if (!points) __builtin_trap();
  for (const tools::RunPoint& point : *points) {
    if (tools::OptionsOf(point, "folder").seconds <= 0) __builtin_trap();
    static_cast<void>(tools::RunCommand(point, "folder"));
  }
  return 0;
}
