#include "tools/plan/control_script.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <utility>

#include "compiler/base/quantity.h"
#include "compiler/base/text.h"
#include "compiler/keywords/keyword_table.h"
#include "tools/base/files.h"
#include "tools/base/json.h"
#include "tools/base/messages.h"
#include "tools/base/program.h"

namespace morphbus::tools {
namespace {

/// No script is larger than this, bytes.
constexpr size_t kMostScriptBytes = 16u << 20;

/// Where a run's folder has its script.
std::string ScriptPath(const std::string& folder) { return folder + "/commands"; }

/// Adds a command to the script. Commands take effect from tick 1 on: tick 0 waits for all to join.
/// The error begins with `place`.
Result<void> AddCommand(const std::string& place, int64_t tick, std::string_view text,
                        ControlScript* script) {
  if (tick < 1) return Fail(place + ": expected a tick, 1 or more, and a command");
  Result<bridge::ControlCommand> command = bridge::ParseControl(text);
  if (!command) return Fail(place + ": " + command.error().message);
  // A module that was replaced began a tick before CLOCK could name that.
  const int64_t begins = command->from > 0 ? std::exchange(command->from, 0) : tick;
  if (!script->commands.empty() && tick < script->commands.back().tick && begins == tick) {
    return Fail(place + ": ticks must not fall");
  }
  InsertInOrder({begins, std::move(*command)}, script);
  return {};
}

/// One line, "412 pause".
Result<void> AddLine(const std::string& place, const std::string& line, ControlScript* script) {
  // The tick is a number of its own, so that "5pause" is none.
  const size_t blank = std::min(line.find(' '), line.size());
  const std::string_view command = std::string_view(line).substr(blank);
  const int64_t tick = ReadNumber<int64_t>(line.substr(0, blank)).value_or(0);
  return AddCommand(place, command.empty() ? 0 : tick, command, script);
}

/// What `info --json` lists, objects of tick and command.
Result<ControlScript> ParseList(const Json& list) {
  ControlScript script;
  if (!list.is_array()) return Fail(" commands: expected a list");
  for (size_t i = 0; i < list.size(); ++i) {
    // Anything may stand there: somebody may have written it by hand.
    const std::string place = fmt::format(" commands[{}]", i);
    const Json& entry = list[i];
    if (!entry.is_object() || !entry.contains("tick") || !entry["tick"].is_number_integer() ||
        !entry.contains("command") || !entry["command"].is_string()) {
      return Fail(place + ": expected an object with a tick, an integer, and a command, a text");
    }
    const auto text = entry["command"].get<std::string>();
    const Result<void> added = AddCommand(place, entry["tick"].get<int64_t>(), text, &script);
    if (!added) return Fail(added.error().message);
  }
  return script;
}

/// Compiles the program of a deployment into the script. Says on stderr what is wrong.
bool AddImage(const model::Model& model, bridge::ControlCommand* command, ControlScript* script) {
  uint64_t hash = 0;
  const std::optional<std::string> image = ImageFor(model, command->program, &hash);
  if (!image) return false;
  // The hash says which program ran when the commands were given.
  if (command->program_hash != 0 && command->program_hash != hash) {
    Unusable(fmt::format("{} is another program now ({}) than was deployed ({})", command->program,
                         Hex(hash), Hex(command->program_hash)));
    return false;
  }
  command->program_hash = hash;
  script->images[hash] = *image;
  return true;
}

}  // namespace

void InsertInOrder(ScriptedCommand command, ControlScript* script) {
  // Commands of one tick stay in the order in which they were given.
  const auto at = std::upper_bound(
      script->commands.begin(), script->commands.end(), command.tick,
      [](int64_t tick, const ScriptedCommand& other) { return tick < other.tick; });
  script->commands.insert(at, std::move(command));
}

std::string WhyNotFor(const model::Model& model, const std::string& image) {
  const Result<std::unique_ptr<vm::VerifiedProgram>> program = VerifyProgram(image);
  if (!program) return program.error().message;
  const auto table = keywords::KeywordsOf(model).and_then(keywords::KeywordTable::Of);
  if (!table) return table.error().message;
  // A role whose keywords no module has could never be taken: the image is of another model.
  for (int k = 0; k < (*program)->num_keywords(); ++k) {
    const vm::KeywordInfo wanted = (*program)->keyword(k);
    const bool known = std::any_of(
        table->all().begin(), table->all().end(), [&](const keywords::Keyword& keyword) {
          return keyword.kind == wanted.kind && keyword.name == ToString(wanted.name);
        });
    if (!known) {
      return fmt::format("the program is for another model: no module type of this one has {}",
                         ToString(wanted.name));
    }
  }
  return "";
}

std::optional<std::string> ImageFor(const model::Model& model, const std::string& program,
                                    uint64_t* hash) {
  // The compiler and the loader say themselves what is wrong.
  const std::optional<CompiledProgram> compiled = LoadProgram(program, keywords::KeywordsOf(model));
  if (!compiled) return std::nullopt;
  if (const std::string why = WhyNotFor(model, compiled->image); !why.empty()) {
    return Refuse(program + ": " + why);
  }
  *hash = compiled->hash;
  return compiled->image;
}

Result<ControlScript> ParseScript(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_object() && json.contains("commands")) return ParseList(json["commands"]);
  ControlScript script;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    line.erase(std::min(line.find('#'), line.size()));
    // Blanks around a line, and the carriage return of some editors, mean nothing.
    const size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string::npos) continue;
    line = line.substr(begin, line.find_last_not_of(" \t\r") + 1 - begin);
    const Result<void> added = AddLine(std::to_string(number), line, &script);
    if (!added) return Fail(added.error().message);
  }
  return script;
}

