#include "compiler/model/value_text.h"

#include <fmt/format.h>

namespace morphbus::model {

// Adding zero turns a negative zero into a plain one.
std::string NumberText(double value) { return fmt::format("{:.9g}", value + 0.0); }

std::string ValueText(const AttributeValue& value) {
  if (const bool* b = std::get_if<bool>(&value)) return *b ? "true" : "false";
  if (const double* d = std::get_if<double>(&value)) return NumberText(*d);
  return "\"" + std::get<std::string>(value) + "\"";
}

}  // namespace morphbus::model
