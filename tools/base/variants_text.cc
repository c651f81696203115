#include "tools/base/variants_text.h"

#include <fmt/format.h>

#include <optional>

#include "compiler/base/check.h"
#include "compiler/base/text.h"
#include "compiler/emit/back_ends.h"
#include "compiler/m3l/format.h"

namespace morphbus::tools {
namespace {

/// A comment for each way in which a variant would not run like the robot, empty if there is none:
/// with other masses or hulls it has the same kinematics, but falls and touches the ground
/// otherwise.
std::string MassComment(const model::Robot& robot, const congruence::MassComparison& masses) {
  std::string text;
  const auto add = [&](const std::string& difference) {
    text += fmt::format("// Does not run quite as {}: {}.\n", robot.name, difference);
  };
  if (!masses.masses_equal) add(masses.mass_difference);
  if (!masses.hulls_equal) add(masses.hull_difference);
  return text;
}

/// The text in the layout that `morphbus format` gives.
std::string Formatted(const std::string& text) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  // The text was made here, so that it must parse: if it does not, that is our bug.
  const int file = sources.AddText("variants", text);
  const std::optional<std::string> formatted = m3l::Format(sources, file, &diagnostics);
  MORPHBUS_CHECK(formatted.has_value());
  return *formatted;
}

}  // namespace

std::string VariantsText(const model::Model& model, const model::Robot& robot,
                         const std::vector<congruence::Variant>& variants,
                         const std::string& import) {
  // One robot after the other, each with a remark if it will not run alike.
  std::string text =
      fmt::format("// {} of {}: other connections, the same kinematics.\nimport \"{}\"\n",
                  Counted(static_cast<int64_t>(variants.size()), "variant"), robot.name, import);
  for (const congruence::Variant& variant : variants) {
    text += "\n" + MassComment(robot, variant.masses) + emit::RobotM3l(model, variant.robot);
  }
  return Formatted(text);
}

}  // namespace morphbus::tools
