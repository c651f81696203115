#pragma once
// Text in VRML's form, as Webots' worlds have it.

#include <string>
#include <vector>

#include "compiler/emit/numbers.h"
#include "compiler/model/robot_model.h"

namespace morphbus::emit {

/// Axis and angle, as VRML writes rotations.
inline std::string Rotation(const Eigen::Matrix3d& R) {
  const Eigen::AngleAxisd turn(Canonical(R));
  return Triple(turn.axis()) + " " + Number(turn.angle());
}

/// VRML text: nodes with fields and blocks, indented.
class VrmlWriter {
 public:
  /// A line of its own, such as a field.
  void Line(const std::string& text) {
    text_.append(2 * depth_, ' ');
    text_ += text + "\n";
  }
  /// "HingeJoint {" or "children [".
  void Open(const std::string& text) {
    Line(text);
    ++depth_;
  }
  /// Ends what was opened: "}" or "]".
  void Close(const char* bracket) {
    --depth_;
    Line(bracket);
  }
  /// A node, or another block in braces, of these lines alone.
  void Block(const std::string& head, const std::vector<std::string>& lines) {
    Open(head + " {");
    for (const std::string& line : lines) Line(line);
    Close("}");
  }
  /// Where a node stands in the one around it.
  void Place(const model::Pose& X) {
    Line("translation " + Triple(X.translation()));
    Line("rotation " + Rotation(X.linear()));
  }
  /// What has been written so far.
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
  size_t depth_ = 0;
};

}  // namespace morphbus::emit
