#pragma once
// The programs that stand in the documentation, which the suite compiles and runs.

#include <fstream>
#include <string>
#include <vector>

#include "test/support/source_dir.h"

namespace morphbus::test {

/// A program between the marks "```dyn NAME" and "```".
struct DocExample {
  std::string name;  ///< Empty without one.
  std::string text;
  int line = 0;  ///< In the document, of its first line.
};

/// All of a document, in their order.
inline std::vector<DocExample> DocExamples(const std::string& document) {
  std::vector<DocExample> examples;
  std::ifstream file(SourcePath(document));
  bool inside = false;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    if (!inside && line.rfind("```dyn", 0) == 0) {
      inside = true;
      examples.push_back({line.size() > 7 ? line.substr(7) : "", "", number + 1});
    } else if (inside && line == "```") {
      inside = false;
    } else if (inside) {
      examples.back().text += line + "\n";
    }
  }
  return examples;
}

}  // namespace morphbus::test
