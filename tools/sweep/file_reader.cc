#include "tools/sweep/file_reader.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "tools/base/messages.h"
#include "tools/sweep/row_run.h"

namespace morphbus::tools {
namespace {

/// The unit of a figure of a run (docs/cli.md, "Figures"), as far as its name tells it; empty if
/// not, as for an axis.
std::string_view UnitOfFigure(const std::string& name) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kEndings = {
      {{"_m", "m"}, {"_s", "s"}, {"_rad", "rad"}, {"_j", "J"}}};
  const std::string_view group = std::string_view(name).substr(0, name.find('.'));
  if (group == "displacement" || group == "root_displacement" || name == "path_length") return "m";
  if (name == "energy") return "J";
  if (name == "cost_of_transport" || name == "num_faults") return "1";
  // Elsewhere, as in gait.duty, names of links, joints and modules stand last, which may end
  // anyhow.
  if ((group != "gait" && group != "walk") || name.rfind('.') != group.size()) return "";
  const auto ending = std::ranges::find_if(
      kEndings, [&name](const auto& one) { return name.ends_with(one.first); });
  return ending == kEndings.end() ? "" : ending->second;
}

}  // namespace

std::optional<FigureExpression> FileReader::ReadExpression(const source::TomlValue& value,
                                                           const char* example) {
  const std::string* text = value.text();
  if (text == nullptr) {
    return diagnostics_.Error(value.span, fmt::format("expected a text: \"{}\"", example));
  }
  ExpressionError error;
  std::optional<FigureExpression> expression = FigureExpression::Read(*text, &error);
  // Behind the quotation mark; escapes in the text are not counted.
  const auto span_at = [&value](size_t offset, size_t size) -> source::Span {
    const size_t begin = std::min(value.span.begin + 1 + offset, value.span.end);
    return {value.span.file, begin, std::min(begin + size, value.span.end)};
  };
  if (!expression) return diagnostics_.Error(span_at(error.offset, 1), error.message);
  for (const auto& [name, offset] : expression->names()) {
    named_.emplace_back(name, span_at(offset, name.size()));
  }
  if (const auto mixed = expression->FindMixedUnits(UnitOfFigure)) {
    Wrong(span_at(mixed->offset, 1), mixed->message);
  }
  return expression;
}

void FileReader::CheckNames(const SweepFile& sweep, const std::vector<SweepAxis>& axes) {
  std::vector<std::string> known = FigureGroups();
  known.insert(known.end(), {"hash", "status", kVariant, kVariants});
  for (const SweepAxis& axis : axes) known.push_back(axis.name);
  for (const RunPoint& run : sweep.runs) {
    for (const auto& [name, value] : run.items()) known.push_back(name);
  }
  for (const auto& [name, span] : named_) {
    // Older compilers capture no part of a binding.
    const auto is_known = [&name = name](const std::string& one) {
      return name == one || name.starts_with(one + ".");
    };
    if (std::ranges::any_of(known, is_known)) continue;
    Wrong(span, fmt::format("there is no figure '{}'", name),
          source::NearestHint(name.substr(0, name.find('.')), known,
                              "docs/cli.md, Figures, has those of a run"));
  }
}

}  // namespace morphbus::tools
