#include "compiler/emit/back_ends.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "compiler/emit/c_tables.h"

namespace morphbus::emit {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using model::JointType;

/// Links a function: compilers' time grows faster than a function's length.
constexpr size_t kLinksAFunction = 64;
/// Below this, and as near to +-1, a constant is taken for 0 or +-1 (m, or of a unit vector).
constexpr double kNoise = 1e-9;

/// A sum of products of constants and C expressions, without what is 0 or times 1.
class Sum {
 public:
  /// Adds `factor` times the C expression `term`; an empty term stands for 1.
  void Add(double factor, const std::string& term) {
    if (std::abs(factor) < kNoise) return;
    const bool minus = factor < 0.0;
    const double size = std::abs(factor);
    text_ += text_.empty() ? (minus ? "-" : "") : (minus ? " - " : " + ");
    if (std::abs(size - 1.0) < kNoise) {
      text_ += term.empty() ? "1.0f" : term;
    } else {
      text_ += CFloat(size) + (term.empty() ? "" : " * " + term);
    }
  }
  /// The sum as C; "0.0f" if nothing was added.
  [[nodiscard]] std::string text() const { return text_.empty() ? "0.0f" : text_; }

 private:
  std::string text_;
};

/// Element of a pose in the array: row, then column (3: the position).
std::string At(int link, int row, int column) {
  return fmt::format("X[{}][{}]", link, 4 * row + column);
}

// Writes a header and a source. The code has neither loops nor branches over the robot, so that
// what a link takes is known.
class Writer {
 public:
  Writer(const RobotTree& tree, const std::string& stem, std::string prefix, CTables tables)
      : tree_(tree), stem_(stem), prefix_(std::move(prefix)), tables_(std::move(tables)) {
    // The array lists links as M3L does, not in the tree's order.
    links_.resize(tree.links.size());
    std::iota(links_.begin(), links_.end(), size_t{0});
    std::ranges::sort(
        links_, {}, [&](size_t i) { return std::pair(tree.links[i].module, tree.links[i].link); });
    // `index_` and `links_` are each other's inverse: tree to array, array to tree.
    index_.resize(links_.size());
    for (size_t i = 0; i < links_.size(); ++i) index_[links_[i]] = static_cast<int>(i);
  }

  Exported Write() {
    Exported exported;
    exported.companions.push_back({stem_ + ".h", Header()});
    exported.companions.insert(exported.companions.end(), tables_.companions.begin(),
                               tables_.companions.end());
    exported.text = Source();
    return exported;
  }

 private:
  // A module type comes with tables for the virtual machine, a robot without.
  [[nodiscard]] const char* What() const {
    return tables_.definitions.empty() ? "Forward kinematics" : "Kinematics";
  }

  /// Text of the header.
  [[nodiscard]] std::string Header() const {
    // The header lists links and joints by name, then declares the function and the tables.
    std::vector<std::string> links;
    for (const size_t i : links_) links.push_back(tree_.links[i].name);
    std::vector<std::string> joints;
    for (const TreeJoint& joint : tree_.joints) joints.push_back(joint.name);
    const std::string guard = "MORPHBUS_" + prefix_ + "_KINEMATICS_H";
    std::string text = fmt::format(
        "/* {3} of {0}; written by morphbus export, not by hand. SI, radians. */\n"
        "#ifndef {1}\n#define {1}\n\n{2}"
        "#ifdef __cplusplus\nextern \"C\" {{\n#endif\n\n",
        tree_.name, guard, tables_.include, What());
    text += "/* Indices into X. */\n" + CEnumeration(prefix_, "link", links) +
            "\n/* Indices into q. */\n" + CEnumeration(prefix_, "joint", joints) + "\n";
    text += fmt::format(
        "/* Writes the pose of each link in the frame of {0} at the joint values q (rad, m).\n"
        "   q: {1}_num_joints values; X: room for {1}_num_links poses, not overlapping q.\n"
        "   A pose is a 3 x 4 matrix [R p], row by row: p_0 = R p_L + p, in metres. */\n"
        "void {1}_forward_kinematics(const float *q, float (*X)[12]);\n\n{2}"
        "#ifdef __cplusplus\n}}\n#endif\n\n#endif\n",
        tree_.name, prefix_, tables_.declarations);
    return text;
  }

