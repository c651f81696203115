#include "tools/plan/settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "compiler/dynarole/parameters.h"
#include "compiler/model/attributes.h"
#include "tools/base/messages.h"

namespace morphbus::tools {

bool Setting::OfModel() const { return std::ranges::count(name, '.') == 2; }

void AddSettings(Subcommand* sub, std::string* params, std::vector<std::string>* set) {
  sub->Add("--set", set,
           "Value of a parameter of the program, or of an attribute of a module type "
           "(TYPE.PART.ATTRIBUTE); may be repeated")
      .TypeName("NAME=VALUE")
      .Repeatable();
  sub->Add("--params", params, "File of such values, which those of --set replace")
      .TypeName("FILE");
}

std::optional<std::vector<Setting>> ReadSettings(const std::string& params,
                                                 const std::vector<std::string>& set) {
  std::vector<Setting> settings;
  for (const std::string& text : set) {
    const size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
      return Refuse(fmt::format("--set {}: expected NAME=VALUE, e.g. swing=45", text));
    }
    settings.push_back({text.substr(0, equals), text.substr(equals + 1)});
  }
  return settings;
}

bool SetParameters(const std::vector<Setting>& settings, CompiledProgram* program) {
  CompiledProgram changed = *program;
  for (const Setting& setting : settings) {
    if (setting.OfModel()) continue;
    Result<std::string> image = VerifyProgram(changed.image).and_then([&](const auto& verified) {
      return dynarole::WithParameter(*verified, setting.name, setting.value);
    });
    if (!image) {
      Unusable(fmt::format("--set {}={}: {}", setting.name, setting.value, image.error().message));
      return false;
    }
    changed.image = std::move(*image);
    changed.hash = HashOfImage(changed.image);
  }
  *program = std::move(changed);
  return true;
}

bool SetAttributes(const std::vector<Setting>& settings, model::Model* model,
                   proto::RunDescription* description) {
  for (const Setting& setting : settings) {
    if (!setting.OfModel()) continue;
    if (Result<void> set = model::SetAttribute(model, setting.name, setting.value); !set) {
      Unusable("--set: " + set.error().message);
      return false;
    }
    description->add_attributes(setting.name + "=" + setting.value);
  }
  return true;
}

}  // namespace morphbus::tools
