// Any bytes as an M3L text: diagnostics or a model, explanations of the connections in it, and a
// canonical layout that changes neither; never a crash, a hang or unbounded memory.

#include <cstdint>
#include <optional>
#include <string>

#include "compiler/m3l/compile.h"
#include "compiler/m3l/format.h"
#include "compiler/solver/explain_pair.h"

namespace {

/// Pairs of connectors that are explained of one text; more would only take time.
constexpr int kMaxPairs = 8;

void Require(bool holds) {
  if (!holds) __builtin_trap();
}

/// What `connections --why` does, which also takes texts with errors in them: every connection that
/// is offered for explanation has members that exist, and each of its pairs can be explained.
void ExplainConnections(const morphbus::m3l::CompileOutput& output) {
  const auto& types = output.solved.module_types;
  const int num_types = static_cast<int>(types.size());
  const auto& connections = output.solved.connection_types;
  Require(output.problems.size() == connections.size());
  Require(output.explainable.size() == connections.size());
  int pairs = 0;
  for (size_t c = 0; c < connections.size(); ++c) {
    const int type_a = connections[c].type_a, type_b = connections[c].type_b;
    Require(type_a >= 0 && type_a < num_types && type_b >= 0 && type_b < num_types);
    Require(output.problems[c].type_a == type_a && output.problems[c].type_b == type_b);
    if (!output.explainable[c]) continue;
    const int num_a = static_cast<int>(types[type_a].connectors.size());
    const int num_b = static_cast<int>(types[type_b].connectors.size());
    for (int a = 0; a < num_a; ++a) {
      for (int b = 0; b < num_b && pairs < kMaxPairs; ++b, ++pairs) {
        morphbus::solver::ExplainPair(output.problems[c], types, a, b);
      }
    }
  }
}

std::optional<std::string> Layout(const std::string& text) {
  morphbus::source::SourceSet sources;
  morphbus::source::Diagnostics diagnostics;
  const int file = sources.AddText("fuzz.m3l", text);
  return morphbus::m3l::Format(sources, file, &diagnostics);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto output = morphbus::m3l::CompileText("fuzz.m3l", text);
  // Rendering walks every span, so a span outside the text is found here.
  const std::string rendered =
      morphbus::source::Render(output.diagnostics, output.sources, /*color=*/false);
  Require(output.model.has_value() != output.diagnostics.had_errors());
  Require(!output.diagnostics.had_errors() || !rendered.empty());
  ExplainConnections(output);

  const std::optional<std::string> formatted = Layout(text);
  Require(!output.model || formatted);
  if (formatted) {
    Require(Layout(*formatted) == formatted);
    Require(!output.model == !morphbus::m3l::CompileText("fuzz.m3l", *formatted).model);
  }
  return 0;
}
