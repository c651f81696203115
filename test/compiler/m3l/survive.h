#pragma once
// Sources that nobody would write, for tests of compiling.

#include <gtest/gtest.h>

#include <string>

#include "compiler/m3l/compile.h"

namespace morphbus::m3l {

/// Compiles and renders; the rest is up to the sanitizers.
inline void Survive(const std::string& text) {
  const CompileOutput output = CompileText("hostile.m3l", text);
  EXPECT_NE(output.model.has_value(), output.diagnostics.had_errors());
  const std::string rendered = source::Render(output.diagnostics, output.sources, false);
  EXPECT_LT(rendered.size(), 2'000'000U);
}

inline std::string Repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

/// Compiles sources of about so many tokens, in each of which one thing comes again and again.
inline void SurviveTokens(int tokens) {
  Survive("robot r: modules=(" + Repeated("A m, ", 2 * tokens / 5) + ")");
  Survive("robot r: x=1" + Repeated("+1", tokens / 2 - 1'000));
  Survive(Repeated("module A:\n", 3 * tokens / 10));
  Survive(Repeated("point p: coords=(1,2,3)\n", 2 * tokens / 25));
  Survive("module A:\nlink l: hull=convex(" + Repeated("q,", 2 * tokens / 5) + "q)");
}

}  // namespace morphbus::m3l
