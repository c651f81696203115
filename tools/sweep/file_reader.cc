#include "tools/sweep/file_reader.h"

#include <algorithm>

#include "tools/base/messages.h"
#include "tools/sweep/row_run.h"

namespace morphbus::tools {

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