  /// Text of the source.
  [[nodiscard]] std::string Source() const {
    // Large robots get one function for every few links, and one that calls them in order.
    const std::string name = prefix_ + "_forward_kinematics";
    std::string text = fmt::format(
        "/* {} of {}; written by morphbus export, not by hand. SI, radians. */\n"
        "#include \"{}.h\"\n\n#include <math.h>\n{}",
        What(), tree_.name, stem_, tables_.definitions);
    const size_t parts = (tree_.links.size() + kLinksAFunction - 1) / kLinksAFunction;
    for (size_t part = 0; part < parts; ++part) {
      text += fmt::format("\n{}void {}{}(const float *restrict q, float (*restrict X)[12]) {{\n",
                          parts > 1 ? "static " : "", name,
                          parts > 1 ? "_" + std::to_string(part) : "");
      // Each link needs its parent only, which an earlier function has placed.
      const size_t end = std::min((part + 1) * kLinksAFunction, tree_.links.size());
      std::string body;
      for (size_t i = part * kLinksAFunction; i < end; ++i) body += Place(i);
      // Compilers warn of a parameter that is not used.
      if (body.find("q[") == std::string::npos) text += "  (void)q;\n";
      text += body + "}\n";
    }
    if (parts > 1) {
      text += fmt::format("\nvoid {}(const float *restrict q, float (*restrict X)[12]) {{\n", name);
      for (size_t part = 0; part < parts; ++part)
        text += fmt::format("  {}_{}(q, X);\n", name, part);
      text += "}\n";
    }
    return text;
  }

  /// The statements that compute the pose of link i of the tree from its parent's.
  [[nodiscard]] std::string Place(size_t i) const {
    // How the link moves against its parent decides what has to be computed.
    const TreeLink& link = tree_.links[i];
    std::string text = fmt::format("  /* {} */\n", link.name);
    const int at = index_[i];
    const int parent = link.parent < 0 ? -1 : index_[link.parent];
    if (link.joint < 0 || tree_.joints[link.joint].type == JointType::kFixed) {
      return text + PlaceRigid(at, parent, link.X_PL);
    }
    const TreeJoint& joint = tree_.joints[link.joint];
    const std::string q = fmt::format("q[{}]", link.joint);
    if (joint.type == JointType::kPrismatic) return text + PlaceSlide(at, parent, joint, q);
    text +=
        fmt::format("  {{\n    const float s = sinf({0});\n    const float c = cosf({0});\n", q);
    // An axis along one of the frame's own makes a third of the products vanish.
    for (int k = 0; k < 3; ++k) {
      if (std::abs(std::abs(joint.axis[k]) - 1.0) > kNoise) continue;
      return text + PlaceTurn(at, parent, joint, k) + "  }\n";
    }
    return text + PlaceAnyTurn(at, parent, joint) + "  }\n";
  }

