#pragma once
// Text in VRML's form, as Webots' worlds have it.

#include <array>
#include <string>
#include <vector>

#include "compiler/emit/numbers.h"
#include "compiler/model/convex_hull.h"
#include "compiler/model/robot_model.h"
#include "compiler/world/surface.h"

namespace morphbus::emit {

/// Axis and angle (rad), as VRML writes rotations. By the quaternion with w >= 0 (Canonical), so
/// that the angle is at most pi and equal rotations give equal texts.
inline std::string Rotation(const Eigen::Matrix3d& R) {
  const Eigen::AngleAxisd turn(Canonical(R));
  return Triple(turn.axis()) + " " + Number(turn.angle());
}

/// VRML text: nodes with fields and blocks, indented by two columns a level. It checks nothing: the
/// caller opens and closes in pairs, and knows Webots' fields.
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
  /// A Shape of a hull, in a colour (red, green, blue, from 0 to 1), named for USE.
  void Hull(const std::string& name, const model::ConvexHull& hull, const Eigen::Vector3d& color) {
    Faces(name, FacesOf(hull), color);
  }
  /// The same of triangles.
  void Triangles(const std::string& name, const world::TriangleMesh& mesh,
                 const Eigen::Vector3d& color) {
    std::string faces;
    for (const std::array<int, 3>& triangle : mesh.triangles) faces += Face(triangle);
    Faces(name, FacesOf(mesh.points, faces), color);
  }
  /// The fields of an IndexedFaceSet.
  static std::vector<std::string> FacesOf(const model::ConvexHull& hull) {
    std::string faces;
    for (const model::HullFace& face : hull.faces) faces += Face(face.polygon);
    return FacesOf(hull.vertices, faces);
  }
  /// What has been written so far.
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  /// Each face is a list of corners that ends with -1.
  template <typename Corners>
  static std::string Face(const Corners& corners) {
    std::string face;
    for (const int corner : corners) face += std::to_string(corner) + " ";
    return face + "-1 ";
  }

  /// The same of corners (m) and faces as text.
  static std::vector<std::string> FacesOf(const std::vector<Eigen::Vector3d>& corners,
                                          const std::string& faces) {
    std::string points;
    for (const Eigen::Vector3d& p : corners) points += (points.empty() ? "" : ", ") + Triple(p);
    return {"coord Coordinate { point [ " + points + " ] }", "coordIndex [ " + faces + "]"};
  }

  /// A Shape with these faces, dull and without metal, whose geometry is called `name`.
  void Faces(const std::string& name, const std::vector<std::string>& faces,
             const Eigen::Vector3d& color) {
    Open("Shape {");
    Block("appearance PBRAppearance",
          {"baseColor " + Triple(color), "roughness 0.6", "metalness 0"});
    Block("geometry DEF " + name + " IndexedFaceSet", faces);
    Close("}");
  }

  std::string text_;
  size_t depth_ = 0;  ///< Levels that are open.
};

}  // namespace morphbus::emit
