// morphbus export: the compiler's back ends.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <filesystem>
#include <set>

#include "compiler/emit/robot_tree.h"
#include "tools/commands.h"
#include "tools/export_formats.h"
#include "tools/output_path.h"

namespace morphbus::tools {
namespace {

struct Options {
  std::string file;
  std::string robot;
  std::string module;
  std::string to;
  std::string output;
  std::string mesh_prefix;
};

/// The format by name; if there is none, or not of what was asked for, says so.
const ExportFormat* PickFormat(const Options& options) {
  std::vector<std::string> names;
  for (const ExportFormat& format : ExportFormats()) {
    names.emplace_back(format.name);
    if (options.to != format.name) continue;
    if (!options.robot.empty() && !options.module.empty()) {
      Unusable("--robot and --module: one of the two, not both");
    } else if (!options.robot.empty() && (format.of == Of::kModule || format.of == Of::kFile)) {
      Unusable(fmt::format("--to {} is of {}; leave out --robot", format.name,
                           format.of == Of::kModule ? "a module type" : "the whole file"));
    } else if (!options.module.empty() && (format.of == Of::kRobot || format.of == Of::kFile)) {
      Unusable(fmt::format("--to {} is of {}; leave out --module", format.name,
                           format.of == Of::kRobot ? "a robot" : "the whole file"));
    } else if (!options.mesh_prefix.empty() && !format.refers_to_meshes) {
      Unusable(
          fmt::format("--to {} refers to no mesh files; leave out --mesh-prefix", format.name));
    } else {
      return &format;
    }
    return nullptr;
  }
  Unusable(fmt::format("--to {}{}: expected one of {}", options.to, DidYouMean(options.to, names),
                       fmt::join(names, ", ")));
  return nullptr;
}

/// The module type by name (the only one if `name` is empty); says why there is none.
std::optional<int> PickModuleType(const model::Model& model, const std::string& name) {
  std::vector<std::string> names;
  for (size_t i = 0; i < model.module_types.size(); ++i) {
    names.push_back(model.module_types[i].name);
    if (names.back() == name) return static_cast<int>(i);
  }
  if (name.empty() && names.size() == 1) return 0;
  Unusable(fmt::format("--module '{}'{}: expected one of {}", name, DidYouMean(name, names),
                       fmt::join(names, ", ")));
  return std::nullopt;
}

/// Webots looks for the controllers of worlds/x.wbt in controllers/ beside worlds/.
std::string ControllersFolder(const std::string& output) {
  const std::filesystem::path folder = std::filesystem::absolute(output).parent_path();
  return !IsStream(output) && folder.filename() == "worlds" ? "../controllers" : "controllers";
}

/// Where the main file lies once links are followed, so that its companions lie beside it; if
/// nothing can be written there, says why, before anything is written.
std::optional<std::string> PlaceOf(const std::string& output) {
  if (output == "-") return output;
  const Result<std::string> followed = FollowLinks(output);
  if (!followed) {
    Unusable(followed.error().message);
    return std::nullopt;
  }
  const std::filesystem::path path(*followed);
  const std::filesystem::path folder = path.parent_path();
  std::error_code error;
  if (!folder.empty() && !std::filesystem::is_directory(folder, error)) {
    Unusable(fmt::format("cannot write {}: there is no folder {}", output, folder.string()));
    return std::nullopt;
  }
  if (!path.has_filename() || std::filesystem::is_directory(path, error)) {
    Unusable(fmt::format("cannot write {}: that is a folder; name a file in it", output));
    return std::nullopt;
  }
  return *followed;
}

/// Makes the text; empty if the options do not fit the model, which has then been said.
std::optional<emit::Exported> Make(const model::Model& model, const ExportFormat& format,
                                   const Options& options) {
  ExportRequest request{
      model, nullptr, -1, "", options.mesh_prefix, ControllersFolder(options.output)};
  model::Robot module;
  if (format.of == Of::kModule || !options.module.empty()) {
    const std::optional<int> type = PickModuleType(model, options.module);
    if (!type) return std::nullopt;
    module = emit::ModuleAsRobot(model, *type);
    request.type = *type;
    request.robot = &module;
  } else if (format.of != Of::kFile) {
    request.robot = PickRobot(model, options.robot);
    if (request.robot == nullptr) return std::nullopt;
  }
  if (!IsStream(options.output)) {
    request.stem = std::filesystem::path(options.output).stem().string();
  } else if (request.robot != nullptr) {
    request.stem = request.robot->name;
  }
  Result<emit::Exported> exported = format.make(request);
  if (exported) return *std::move(exported);
  Unusable(exported.error().message);
  return std::nullopt;
}

/// Where the companions lie, in their order.
std::vector<std::string> CompanionPaths(const std::string& output, const emit::Exported& exported) {
  const std::filesystem::path folder = std::filesystem::path(output).parent_path();
  std::vector<std::string> paths;
  for (const emit::CompanionFile& file : exported.companions) {
    paths.push_back((folder / file.path).string());
  }
  return paths;
}

/// True unless a companion would lie where the main file does (a header, if that is called x.h) or
/// where a file of the model does.
bool AreApart(const std::string& output, const std::vector<std::string>& companions,
              const std::vector<std::string>& inputs) {
  const std::filesystem::path main(output);
  for (const std::string& path : companions) {
    if (!SparesInputs(path, inputs)) return false;
    if (std::filesystem::path(path).lexically_normal() != main.lexically_normal()) continue;
    Unusable(fmt::format(
        "cannot write {}: a file of this name belongs beside it; name it otherwise", output));
    return false;
  }
  return true;
}

Result<void> WriteCompanion(const std::string& path, const std::string& bytes) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::error_code error;
  if (!folder.empty()) std::filesystem::create_directories(folder, error);
  if (error) {
    return Fail(fmt::format("cannot make the folder {}: {}", folder.string(), error.message()));
  }
  return WriteFile(path, bytes);
}

/// Removes what an earlier export left in the folder of numbered parts and this one does not have.
/// Only files called as parts are go, and the folder only if nothing else is in it.
void RemoveOldParts(const std::string& output, const emit::Exported& exported) {
  if (exported.parts_folder.empty()) return;
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(output).parent_path() / exported.parts_folder;
  std::set<std::string> current;
  for (const emit::CompanionFile& file : exported.companions) {
    current.insert(fs::path(file.path).filename().string());
  }
  std::error_code error;
  std::vector<fs::path> old;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const std::string number = entry.path().stem().string();
    const bool is_part = entry.is_regular_file(error) && entry.path().extension() == ".xml" &&
                         number.find_first_not_of("0123456789") == std::string::npos;
    if (is_part && current.count(entry.path().filename().string()) == 0) {
      old.push_back(entry.path());
    }
  }
  for (const fs::path& path : old) fs::remove(path, error);
  if (fs::is_empty(folder, error)) fs::remove(folder, error);
}

