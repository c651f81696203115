#pragma once
// A test fixture that hates silence: every diagnostic must be taken, or the test fails.

#include <gtest/gtest.h>

#include <deque>
#include <string>

#include "compiler/source/diagnostics.h"

namespace morphbus::test {

class DiagnosticsTest : public ::testing::Test {
 protected:
  ~DiagnosticsTest() override {
    for (const source::Diagnostic& d : pending_) {
      ADD_FAILURE() << "unexpected diagnostic: " << Text(d);
    }
  }

  /// Queues what a compilation reported, in order of place.
  void Collect(const source::Diagnostics& diagnostics, const source::SourceSet& sources) {
    for (const source::Diagnostic& d : diagnostics.all()) pending_.push_back(d);
    sources_ = sources;
  }

  /// Takes the first pending error or warning whose message holds `part`; fails if there is none.
  source::Diagnostic TakeError(const std::string& part) {
    return Take(source::Severity::kError, part);
  }
  source::Diagnostic TakeWarning(const std::string& part) {
    return Take(source::Severity::kWarning, part);
  }

  /// The source text that a span covers.
  std::string TextAt(const source::Span& span) const { return std::string(sources_.text(span)); }
  int LineOf(const source::Span& span) const { return sources_.Locate(span.file, span.begin).line; }

 private:
  source::Diagnostic Take(source::Severity severity, const std::string& part) {
    for (auto it = pending_.begin(); it != pending_.end(); ++it) {
      if (it->severity != severity || it->message.find(part) == std::string::npos) continue;
      source::Diagnostic found = *it;
      pending_.erase(it);
      return found;
    }
    ADD_FAILURE() << "no diagnostic with '" << part << "'";
    return {};
  }
  std::string Text(const source::Diagnostic& d) const {
    const bool error = d.severity == source::Severity::kError;
    std::string place = "?";
    if (d.span.file < sources_.size()) {
      place = sources_.name(d.span.file) + ":" + std::to_string(LineOf(d.span));
    }
    return place + (error ? ": error: " : ": warning: ") + d.message;
  }

  std::deque<source::Diagnostic> pending_;
  source::SourceSet sources_;
};

}  // namespace morphbus::test
