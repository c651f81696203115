#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "compiler/m3l/check_module.h"
#include "compiler/m3l/check_robot.h"
#include "compiler/m3l/evaluate.h"

namespace morphbus::m3l::internal {
namespace {

/// Axes of a frame meet in one point and at right angles to this much (of the extent; of a unit).
constexpr double kFrameTolerance = 1e-6;

/// One axis of the frame and the link that carries it.
struct FrameAxis {
  int module = -1;
  int link = -1;
  AxisSymbol axis;
};

/// Checks a robot's `frame`: three axes on one link, from one origin, right-handed.
class FrameChecker {
 public:
  explicit FrameChecker(RobotScope& scope) : scope_(scope) {}

  void Check(const Expr& frame) {
    if (frame.kind != ExprKind::kTuple || frame.children.size() != 3) {
      scope_.diagnostics.Error(frame.span, "a frame has three axes").hint =
          "write frame=(m1.link.(axis: origin=(0,0,0), direction=(1,0,0)), ...)";
      return;
    }
    // All three axes are looked up, so that each wrong one is reported.
    FrameAxis axes[3];
    bool ok = true;
    for (int i = 0; i < 3; ++i) ok = CheckAxisRef(frame.children[i], axes[i]) && ok;
    if (!ok) return;
    // A frame whose axes were on two links would change its shape with the joints between them.
    for (int i = 1; i < 3; ++i) {
      if (axes[i].module == axes[0].module && axes[i].link == axes[0].link) continue;
      scope_.diagnostics.Error(frame.children[i].span, "the axes of a frame are on one link")
          .Note(frame.children[0].span, "the first axis is on another link");
      return;
    }
    CheckGeometry(frame, axes);
  }

 private:
  /// One axis: `m1.link.name`, or `m1.link.(axis: ...)`. False if it is of no use, reported or not.
  bool CheckAxisRef(const Expr& expr, FrameAxis& into) {
    // A named axis is the third name of the path; an anonymous one stands behind it.
    const bool anonymous = expr.kind == ExprKind::kAxis;
    const size_t length = anonymous ? 2 : 3;
    if ((!anonymous && expr.kind != ExprKind::kPath) || expr.path.size() != length) {
      scope_.diagnostics.Error(expr.span, "expected an axis on a link of a module").hint =
          "write m1.link.axis_name, or m1.link.(axis: origin=(0,0,0), direction=(1,0,0))";
      return false;
    }
    const std::optional<int> module = FindModule(expr.path[0], scope_);
    if (!module) return false;
    const int type_index = scope_.robot.modules[*module].type;
    const CheckedModule& checked = scope_.context.modules[type_index];
    into.module = *module;
    into.link = checked.type.FindLink(expr.path[1].text).value_or(-1);
    if (into.link < 0) {
      ReportNoMember(checked, "link", expr.path[1], NamesOf(checked.type.links), "known are",
                     scope_.diagnostics);
    }
    // An anonymous axis is checked as an axis of the module would be, in the module's unit.
    if (anonymous) {
      Declaration decl;
      decl.name.span = expr.span;
      decl.attributes = *expr.axis;
      into.axis = CheckAxis(decl, "the axis", checked.type.unit_m, &scope_.diagnostics);
    } else {
      const auto it = checked.axes.find(expr.path[2].text);
      if (it != checked.axes.end()) {
        into.axis = it->second;
      } else {
        ReportNoMember(checked, "axis", expr.path[2], NamesOf(checked.axes), "known are",
                       scope_.diagnostics);
      }
    }
    return into.link >= 0 && into.axis.valid;
  }

  /// Origins, angles and handedness of the three axes; a sound frame is taken over.
  void CheckGeometry(const Expr& frame, const FrameAxis (&axes)[3]) {
    const CheckedModule& module = scope_.context.modules[scope_.robot.modules[axes[0].module].type];
    // The frame's axes may be the only geometry there is; then distances are compared with a metre.
    const double extent = module.extent_m > 0.0 ? module.extent_m : 1.0;
    // The first axis has the origin that counts; the others may be off by rounding.
    const Eigen::Vector3d& origin = axes[0].axis.p_MoAo_M;
    for (int i = 1; i < 3; ++i) {
      const double distance = (axes[i].axis.p_MoAo_M - origin).norm();
      if (distance <= kFrameTolerance * extent) continue;
      scope_.diagnostics
          .Error(frame.children[i].span,
                 fmt::format("the axes of a frame have one origin; this one is {} m "
                             "from the first",
                             NumberText(distance)))
          .Note(frame.children[0].span, "the first axis");
      return;
    }
    // Each pair must be at right angles; the later of the two is pointed at.
    const Eigen::Vector3d& x = axes[0].axis.direction;
    const Eigen::Vector3d& y = axes[1].axis.direction;
    const Eigen::Vector3d& z = axes[2].axis.direction;
    const Eigen::Vector3d* directions[3] = {&x, &y, &z};
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      const double cosine = directions[i]->dot(*directions[j]);
      if (std::abs(cosine) <= kFrameTolerance) continue;
      const double angle =
          std::acos(std::min(1.0, std::max(-1.0, cosine))) * 180.0 / std::numbers::pi;
      scope_.diagnostics
          .Error(frame.children[std::max(i, j)].span,
                 fmt::format("the axes of a frame are at right angles; these two are "
                             "at {} degrees",
                             NumberText(std::round(angle * 1e6) / 1e6)))
          .Note(frame.children[std::min(i, j)].span, "the other axis");
      return;
    }
    // With right angles the triple product is 1 or -1.
    if (x.cross(y).dot(z) < 0.0) {
      scope_.diagnostics.Error(frame.span, "the frame is left-handed").hint =
          "exchange two of its axes, or turn one round; they are +X north, +Y up, +Z east";
      return;
    }
    SetFrame(axes);
  }

  /// The robot frame from three sound axes: +X north, +Y up, +Z east.
  void SetFrame(const FrameAxis (&axes)[3]) {
    // Within the tolerance the axes may be a little off; the pose is exactly a rotation.
    const Eigen::Vector3d x = axes[0].axis.direction;
    // x is kept, z is made square to it, and y to both (Gram and Schmidt's way).
    const Eigen::Vector3d z = x.cross(axes[1].axis.direction).normalized();
    scope_.robot.root_module = axes[0].module;
    scope_.robot.root_link = axes[0].link;
    model::Pose& X_LR = scope_.robot.X_LR;
    X_LR = model::Pose::Identity();
    X_LR.linear().col(0) = x;
    X_LR.linear().col(1) = z.cross(x);
    X_LR.linear().col(2) = z;
    X_LR.translation() = axes[0].axis.p_MoAo_M;
  }

  RobotScope& scope_;
};

}  // namespace

void CheckFrame(const Expr* frame, RobotScope& scope) {
  // Without a frame: the first module's first link, and its module frame.
  if (frame) FrameChecker(scope).Check(*frame);
}

}  // namespace morphbus::m3l::internal
