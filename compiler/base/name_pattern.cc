#include "compiler/base/name_pattern.h"

#include <regex>
#include <utility>

namespace morphbus {

struct NamePattern::Compiled {
  std::regex expression;
};

NamePattern::NamePattern(std::shared_ptr<const Compiled> compiled)
    : compiled_(std::move(compiled)) {}

Result<NamePattern> NamePattern::Parse(const std::string& text) {
  if (text.empty()) return NamePattern(nullptr);
  // The standard library tells by an exception what is wrong.
  try {
    return NamePattern(std::make_shared<const Compiled>(Compiled{std::regex(text)}));
  } catch (const std::regex_error& error) {
    return Fail("'" + text + "' is no regular expression: " + error.what());
  }
}

bool NamePattern::Matches(std::string_view name) const {
  // regex_match wants all of the name, where regex_search would be content with a part of it.
  return compiled_ == nullptr ||
         std::regex_match(name.data(), name.data() + name.size(), compiled_->expression);
}

}  // namespace morphbus
