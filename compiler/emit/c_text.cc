#include "compiler/emit/c_text.h"

#include <fmt/format.h>

#include <set>

namespace morphbus::emit {

std::string CFloat(double value) {
  // The shortest text that reads back the same float.
  std::string text = fmt::format("{}", static_cast<float>(value));
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text + "f";
}

std::string CIdentifier(std::string name) {
  // Names of links hold dots, which C does not know.
  for (char& c : name) {
    const bool good = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (!good) c = '_';
  }
  return name;
}

std::string CModulePrefix(const std::string& name) {
  return name == "morphbus" ? name + "_" : CIdentifier(name);
}

std::string CEnumeration(const std::string& prefix, const std::string& kind,
                         const std::vector<std::string>& names) {
  std::string text = "enum {\n";
  std::set<std::string> used;
  for (size_t i = 0; i < names.size(); ++i) {
    // m_1.a and m.1_a would be the same identifier.
    std::string name = CIdentifier(names[i]);
    // Underscores are added until no name before is the same.
    while (!used.insert(name).second) name += '_';
    text += fmt::format("  {}_{}_{} = {},  /* {} */\n", prefix, kind, name, i, names[i]);
  }
  return text + fmt::format("  {}_num_{}s = {}\n}};\n", prefix, kind, names.size());
}

}  // namespace morphbus::emit
