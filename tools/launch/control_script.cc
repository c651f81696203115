#include "tools/launch/control_script.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <sstream>

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

/// What `info --json` lists, as lines "TICK COMMAND"; the text itself if it is no such object.
std::string LinesOf(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("commands") || !json["commands"].is_array()) return text;
  std::string lines;
  for (const Json& entry : json["commands"]) {
    if (!entry.is_object()) return text;
    lines += fmt::format("{} {}\n", entry.value("tick", int64_t{0}), entry.value("command", ""));
  }
  return lines;
}

/// One line, "412 pause". Commands take effect from tick 1 on: tick 0 waits for all to join.
Result<ScriptedCommand> ParseLine(const std::string& line) {
  // The tick is a number of its own, so that "5pause" is none.
  ScriptedCommand scripted;
  const char* end = line.data() + line.size();
  const std::from_chars_result read = std::from_chars(line.data(), end, scripted.tick);
  if (read.ec != std::errc() || read.ptr == end || *read.ptr != ' ' || scripted.tick < 1) {
    return Fail("expected a tick, 1 or more, and a command");
  }
  Result<bridge::ControlCommand> command = bridge::ParseControl({read.ptr, end});
  if (!command) return Fail(command.error().message);
  scripted.command = std::move(*command);
  return scripted;
}

/// The commands of a text, in order of their ticks. The error begins with the line's number.
Result<ControlScript> ParseScript(const std::string& text) {
  ControlScript script;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    line.erase(std::min(line.find('#'), line.size()));
    // Blanks around a line, and the carriage return of some editors, mean nothing.
    const size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string::npos) continue;
    line = line.substr(begin, line.find_last_not_of(" \t\r") + 1 - begin);
    const Result<ScriptedCommand> scripted = ParseLine(line);
    if (!scripted) return Fail(fmt::format("{}: {}", number, scripted.error().message));
    if (!script.commands.empty() && scripted->tick < script.commands.back().tick) {
      return Fail(fmt::format("{}: ticks must not fall", number));
    }
    script.commands.push_back(*scripted);
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

std::string WhyNotFor(const model::Model& model, const std::string& image) {
  const Result<std::unique_ptr<vm::VerifiedProgram>> program = VerifyProgram(image);
  if (!program) return program.error().message;
  const auto table = keywords::KeywordsOf(model).and_then(keywords::KeywordTable::Of);
  if (!table) return table.error().message;
  // A role whose keywords no module has could never be taken: the image is of another model.
  for (int k = 0; k < (*program)->num_keywords(); ++k) {
    const vm::KeywordInfo& wanted = (*program)->keyword(k);
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
    Unusable(program + ": " + why);
    return std::nullopt;
  }
  *hash = compiled->hash;
  return compiled->image;
}

std::optional<ControlScript> LoadScript(const std::string& path, const model::Model& model) {
  const Result<std::string> text = ReadFile(path, kMostScriptBytes);
  if (!text) {
    Unusable("--commands: " + text.error().message);
    return std::nullopt;
  }
  Result<ControlScript> script = ParseScript(LinesOf(*text));
  if (!script) {
    Unusable(path + ":" + script.error().message);
    return std::nullopt;
  }
  // Programs are compiled now, so that a mistake in one shows before anything runs.
  for (ScriptedCommand& scripted : script->commands) {
    const bool deploys = scripted.command.kind == bridge::ControlKind::kDeploy;
    if (deploys && !AddImage(model, &scripted.command, &*script)) return std::nullopt;
  }
  return std::move(*script);
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
  const Result<std::string> text = ReadFile(ScriptPath(folder), kMostScriptBytes);
  if (!text) return ControlScript();
  return ParseScript(*text);
}

std::string ControlKeyPath(const std::string& folder) { return folder + "/control.key"; }

std::string ImagePath(const std::string& folder, uint64_t hash) {
  return folder + "/" + Hex(hash) + ".image";
}

}  // namespace morphbus::tools
