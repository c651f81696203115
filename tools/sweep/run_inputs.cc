#include "tools/sweep/run_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <set>
#include <utility>

#include "compiler/base/quantity.h"
#include "tools/sweep/row_run.h"

namespace morphbus::tools {
namespace {

using InputKind = RunInput::Kind;

/// Settings whose names inputs have, too, stand in points behind this.
constexpr std::string_view kSetting = "set.";

/// Whether a name, that of no input, means something else in a row: an expression could not tell a
/// setting of that name from a figure.
bool IsTaken(std::string_view name) {
  static const std::set<std::string, std::less<>> taken = [] {
    std::set<std::string, std::less<>> names = {kVariant, kVariants, "hash", "status"};
    for (std::string& group : FigureGroups()) names.insert(std::move(group));
    return names;
  }();
  return taken.contains(name);
}

/// A path of the sweep's file, as a command that runs elsewhere finds it.
std::string PathIn(const std::string& folder, const std::string& path) {
  namespace fs = std::filesystem;
  if (path.empty() || fs::path(path).is_absolute()) return path;
  return (fs::path(folder) / path).lexically_normal().string();
}

/// The value as the input's option has it on a command line; a file's path is complete.
Json InFolder(const RunInput& input, const Json& value, const std::string& folder) {
  return input.kind == InputKind::kFile ? Json(PathIn(folder, value.get<std::string>())) : value;
}

}  // namespace

const std::vector<RunInput>& RunInputs() {
  // In this order a command that is told has their options; the model and the program, which have
  // none, come first.
  using Options = RunOptions*;
  static const std::vector<RunInput> inputs = {
      {"model", "models", InputKind::kFile, "",
       [](const Json& v, Options o) { o->model_file = v.get<std::string>(); }},
      {"program", "programs", InputKind::kFile, "",
       [](const Json& v, Options o) { o->program_file = v.get<std::string>(); }},
      {"robot", "robots", InputKind::kText, "--robot",
       [](const Json& v, Options o) { o->robot = v.get<std::string>(); }},
      {"seconds", "seconds", InputKind::kSeconds, "--seconds",
       [](const Json& v, Options o) { o->seconds = v.get<double>(); }},
      {"root", "roots", InputKind::kText, "--root",
       [](const Json& v, Options o) { o->root = v.get<std::string>(); }},
      {"world", "worlds", InputKind::kFile, "--world",
       [](const Json& v, Options o) { o->world = v.get<std::string>(); }},
      {"friction", "frictions", InputKind::kNumber, "--friction",
       [](const Json& v, Options o) { o->friction = v.get<double>(); }},
      {"ground", "ground", InputKind::kTruth, "--ground",
       [](const Json& v, Options o) { o->ground = v.get<bool>(); }},
      {"still", "still", InputKind::kTruth, "--still",
       [](const Json& v, Options o) { o->still = v.get<bool>(); }},
      {"realtime", "realtime", InputKind::kTruth, "--realtime",
       [](const Json& v, Options o) { o->realtime = v.get<bool>(); }},
      {"root_sensor", "root_sensor", InputKind::kTruth, "--root-sensor",
       [](const Json& v, Options o) { o->root_sensor = v.get<bool>(); }},
      {"root_noise", "root_noises", InputKind::kText, "--root-noise",
       [](const Json& v, Options o) { o->root_noise = v.get<std::string>(); }},
      {"loss", "losses", InputKind::kFraction, "--loss",
       [](const Json& v, Options o) { o->loss = v.get<double>(); }},
      {"faults", "faults", InputKind::kFile, "--faults",
       [](const Json& v, Options o) { o->faults = v.get<std::string>(); }},
      {"seed", "seeds", InputKind::kWhole, "--seed",
       [](const Json& v, Options o) { o->seed = v.get<uint64_t>(); }},
      {"noise_seed", "noise_seeds", InputKind::kWhole, "--noise-seed",
       [](const Json& v, Options o) { o->noise_seed = v.get<int>(); }},
      {"random_seed", "random_seeds", InputKind::kWhole, "--random-seed",
       [](const Json& v, Options o) { o->random_seed = v.get<uint64_t>(); }}};
  return inputs;
}

const RunInput* FindInput(std::string_view name) {
  const auto& inputs = RunInputs();
  const auto found = std::ranges::find_if(
      inputs, [name](const RunInput& input) { return input.name == name || input.plural == name; });
  return found == inputs.end() ? nullptr : &*found;
}

Result<Json> CheckedInput(const RunInput& input, const Json& value) {
  // A quantity may be a text with its unit, as on a command line.
  const auto quantity = [&value](const QuantityReader& reader) -> Result<Json> {
    std::optional<double> number;
    if (value.is_string()) number = reader.read(value.get<std::string>());
    if (value.is_number()) number = reader.read(fmt::format("{}", value.get<double>()));
    if (!number) return Fail(fmt::format("expected {}", reader.expected));
    return Json(*number);
  };
  switch (input.kind) {
    case InputKind::kFile:
    case InputKind::kText:
      if (!value.is_string()) return Fail("expected a text");
      return value;
    case InputKind::kNumber:
      if (!value.is_number()) return Fail("expected a number");
      return Json(value.get<double>());
    case InputKind::kSeconds: {
      const Result<Json> seconds = quantity(kSecondsReader);
      // A run of a sweep ends by itself.
      if (seconds && !(seconds->get<double>() > 0)) return Fail("expected seconds, more than 0");
      return seconds;
    }
    case InputKind::kFraction:
      return quantity(kFractionReader);
    case InputKind::kWhole: {
      const bool noise = input.name == "noise_seed";
      const int64_t most = noise ? 1'000'000'000 : INT64_MAX;
      if (!value.is_number_integer() || value.get<int64_t>() < 0 || value.get<int64_t>() > most) {
        return Fail(
            fmt::format("expected a whole number, 0 to {}", noise ? "1000000000" : "2^63 - 1"));
      }
      return value;
    }
    case InputKind::kTruth:
      if (!value.is_boolean()) return Fail("expected true or false");
      return value;
  }
  return Fail("expected another value");
}

std::string SettingName(std::string_view name) {
  if (name.starts_with(kSetting)) return std::string(name.substr(kSetting.size()));
  return FindInput(name) != nullptr || IsTaken(name) ? "" : std::string(name);
}

std::string PointName(const std::string& setting) {
  return SettingName(setting) == setting ? setting : std::string(kSetting) + setting;
}

RunOptions OptionsOf(const RunPoint& point, const std::string& folder) {
  RunOptions options;
  // Rows are many, short and run beside each other: each in one process, and only its figures stay.
  options.inproc = true;
  options.no_log = true;
  for (const auto& [name, value] : point.items()) {
    const std::string setting = SettingName(name);
    if (!setting.empty()) {
      options.set.push_back(fmt::format("{}={}", setting, PlainText(value)));
    } else if (const RunInput* input = FindInput(name)) {
      input->put(InFolder(*input, value, folder), &options);
    }
  }
  return options;
}

std::string RunCommand(const RunPoint& told, const std::string& folder) {
  RunPoint point = told;
  std::string before;
  if (point.contains(kVariant)) {
    // The variants' file is made here, and has the model in it.
    const RunOptions options = OptionsOf(point, folder);
    const std::string file = options.robot + "_variants.m3l";
    before = fmt::format("morphbus variants {} --robot {} --max {} -o {} && ",
                         ShellWord(options.model_file), ShellWord(options.robot),
                         PlainText(point[kVariants]), ShellWord(file));
    point["model"] = "";
    point["robot"] = point[kVariant];
    before += fmt::format("morphbus run {}", ShellWord(file));
  } else {
    before = "morphbus run";
  }
  // What the point has of the inputs stands behind that, and then what it sets in the program.
  std::vector<std::string> words = {before};
  for (const RunInput& input : RunInputs()) {
    const auto found = point.find(input.name);
    if (found == point.end()) continue;
    const Json value = InFolder(input, *found, folder);
    // Options of truths take no value, but for --ground, which also says that there is none.
    const bool flag = input.kind == InputKind::kTruth && input.name != "ground";
    // An empty text, as of a world that is none, is an option that is left out.
    if ((flag && !value.get<bool>()) || value == "") continue;
    if (!input.option.empty()) words.emplace_back(input.option);
    if (!flag) words.push_back(ShellWord(PlainText(value)));
  }
  for (const auto& [name, value] : point.items()) {
    const std::string setting = SettingName(name);
    if (setting.empty()) continue;
    words.emplace_back("--set");
    words.push_back(ShellWord(fmt::format("{}={}", setting, PlainText(value))));
  }
  return fmt::format("{} --inproc --no-log", fmt::join(words, " "));
}

std::string PlainText(const Json& value) {
  return value.is_string() ? value.get<std::string>() : JsonText(value);
}

std::string ShellWord(const std::string& word) {
  const auto plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("_-+=./,:@%").find(c) != std::string_view::npos;
  };
  if (!word.empty() && std::ranges::all_of(word, plain)) return word;
  // Within single quotes a shell reads everything as it stands, but for their end.
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string PointText(const RunPoint& point) {
  std::vector<std::string> parts;
  for (const auto& [name, value] : point.items()) {
    parts.push_back(fmt::format("{} = {}", name, PlainText(value)));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace morphbus::tools
