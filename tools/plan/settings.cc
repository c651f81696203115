#include "tools/plan/settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "compiler/dynarole/parameters.h"
#include "compiler/model/attributes.h"
#include "compiler/source/diagnostics.h"
#include "compiler/source/source_text.h"
#include "compiler/source/toml.h"
#include "tools/base/files.h"
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
      .TypeName("FILE.toml");
}

namespace {

/// No file of settings is larger than this, bytes.
constexpr size_t kMostSettingsBytes = size_t{1} << 20;

/// Reads the settings of a file: names and numbers, and tables of them, whose names stand before
/// those of their keys.
class SettingsFile {
 public:
  SettingsFile(const std::string& path, const std::string& text)
      : path_(path), file_(sources_.AddText(path, text)) {}

  /// Adds them all. False, after printing why, if one of them cannot be understood.
  bool Read(std::vector<Setting>* settings) {
    const auto table = source::ParseToml(sources_, file_, &diagnostics_);
    if (table) Take("", *table, settings);
    PrintDiagnostics(diagnostics_, sources_);
    return diagnostics_.error_count() == 0;
  }

 private:
  /// Takes in a table; `before` is its name and a dot: "[Leg] swing = 45" is Leg.swing.
  void Take(const std::string& before, const source::TomlValue::Table& table,
            std::vector<Setting>* settings) {
    for (const source::TomlEntry& entry : table) {
      const std::string name = before + entry.key;
      if (const source::TomlValue::Table* inner = entry.value.table()) {
        Take(name + ".", *inner, settings);
      } else if (entry.value.is_number() || entry.value.text() != nullptr) {
        // As it is written, so that no digit is lost; a text has its quotation marks.
        const std::string value = entry.value.text() != nullptr
                                      ? *entry.value.text()
                                      : std::string(sources_.text(entry.value.span));
        settings->push_back(
            {name, value,
             fmt::format("{}:{}: {}={}", path_, sources_.LineOf(file_, entry.key_span.begin), name,
                         value)});
      } else {
        diagnostics_.Error(entry.value.span, "expected a number, or a text such as \"45deg\"");
      }
    }
  }

  std::string path_;
  source::SourceSet sources_;
  source::Diagnostics diagnostics_;
  int file_;
};

}  // namespace

std::optional<std::vector<Setting>> ReadSettings(const std::string& params,
                                                 const std::vector<std::string>& set,
                                                 const std::string& from) {
  std::vector<Setting> settings;
  // The file comes first, since the later one of two for one name counts.
  if (!params.empty()) {
    const Result<std::string> text = ReadFile(params, kMostSettingsBytes);
    if (!text) return Refuse(from + "params: " + text.error().message);
    if (!SettingsFile(params, *text).Read(&settings)) return std::nullopt;
  }
  for (const std::string& text : set) {
    // A name and a value must both be there.
    const size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
      return Refuse(fmt::format("{}set {}: expected NAME=VALUE, e.g. swing=45", from, text));
    }
    settings.push_back({text.substr(0, equals), text.substr(equals + 1), from + "set " + text});
  }
  return settings;
}

bool SetParameters(const std::vector<Setting>& settings, CompiledProgram* program) {
  // Each setting makes another image, with a hash of its own; the program is replaced once all are
  // good.
  CompiledProgram changed = *program;
  for (const Setting& setting : settings) {
    if (setting.OfModel()) continue;
    Result<std::string> image = VerifyProgram(changed.image).and_then([&](const auto& verified) {
      return dynarole::WithParameter(*verified, setting.name, setting.value);
    });
    if (!image) {
      Unusable(fmt::format("{}: {}", setting.origin, image.error().message));
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
      Unusable(fmt::format("{}: {}", setting.origin, set.error().message));
      return false;
    }
    // The log tells what was set, in the words of the command line.
    description->add_attributes(setting.name + "=" + setting.value);
  }
  return true;
}

}  // namespace morphbus::tools