/// The main file alone: nothing can lie beside a stream.
int WriteToStream(const std::string& output, const emit::Exported& exported) {
  WarnOfMany(exported.warnings);
  for (const emit::CompanionFile& file : exported.companions) {
    Warn(fmt::format("{} belongs to this output, but is written only beside a file", file.path));
  }
  const Result<void> written = WriteFile(output, exported.text);
  return written ? kDone : Unusable(written.error().message);
}

/// Companions first: whoever sees the main file finds them. What an earlier main file may still
/// refer to is removed last.
int WriteFiles(const std::string& output, const emit::Exported& exported,
               const std::vector<std::string>& inputs) {
  const std::vector<std::string> companions = CompanionPaths(output, exported);
  if (!AreApart(output, companions, inputs)) return kUnusable;
  WarnOfMany(exported.warnings);
  for (size_t i = 0; i < companions.size(); ++i) {
    const Result<void> written = WriteCompanion(companions[i], exported.companions[i].bytes);
    if (!written) return Unusable(written.error().message);
  }
  const Result<void> written = WriteFile(output, exported.text);
  if (!written) return Unusable(written.error().message);
  RemoveOldParts(output, exported);
  return kDone;
}

int Export(Options options) {
  const ExportFormat* format = PickFormat(options);
  if (format == nullptr) return kUnusable;
  const std::optional<std::string> place = PlaceOf(options.output);
  if (!place) return kUnusable;
  options.output = *place;
  std::vector<std::string> inputs;
  const std::optional<model::Model> model = LoadModel({options.file}, &inputs);
  if (!model || !SparesInputs(options.output, inputs)) return kUnusable;
  const std::optional<emit::Exported> exported = Make(*model, *format, options);
  if (!exported) return kUnusable;
  return IsStream(options.output) ? WriteToStream(options.output, *exported)
                                  : WriteFiles(options.output, *exported, inputs);
}

/// Of the formats that `fits`, for the help: "urdf, sdf".
std::string FormatNames(bool (*fits)(const ExportFormat&)) {
  std::vector<std::string> names;
  for (const ExportFormat& format : ExportFormats()) {
    if (fits(format)) names.emplace_back(format.name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

void AddExport(CLI::App& app, Action* action) {
  CLI::App* sub =
      app.add_subcommand("export", "Write a model, a module type or a robot for other programs");
  auto options = std::make_shared<Options>();
  sub->add_option("FILE", options->file, "M3L file")->required();
  sub->add_option("--robot", options->robot, "Robot (default: the only one)");
  sub->add_option(
      "--module", options->module,
      fmt::format("Module type (for {}: default the only one)",
                  FormatNames([](const ExportFormat& f) { return f.of == Of::kModule; })));
  sub->add_option("--to", options->to,
                  "One of " + FormatNames([](const ExportFormat&) { return true; }))
      ->required();
  sub->add_option("-o,--output", options->output,
                  "File to write ('-': stdout); what belongs to it is written beside it")
      ->required();
  sub->add_option(
      "--mesh-prefix", options->mesh_prefix,
      fmt::format("For {}: what to put before the paths of meshes, such as package://robot/ "
                  "(default: nothing, they are relative to the file)",
                  FormatNames([](const ExportFormat& f) { return f.refers_to_meshes; })));
  sub->footer(
      "Examples:\n  morphbus export models/mtran.m3l --module MTRAN --to xml -o mtran.xml\n"
      "  morphbus export models/mtran.m3l --robot quadruped --to mjcf -o quadruped.xml\n"
      "  morphbus export models/mtran.m3l --robot quadruped --to dot -o - | dot -Tsvg -o "
      "assembly.svg");
  sub->callback([options, action] { *action = [options] { return Export(*options); }; });
}

}  // namespace morphbus::tools
