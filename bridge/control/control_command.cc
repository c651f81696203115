#include "bridge/control/control_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "bridge/wire/wire_limits.h"
#include "compiler/base/quantity.h"
#include "compiler/base/text.h"
#include "compiler/source/diagnostics.h"

namespace morphbus::bridge {
namespace {

// What the numbers of commands may be. A direction has a length.
constexpr int64_t kMostSteps = 1'000'000;
constexpr double kSlowest = 0.001, kFastest = 1e6;  // At 0.001 a tick of 20 ms takes 20 s.
constexpr double kLeastDirection = 1e-6, kMostDirection = 1e6;
constexpr double kMostNewtons = 1e4, kMostPushSeconds = 1e4;
constexpr double kMostAt = 1e9;

/// The commands, in order of ControlKind.
struct CommandRow {
  const char* name;
  /// What follows the name, for messages and the help.
  const char* usage;
  /// How many words may follow; of options, `--to`, `--cold` (with `--from`) and `--at`, which it
  /// takes.
  size_t least, most;
  bool takes_to, takes_cold, takes_at = false;
};
/// More words than `invoke` could hand over: a program's command has fewer arguments.
constexpr size_t kMostArguments = 64;
constexpr CommandRow kCommands[] = {
    {"pause", "", 0, 0, false, false},
    {"resume", "", 0, 0, false, false},
    {"step", " [N]", 0, 1, false, false},
    {"speed", " X", 1, 1, false, false},
    {"stop", "", 0, 0, false, false},
    {"push", " BODY DIRECTION NEWTON [SECONDS]", 3, 4, false, false},
    {"kill", " MODULE", 1, 1, false, false},
    {"restart", " MODULE [--cold]", 1, 1, false, true},
    {"lose", " MODULE", 1, 1, false, false},
    {"connect", " MODULE.CONNECTOR MODULE.CONNECTOR", 2, 2, false, false},
    {"disconnect", " MODULE.CONNECTOR", 1, 1, false, false},
    {"deploy", " PROG.dyn [--to MODULE] [--at SECONDS]", 1, 2, true, false, true},
    {"invoke", " Role.command [ARGUMENT...] [--to MODULE]", 1, kMostArguments, true, false},
    {"inspect", " [MODULE]", 0, 1, false, false},
    {"set", " PARAMETER VALUE [--at SECONDS]", 2, 3, false, false, true},
};

/// The directions of the world by name: north, up, east are x, y, z.
struct NamedDirection {
  const char* name;
  std::array<double, 3> direction_W;
};
constexpr NamedDirection kDirections[] = {
    {"NORTH", {1, 0, 0}}, {"SOUTH", {-1, 0, 0}}, {"UP", {0, 1, 0}},
    {"DOWN", {0, -1, 0}}, {"EAST", {0, 0, 1}},   {"WEST", {0, 0, -1}},
};

/// The parts between separators; empty ones are left out.
std::vector<std::string> SplitWords(std::string_view text, char separator) {
  std::vector<std::string> words;
  // Several separators in a row, as people type blanks, count as one.
  while (!text.empty()) {
    const size_t end = std::min(text.find(separator), text.size());
    if (end > 0) words.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return words;
}

/// Reads a number from `least` to `most` into `out`.
template <class Number>
Result<void> TakeNumber(const std::string& what, const std::string& word, Number least, Number most,
                        Number* out) {
  const std::optional<Number> number = ReadNumber<Number>(word);
  if (!number || *number < least || *number > most) {
    return Fail(fmt::format("{}: expected a number, {} to {}, not '{}'", what, least, most, word));
  }
  *out = *number;
  return {};
}

/// Reads a time from 0 to `most` seconds into `out`.
Result<void> TakeTime(const std::string& what, const std::string& word, double most, double* out) {
  const std::optional<double> seconds = ReadSeconds(word);
  if (!seconds || *seconds < 0 || *seconds > most) {
    return Fail(fmt::format("{}: expected a time, 0 to {} s, not '{}'", what, most, word));
  }
  *out = *seconds;
  return {};
}

/// Reads "m2" or, where a part is wanted, "m2.c3".
Result<void> TakePart(const std::string& word, bool wanted, ControlPart* out) {
  // A link's or connector's name has no dot, so the first one ends the module's.
  const size_t dot = word.find('.');
  out->module = word.substr(0, dot);
  if (dot != std::string::npos) out->part = word.substr(dot + 1);
  if (out->module.empty() || (dot != std::string::npos && out->part.empty()) ||
      (wanted && out->part.empty())) {
    return Fail(fmt::format("expected {}, not '{}'", wanted ? "MODULE.CONNECTOR" : "MODULE", word));
  }
  return {};
}

/// Reads NORTH and its kin, or "n,u,e".
Result<void> TakeDirection(const std::string& word, std::array<double, 3>* out) {
  // By name in any case, as people mostly write it; the names are also for the error.
  std::string upper = word;
  for (char& c : upper) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  std::vector<std::string> names;
  for (const NamedDirection& named : kDirections) {
    names.emplace_back(named.name);
    if (upper != named.name) continue;
    *out = named.direction_W;
    return {};
  }
  // Else three numbers, which must not all be zero.
  const std::vector<std::string> numbers = SplitWords(word, ',');
  for (size_t i = 0; numbers.size() == 3 && i < 3; ++i) {
    const Result<void> taken =
        TakeNumber("direction", numbers[i], -kMostDirection, kMostDirection, &(*out)[i]);
    if (!taken) return taken;
  }
  if (std::hypot((*out)[0], (*out)[1], (*out)[2]) >= kLeastDirection) return {};
  const std::string nearest = source::NearestName(upper, names);
  return Fail(fmt::format("direction: expected one of {}, or north,up,east as numbers, not '{}'{}",
                          fmt::join(names, ", "), word,
                          nearest.empty() ? "" : " (did you mean '" + nearest + "'?)"));
}

/// "m2" or "m2.c3".
std::string PartText(const ControlPart& part) {
  return part.part.empty() ? part.module : part.module + "." + part.part;
}

/// The name of a direction that has one, else its numbers.
std::string DirectionText(const std::array<double, 3>& direction_W) {
  for (const NamedDirection& named : kDirections) {
    if (named.direction_W == direction_W) return named.name;
  }
  return fmt::format("{},{},{}", direction_W[0], direction_W[1], direction_W[2]);
}

/// Takes the options out of `words`, from the second one on.
Result<void> TakeOptions(const CommandRow& row, std::vector<std::string>* words,
                         ControlCommand* command) {
  for (size_t i = 1; i < words->size();) {
    // Options may stand anywhere behind the name; what remains are the command's own words.
    const std::string& word = (*words)[i];
    const auto at = words->begin() + static_cast<std::ptrdiff_t>(i);
    if (row.takes_cold && word == "--cold") {
      command->cold = true;
      words->erase(at);
    } else if (row.takes_cold && word == "--from") {
      // Only the run itself writes this.
      if (i + 1 == words->size()) return Fail("--from: expected a tick");
      const Result<void> taken = TakeNumber<int64_t>(
          "--from", (*words)[i + 1], 1, std::numeric_limits<int64_t>::max(), &command->from);
      if (!taken) return taken;
      words->erase(at, at + 2);
    } else if (row.takes_to && word == "--to") {
      if (i + 1 == words->size() || !command->to.empty()) return Fail("--to: expected one module");
      command->to = (*words)[i + 1];
      words->erase(at, at + 2);
    } else if (row.takes_at && word == "--at") {
      if (i + 1 == words->size() || command->at)
        return Fail("--at: expected one time, such as 12.5 or 12.5s");
      const Result<void> taken = TakeTime("--at", (*words)[i + 1], kMostAt, &command->at.emplace());
      if (!taken) return taken;
      words->erase(at, at + 2);
    } else if (word.starts_with("--")) {
      return Fail(fmt::format("{}: unknown option {}", row.name, word));
    } else {
      ++i;
    }
  }
  return {};
}

/// Times real time, or 0.
Result<void> TakeSpeed(const std::string& word, ControlCommand* command) {
  const Result<void> taken = TakeNumber("speed", word, 0.0, kFastest, &command->speed);
  if (!taken || command->speed == 0 || command->speed >= kSlowest) return taken;
  return Fail(fmt::format("speed: expected 0 or at least {}, not '{}'", kSlowest, word));
}

/// BODY DIRECTION NEWTON [SECONDS].
Result<void> TakePush(const std::vector<std::string>& words, ControlCommand* command) {
  // The first mistake is the one that is told.
  Result<void> taken = TakePart(words[1], false, &command->part);
  if (taken) taken = TakeDirection(words[2], &command->direction_W);
  if (taken) taken = TakeNumber("NEWTON", words[3], 0.0, kMostNewtons, &command->newtons);
  if (taken && words.size() > 4) {
    taken = TakeTime("SECONDS", words[4], kMostPushSeconds, &command->seconds);
  }
  return taken;
}

/// The hash of an image, which tools add to what people write. `words[at]` may be left out.
Result<void> TakeHash(const std::vector<std::string>& words, size_t at, const std::string& hint,
                      ControlCommand* command) {
  if (words.size() <= at) return {};
  const std::optional<uint64_t> hash = ReadNumber<uint64_t>(words[at], 16);
  if (!hash || *hash == 0) {
    return Fail(fmt::format("{}: '{}' is no hash of an image{}", words[0], words[at], hint));
  }
  command->program_hash = *hash;
  return {};
}

/// PROGRAM [HASH].
Result<void> TakeDeploy(const std::vector<std::string>& words, ControlCommand* command) {
  command->program = words[1];
  return TakeHash(words, 2, " (a path must not hold blanks)", command);
}

/// PARAMETER VALUE [HASH]; only the program knows what it may be.
Result<void> TakeSet(const std::vector<std::string>& words, ControlCommand* command) {
  command->parameter = words[1];
  command->value = words[2];
  return TakeHash(words, 3, "", command);
}

/// Role.command and its arguments, which only the program can type.
Result<void> TakeInvoke(const std::vector<std::string>& words, ControlCommand* command) {
  const size_t dot = words[1].find('.');
  if (dot == 0 || dot == std::string::npos || dot + 1 == words[1].size()) {
    return Fail("invoke: expected Role.command, not '" + words[1] + "'");
  }
  command->role = words[1].substr(0, dot);
  command->routine = words[1].substr(dot + 1);
  command->arguments.assign(words.begin() + 2, words.end());
  return {};
}

/// Reads what follows the name; there are as many words as the command takes.
Result<void> TakeWords(const std::vector<std::string>& words, ControlCommand* command) {
  // Names are only taken apart here: whether the robot has such modules and connectors the run
  // says.
  switch (command->kind) {
    case ControlKind::kPause:
    case ControlKind::kResume:
    case ControlKind::kStop:
      return {};
    case ControlKind::kStep:
      if (words.size() == 1) return {};
      return TakeNumber<int64_t>("step", words[1], 1, kMostSteps, &command->steps);
    case ControlKind::kSpeed:
      return TakeSpeed(words[1], command);
    case ControlKind::kPush:
      return TakePush(words, command);
    case ControlKind::kInspect:
      if (words.size() == 1) return {};
      [[fallthrough]];
    case ControlKind::kKill:
    case ControlKind::kRestart:
    case ControlKind::kLose: {
      const Result<void> taken = TakePart(words[1], false, &command->part);
      if (taken && !command->part.part.empty()) return Fail("expected MODULE, not " + words[1]);
      return taken;
    }
    case ControlKind::kConnect: {
      const Result<void> taken = TakePart(words[1], true, &command->part);
      return taken ? TakePart(words[2], true, &command->mate) : taken;
    }
    case ControlKind::kDisconnect:
      return TakePart(words[1], true, &command->part);
    case ControlKind::kDeploy:
      return TakeDeploy(words, command);
    case ControlKind::kInvoke:
      return TakeInvoke(words, command);
    case ControlKind::kSet:
      return TakeSet(words, command);
  }
  return Fail("no such command");
}

/// Whether it stands in a text as one word that is no option.
bool IsWord(const std::string& text) {
  return !text.empty() && text.find(' ') == std::string::npos && !text.starts_with("--") &&
         EscapeControl(text) == text;
}

Result<void> CheckWord(const char* what, const std::string& text) {
  if (IsWord(text)) return {};
  return Fail(fmt::format("expected {} as one word, not '{}'", what, EscapeControl(text)));
}

/// A module's name, which ends at the first dot.
Result<void> CheckModule(const std::string& name) {
  if (name.find('.') != std::string::npos) return Fail("expected MODULE, not '" + name + "'");
  return CheckWord("MODULE", name);
}

/// A module, and a part of it where there is one, or must be.
Result<void> CheckPart(const ControlPart& part, bool wanted) {
  Result<void> sound = CheckModule(part.module);
  if (sound && (wanted || !part.part.empty())) sound = CheckWord("a part of it", part.part);
  return sound;
}

/// A number from `least` to `most`; not one that is none.
template <class Number>
Result<void> CheckNumber(const char* what, Number number, Number least, Number most) {
  if (number >= least && number <= most) return {};
  return Fail(fmt::format("{}: expected a number, {} to {}, not {}", what, least, most, number));
}

Result<void> CheckPush(const ControlCommand& command) {
  Result<void> sound = CheckPart(command.part, false);
  const std::array<double, 3>& d_W = command.direction_W;
  for (const double x : d_W) {
    if (sound) sound = CheckNumber("direction", x, -kMostDirection, kMostDirection);
  }
  if (sound && !(std::hypot(d_W[0], d_W[1], d_W[2]) >= kLeastDirection)) {
    return Fail("direction: it has no length");
  }
  if (sound) sound = CheckNumber("NEWTON", command.newtons, 0.0, kMostNewtons);
  if (sound) sound = CheckNumber("SECONDS", command.seconds, 0.0, kMostPushSeconds);
  return sound;
}

Result<void> CheckDeploy(const ControlCommand& command) {
  Result<void> sound = CheckWord("a path", command.program);
  // In a script the rest of the line would be a comment.
  if (sound && command.program.find('#') != std::string::npos) {
    return Fail("deploy: a path must not hold '#': " + command.program);
  }
  if (sound && !command.to.empty()) sound = CheckWord("--to's module", command.to);
  if (sound && command.at) sound = CheckNumber("--at", *command.at, 0.0, kMostAt);
  return sound;
}

Result<void> CheckSet(const ControlCommand& command) {
  Result<void> sound = CheckWord("PARAMETER", command.parameter);
  if (sound) sound = CheckWord("VALUE", command.value);
  if (sound && command.at) sound = CheckNumber("--at", *command.at, 0.0, kMostAt);
  return sound;
}

Result<void> CheckInvoke(const ControlCommand& command) {
  Result<void> sound = CheckWord("Role.command", command.role + "." + command.routine);
  if (command.role.empty() || command.routine.empty() ||
      command.role.find('.') != std::string::npos) {
    return Fail("invoke: expected Role.command");
  }
  // The first word is the command.
  if (command.arguments.size() >= kMostArguments) return Fail("invoke: too many arguments");
  for (const std::string& argument : command.arguments) {
    if (sound) sound = CheckWord("an argument", argument);
  }
  if (sound && !command.to.empty()) sound = CheckWord("--to's module", command.to);
  return sound;
}

}  // namespace

Result<void> CheckControl(const ControlCommand& command) {
  switch (command.kind) {
    case ControlKind::kPause:
    case ControlKind::kResume:
    case ControlKind::kStop:
      return {};
    case ControlKind::kStep:
      return CheckNumber("step", command.steps, int64_t{1}, kMostSteps);
    case ControlKind::kSpeed:
      if (command.speed == 0) return {};
      return CheckNumber("speed", command.speed, kSlowest, kFastest);
    case ControlKind::kPush:
      return CheckPush(command);
    case ControlKind::kInspect:
      if (command.part.module.empty()) return {};
      [[fallthrough]];
    case ControlKind::kKill:
    case ControlKind::kRestart:
    case ControlKind::kLose:
      return CheckModule(command.part.module);
    case ControlKind::kConnect:
      if (Result<void> sound = CheckPart(command.mate, true); !sound) return sound;
      [[fallthrough]];
    case ControlKind::kDisconnect:
      return CheckPart(command.part, true);
    case ControlKind::kDeploy:
      return CheckDeploy(command);
    case ControlKind::kInvoke:
      return CheckInvoke(command);
    case ControlKind::kSet:
      return CheckSet(command);
  }
  return Fail("no such command");
}

Result<ControlCommand> ParseControl(std::string_view text) {
  if (text.size() > kLongestText) {
    return Fail(fmt::format("a command has at most {} bytes", kLongestText));
  }
  // Names and paths may be any text but for this: nothing that a terminal or a log would show as
  // something else.
  if (EscapeControl(text) != text) return Fail("a command is one line of printable text");
  std::vector<std::string> words = SplitWords(text, ' ');
  if (words.empty()) return Fail("expected a command");
  // The name leads to the row that says what follows.
  const auto row = std::find_if(std::begin(kCommands), std::end(kCommands),
                                [&](const CommandRow& r) { return words[0] == r.name; });
  if (row == std::end(kCommands)) {
    std::vector<std::string> names;
    for (const CommandRow& r : kCommands) names.emplace_back(r.name);
    const std::string nearest = source::NearestName(words[0], names);
    // A word that is near to a command is probably that command misspelt; else all are listed.
    return Fail(fmt::format("no command '{}'{}", words[0],
                            nearest.empty()
                                ? "; there are " + fmt::format("{}", fmt::join(names, ", "))
                                : " (did you mean '" + nearest + "'?)"));
  }
  ControlCommand command;
  // The row's place is the kind; options go first, for they may stand between other words.
  command.kind = static_cast<ControlKind>(row - std::begin(kCommands));
  if (Result<void> r = TakeOptions(*row, &words, &command); !r) return Fail(r.error().message);
  if (words.size() - 1 < row->least || words.size() - 1 > row->most) {
    return Fail(fmt::format("expected: {}{}", row->name, row->usage));
  }
  // Text and message are held to the same rules, so that CLOCK can name every command as text.
  if (Result<void> r = TakeWords(words, &command); !r) return Fail(r.error().message);
  if (Result<void> r = CheckControl(command); !r) return Fail(r.error().message);
  return command;
}

std::string ControlText(const ControlCommand& command) {
  std::string text = kCommands[static_cast<size_t>(command.kind)].name;
  const auto add = [&text](const std::string& word) { text += " " + word; };
  // Only what the command has is written; numbers in the shortest form that reads back the same.
  if (command.kind == ControlKind::kStep) add(std::to_string(command.steps));
  if (command.kind == ControlKind::kSpeed) add(fmt::format("{}", command.speed));
  // What is acted on comes before how.
  if (!command.part.module.empty()) add(PartText(command.part));
  if (!command.mate.module.empty()) add(PartText(command.mate));
  if (command.kind == ControlKind::kPush) {
    add(DirectionText(command.direction_W));
    add(fmt::format("{}", command.newtons));
    if (command.seconds > 0) add(fmt::format("{}", command.seconds));
  }
  if (command.cold) add("--cold");
  if (command.from > 0) add("--from " + std::to_string(command.from));
  // A program with its hash, a call with its arguments, then who gets it.
  if (!command.program.empty()) add(command.program);
  if (!command.parameter.empty()) add(command.parameter);
  if (!command.value.empty()) add(command.value);
  if (command.program_hash != 0) add(Hex(command.program_hash));
  if (!command.role.empty()) add(command.role + "." + command.routine);
  for (const std::string& argument : command.arguments) add(argument);
  if (!command.to.empty()) add("--to " + command.to);
  if (command.at) add(fmt::format("--at {}", *command.at));
  return text;
}

std::vector<std::string> ControlUsages() {
  std::vector<std::string> usages;
  for (const CommandRow& row : kCommands) usages.push_back(std::string(row.name) + row.usage);
  return usages;
}

}  // namespace morphbus::bridge