std::optional<ControlScript> LoadScript(const std::string& path, const model::Model& model) {
  const Result<std::string> text = ReadFile(path, kMostScriptBytes);
  if (!text) return Refuse("--commands: " + text.error().message);
  Result<ControlScript> script = ParseScript(*text);
  if (!script) return Refuse(path + ":" + script.error().message);
  // Programs are compiled now, so that a mistake in one shows before anything runs.
  for (ScriptedCommand& scripted : script->commands) {
    const bool deploys = scripted.command.kind == bridge::ControlKind::kDeploy;
    if (deploys && !AddImage(model, &scripted.command, &*script)) return std::nullopt;
  }
  return std::move(*script);
}

void WarnOfUnreached(const ControlScript& script, int64_t num_ticks) {
  if (num_ticks < 0) return;
  std::vector<std::string> warnings;
  for (const ScriptedCommand& scripted : script.commands) {
    if (scripted.tick < num_ticks) continue;
    warnings.push_back(fmt::format(
        "the run ends before tick {}, in which \"{}\" was to take effect: give it more --seconds",
        scripted.tick, bridge::ControlText(scripted.command)));
  }
  WarnOfMany(warnings);
}

Result<void> WriteScript(const ControlScript& script, const std::string& folder) {
  // Images lie beside the commands, under their hashes.
  std::string text;
  for (const ScriptedCommand& scripted : script.commands) {
    text += fmt::format("{} {}\n", scripted.tick, bridge::ControlText(scripted.command));
  }
  for (const auto& [hash, image] : script.images) {
    if (Result<void> written = WriteFile(ImagePath(folder, hash), image); !written) return written;
  }
  return WriteFile(ScriptPath(folder), text);
}

Result<ControlScript> ReadScript(const std::string& folder) {
  // No folder, and no file in it, are as good as an empty one; a file that cannot be read is not.
  std::error_code failure;
  if (folder.empty()) return ControlScript();
  if (!std::filesystem::exists(ScriptPath(folder), failure) && !failure) return ControlScript();
  const Result<std::string> text = ReadFile(ScriptPath(folder), kMostScriptBytes);
  if (!text) return Fail(text.error().message);
  Result<ControlScript> script = ParseScript(*text);
  if (!script) return Fail(ScriptPath(folder) + ":" + script.error().message);
  return script;
}

std::string ImagePath(const std::string& folder, uint64_t hash) {
  return folder + "/" + Hex(hash) + ".image";
}

}  // namespace morphbus::tools
