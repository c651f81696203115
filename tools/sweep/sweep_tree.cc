#include "tools/sweep/sweep_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "tools/sweep/axis_reader.h"
#include "tools/sweep/run_inputs.h"

namespace morphbus::tools {
namespace {

using source::TomlEntry;
using source::TomlValue;

/// The entry of a table under a key; null if there is none.
TomlEntry* Find(TomlValue::Table* table, std::string_view key) {
  const auto found = std::ranges::find(*table, key, &TomlEntry::key);
  return found == table->end() ? nullptr : &*found;
}

/// The table under a key; null if there is none, or something else.
TomlValue::Table* TableAt(TomlValue::Table* table, std::string_view key) {
  TomlEntry* entry = Find(table, key);
  return entry == nullptr ? nullptr : std::get_if<TomlValue::Table>(&entry->value.content);
}

/// Calls `visit` for the table of each [[run]]. What is none is left to the reader to refuse.
template <typename Visit>
void ForEachRun(TomlValue::Table* file, Visit visit) {
  TomlEntry* runs = Find(file, "run");
  auto* list = runs == nullptr ? nullptr : std::get_if<TomlValue::Array>(&runs->value.content);
  if (list == nullptr) return;
  for (TomlValue& run : *list) {
    if (auto* table = std::get_if<TomlValue::Table>(&run.content)) visit(table);
  }
}

/// Appends a setting to `flat`, or those in it if it is a table of names that go on.
void AppendFlat(TomlEntry entry, TomlValue::Table* flat) {
  auto* table = std::get_if<TomlValue::Table>(&entry.value.content);
  // A table with a key of a range says which values the setting takes.
  if (table == nullptr || std::ranges::any_of(*table, [](const TomlEntry& inner) {
        return std::ranges::find(kRangeKeys, inner.key) != kRangeKeys.end();
      })) {
    flat->push_back(std::move(entry));
    return;
  }
  for (TomlEntry& inner : *table) {
    inner.key = entry.key + "." + inner.key;
    AppendFlat(std::move(inner), flat);
  }
}

/// Flattens the settings under a key of one table, of the file or of a run.
void FlattenSet(TomlValue::Table* of, std::string_view key) {
  TomlValue::Table* set = TableAt(of, key);
  if (set == nullptr) return;
  TomlValue::Table flat;
  for (TomlEntry& setting : *set) AppendFlat(std::move(setting), &flat);
  *set = std::move(flat);
}

/// Puts an entry where `same` finds one of its name, or behind the others.
template <typename Same>
void Replace(TomlValue::Table* table, TomlEntry entry, Same same) {
  const auto old = std::ranges::find_if(*table, same);
  if (old == table->end()) {
    table->push_back(std::move(entry));
  } else {
    *old = std::move(entry);
  }
}

/// Lays an input, or another key of the top, over the file.
void LayAtTop(TomlEntry entry, TomlValue::Table* file) {
  // A plural names the same input.
  const RunInput* input = FindInput(entry.key);
  const auto same = [key = entry.key, input](const TomlEntry& one) {
    return one.key == key || (input != nullptr && FindInput(one.key) == input);
  };
  Replace(file, std::move(entry), same);
  ForEachRun(file, [&](TomlValue::Table* run) { std::erase_if(*run, same); });
}

/// Lays a setting over the file; a [set] is made if there is none.
void LayInSet(TomlEntry entry, TomlValue::Table* file) {
  const auto same = [key = entry.key](const TomlEntry& one) { return one.key == key; };
  ForEachRun(file, [&](TomlValue::Table* run) {
    if (TomlValue::Table* set = TableAt(run, "set")) std::erase_if(*set, same);
  });
  if (Find(file, "set") == nullptr) {
    file->push_back({"set", entry.key_span, {TomlValue::Table(), entry.value.span}});
  }
  // A `set` that is no table is the reader's to refuse.
  if (TomlValue::Table* set = TableAt(file, "set")) Replace(set, std::move(entry), same);
}

}  // namespace

void FlattenSettings(TomlValue::Table* file) {
  // In [search] stand those that a search looks for.
  FlattenSet(file, "set");
  FlattenSet(file, "search");
  ForEachRun(file, [](TomlValue::Table* run) { FlattenSet(run, "set"); });
}

bool LayOver(source::SourceSet* sources, const std::string& text, TomlValue::Table* file,
             source::Diagnostics* diagnostics) {
  const int word = sources->AddText("the command line", text);
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    diagnostics->Error({word, 0, text.size()}, "expected NAME=VALUES")
        .Hint("NAME=10,20,30 or NAME=10..60:5");
    return false;
  }
  const std::string name = text.substr(0, equals);
  TomlEntry entry = {name,
                     {word, 0, equals},
                     ValueOfWord(std::string_view(text).substr(equals + 1), word, equals + 1)};
  if (FindInput(name) != nullptr || std::ranges::find(kSweepKeys, name) != kSweepKeys.end()) {
    LayAtTop(std::move(entry), file);
    return true;
  }
  if (name == kVariant) {
    diagnostics->Error({word, 0, equals}, "the variants of a robot run all")
        .Hint("variants=N says how many; a parameter of that name is called set.variant");
    return false;
  }
  if (const std::string setting = SettingName(name); !setting.empty()) entry.key = setting;
  LayInSet(std::move(entry), file);
  return true;
}

}  // namespace morphbus::tools
