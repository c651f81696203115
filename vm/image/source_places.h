#pragma once
// Where the lines that an image tells stand: in which file, and on which of its lines. Host side
// only.

#include <string>
#include <utility>
#include <vector>

#include "vm/image/program.h"

namespace morphbus::vm {

/// A line of a file.
struct SourcePlace {
  /// Empty if it is not known.
  std::string file;
  /// From 1; 0: no line.
  int line = 0;

  auto operator<=>(const SourcePlace&) const = default;
};

/// The place in text, as editors jump to it, "walk.dyn:7"; "line 7" without a file.
std::string PlaceText(const SourcePlace& place);

/// The files of a program by the lines that VerifiedProgram::LineOf counts over all of them. It
/// outlives the program.
class SourceFiles {
 public:
  /// Of no program: lines are told without a file.
  SourceFiles() = default;
  explicit SourceFiles(const VerifiedProgram& program);

  /// The program's own file, as the image names it.
  [[nodiscard]] const std::string& own() const { return own_; }
  /// The place of a line. `called` is the path by which the program's own file is known here, from
  /// whose folder the others are told; empty: as the image names them.
  [[nodiscard]] SourcePlace Of(int line, const std::string& called = "") const;
  /// The line that VerifiedProgram::LineOf counts for a place, whose file may be the end of a path;
  /// without a file it is the program's own. 0 if the program has no code from there.
  [[nodiscard]] int LineOfAll(const SourcePlace& place) const;

 private:
  std::string own_;
  /// The first line of each imported file, and its name, in the order of the lines.
  std::vector<std::pair<int, std::string>> imported_;
};

}  // namespace morphbus::vm