  // A link that a connection or a fixed joint holds, or (`parent` -1) a root, which stands where it
  // stands whatever the joints do.
  static std::string PlaceRigid(int at, int parent, const model::Pose& X_PL) {
    std::string text;
    // X_RL = X_RP * X_PL, element by element, without the products that are 0.
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) {
        Sum sum;
        if (parent < 0) sum.Add(X_PL(row, column), "");
        if (parent >= 0 && column == 3) sum.Add(1.0, At(parent, row, 3));
        for (int k = 0; k < 3 && parent >= 0; ++k) sum.Add(X_PL(k, column), At(parent, row, k));
        text += fmt::format("  {} = {};\n", At(at, row, column), sum.text());
      }
    }
    return text;
  }

  // A prismatic joint moves the origin along its axis and turns nothing.
  static std::string PlaceSlide(int at, int parent, const TreeJoint& joint, const std::string& q) {
    std::string text;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        text += fmt::format("  {} = {};\n", At(at, row, column), At(parent, row, column));
      }
      Sum sum;
      for (int k = 0; k < 3; ++k) sum.Add(joint.axis[k], At(parent, row, k));
      text += fmt::format("  {} = {} + {} * ({});\n", At(at, row, 3), At(parent, row, 3), q,
                          sum.text());
    }
    return text;
  }

  /// About the frame's own axis k: two columns turn, and the origin about the axis.
  static std::string PlaceTurn(int at, int parent, const TreeJoint& joint, int k) {
    // The other two axes, right-handed, and the signs of the sine for either sense of the axis.
    const int u = (k + 1) % 3;
    const int v = (k + 2) % 3;
    const char* with = joint.axis[k] > 0.0 ? "+" : "-";
    const char* against = joint.axis[k] > 0.0 ? "-" : "+";
    std::string text;
    for (int row = 0; row < 3; ++row) {
      text += fmt::format("    {} = {};\n", At(at, row, k), At(parent, row, k));
      text += fmt::format("    {} = c * {} {} s * {};\n", At(at, row, u), At(parent, row, u), with,
                          At(parent, row, v));
      text += fmt::format("    {} = c * {} {} s * {};\n", At(at, row, v), At(parent, row, v),
                          against, At(parent, row, u));
      text += TurnedOrigin(at, parent, joint, row, {u, v});
    }
    return text;
  }

  /// The origin turns about the point of the axis: p + R_RP o - R_RL o. `columns` are those that
  /// turn.
  static std::string TurnedOrigin(int at, int parent, const TreeJoint& joint, int row,
                                  std::initializer_list<int> columns) {
    Sum sum;
    sum.Add(1.0, At(parent, row, 3));
    for (const int column : columns) {
      sum.Add(joint.origin[column],
              fmt::format("({} - {})", At(parent, row, column), At(at, row, column)));
    }
    return fmt::format("    {} = {};\n", At(at, row, 3), sum.text());
  }

  /// About any axis: Rodrigues' formula, a matrix whose elements are linear in sine and cosine.
  static std::string PlaceAnyTurn(int at, int parent, const TreeJoint& joint) {
    // R = a a^T + (1 - a a^T) cos q + [a]x sin q, each element a sum of three terms.
    const Vector3d& a = joint.axis;
    const Matrix3d along = a * a.transpose();
    const Matrix3d across = Matrix3d::Identity() - along;
    Matrix3d cross;
    cross << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
    std::string text;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        Sum sum;
        sum.Add(along(i, j), "");
        sum.Add(across(i, j), "c");
        sum.Add(cross(i, j), "s");
        text += fmt::format("    const float m{}{} = {};\n", i, j, sum.text());
      }
    }
    // R_RL = R_RP m, and the origin turns about the point of the axis as above.
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        text += fmt::format("    {} = {} * m0{} + {} * m1{} + {} * m2{};\n", At(at, row, column),
                            At(parent, row, 0), column, At(parent, row, 1), column,
                            At(parent, row, 2), column);
      }
      text += TurnedOrigin(at, parent, joint, row, {0, 1, 2});
    }
    return text;
  }

  const RobotTree& tree_;
  const std::string& stem_;
  std::string prefix_;
  CTables tables_;             ///< Empty for a robot.
  std::vector<int> index_;     ///< Of each link of the tree in the array.
  std::vector<size_t> links_;  ///< The links of the tree in the array's order.
};

}  // namespace

Exported ToC(const RobotTree& tree, const std::string& stem) {
  return Writer(tree, stem, CIdentifier(tree.name), {}).Write();
}

Exported ModuleToC(const model::Model& model, int type, uint64_t model_hash,
                   const std::string& stem) {
  const RobotTree tree = TreeOf(model, ModuleAsRobot(model, type));
  const std::string prefix = CModulePrefix(tree.name);
  const Result<CTables> tables = TablesInC(model, type, model_hash, prefix, stem);
  // A module type that fits no image still has forward kinematics.
  if (tables) return Writer(tree, stem, prefix, *tables).Write();
  Exported exported = ToC(tree, stem);
  exported.warnings.push_back(
      "only the forward kinematics are written, no tables for the virtual "
      "machine: " +
      tables.error().message);
  return exported;
}

}  // namespace morphbus::emit
