// morphbus export: the compiler's back ends.

#include <fmt/format.h>

#include <filesystem>
#include <set>

#include "compiler/emit/robot_tree.h"
#include "tools/base/output_path.h"
#include "tools/base/program.h"
#include "tools/base/world_file.h"
#include "tools/commands/commands.h"
#include "tools/commands/export_formats.h"

namespace morphbus::tools {
namespace {

namespace fs = std::filesystem;

/// The options of `morphbus export`.
struct ExportOptions {
  std::string file;
  std::string robot;
  std::string module;
  std::string to;
  std::string output;
  std::string mesh_prefix;
  std::string program;
  std::string world;
  bool force = false;
};

/// The format by name; if there is none, or not of what was asked for, says so.
const ExportFormat* PickFormat(const ExportOptions& options) {
  const std::vector<std::string> names = NamesOf(ExportFormats());
  for (const ExportFormat& format : ExportFormats()) {
    // The format is found; it remains whether the other options fit it.
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
    } else if (!options.world.empty() && !format.has_world) {
      Unusable(
          fmt::format("--to {} has no world around the robot; leave out --world", format.name));
    } else if (!options.program.empty() && !format.takes_program) {
      Unusable(fmt::format("--to {} runs no program; leave out --program", format.name));
    } else {
      return &format;
    }
    return nullptr;
  }
  Unusable(fmt::format("--to {}{}: expected one of {}", options.to, DidYouMean(options.to, names),
                       fmt::join(names, ", ")));
  return nullptr;
}

/// Webots looks for the controllers of worlds/x.wbt in controllers/ beside worlds/.
std::string ControllersFolder(const std::string& output) {
  const fs::path folder = fs::absolute(output).parent_path();
  return !IsStream(output) && folder.filename() == "worlds" ? "../controllers" : "controllers";
}

/// Where the main file lies once links are followed, so that its companions lie beside it; if
/// nothing can be written there, says why, before anything is written.
std::optional<std::string> PlaceOf(const std::string& output) {
  if (output == "-") return output;
  const Result<std::string> followed = FollowLinks(output);
  if (!followed) return Refuse(followed.error().message);
  // What would fail only while writing is found out here: a folder that is missing, or a name that
  // is a folder's.
  const fs::path path(*followed);
  const fs::path folder = path.parent_path();
  std::error_code error;
  if (!folder.empty() && !fs::is_directory(folder, error)) {
    return Refuse(fmt::format("cannot write {}: there is no folder {}", output, folder.string()));
  }
  if (!path.has_filename() || fs::is_directory(path, error)) {
    return Refuse(fmt::format("cannot write {}: that is a folder; name a file in it", output));
  }
  return *followed;
}

/// Makes the text; empty if the options do not fit the model, which has then been said.
std::optional<emit::Exported> Make(const model::Model& model, const ExportFormat& format,
                                   const ExportOptions& options,
                                   std::vector<world::Obstacle> obstacles) {
  // A module type alone is a robot of one module.
  ExportRequest request{
      model, nullptr, -1, "", options.mesh_prefix, ControllersFolder(options.output), "", {}};
  model::Robot module;
  if (format.of == Of::kModule || !options.module.empty()) {
    const model::ModuleType* type = PickByName(model.module_types, options.module, "module");
    if (type == nullptr) return std::nullopt;
    request.type = static_cast<int>(type - model.module_types.data());
    module = emit::ModuleAsRobot(model, request.type);
    request.robot = &module;
  } else if (format.of != Of::kFile) {
    request.robot = PickRobot(model, options.robot);
    if (request.robot == nullptr) return std::nullopt;
  }
  // The program goes into the export, where it runs instead of being loaded.
  if (!options.program.empty()) {
    const std::optional<CompiledProgram> program =
        LoadProgram(options.program, keywords::KeywordsOf(model));
    if (!program) return std::nullopt;
    request.program = program->image;
  }
  request.obstacles = std::move(obstacles);
  // Meshes and headers are named after the main file, or after the robot where there is no such
  // name.
  if (!IsStream(options.output)) {
    request.stem = fs::path(options.output).stem().string();
  } else if (request.robot != nullptr) {
    request.stem = request.robot->name;
  }
  // The back end says itself what it cannot express.
  Result<emit::Exported> exported = format.make(request);
  if (exported) return *std::move(exported);
  return Refuse(exported.error().message);
}

/// Where the companions lie, in their order.
std::vector<std::string> CompanionPaths(const std::string& output, const emit::Exported& exported) {
  const fs::path folder = fs::path(output).parent_path();
  std::vector<std::string> paths;
  for (const emit::CompanionFile& file : exported.companions) {
    paths.push_back((folder / file.path).string());
  }
  return paths;
}

/// True if the companions may be written: unless one would lie where the main file does (a header,
/// if that is called x.h), where a file of the model does, or in place of a file that no export
/// wrote.
bool MayWriteBeside(const std::string& output, const std::vector<std::string>& companions,
                    bool force, const std::vector<std::string>& inputs) {
  const fs::path main(output);
  for (const std::string& path : companions) {
    // Each companion is checked by its own kind, as the main file was by its.
    if (!MayWrite(path, CompanionKind(path), force, inputs)) return false;
    if (fs::path(path).lexically_normal() != main.lexically_normal()) continue;
    Unusable(fmt::format(
        "cannot write {}: a file of this name belongs beside it; name it otherwise", output));
    return false;
  }
  return true;
}

/// The files of one export. Unless it is finished, what is new of them goes again: nothing is left
/// beside a main file that could not be written.
class ExportedFiles {
 public:
  ExportedFiles() = default;
  ExportedFiles(const ExportedFiles&) = delete;
  ExportedFiles& operator=(const ExportedFiles&) = delete;
  ~ExportedFiles() {
    std::error_code ignored;
    // The newest goes first: a folder can be removed only when it is empty.
    for (auto path = made_.rbegin(); path != made_.rend(); ++path) fs::remove(*path, ignored);
  }

  /// Writes a file, and the folders that lead to it.
  Result<void> Write(const fs::path& path, const std::string& bytes) {
    if (Result<void> made = MakeFolder(path.parent_path()); !made) return made;
    NoteIfNew(path);
    return WriteFile(path.string(), bytes);
  }

  /// Keeps all files: the export is complete.
  void Finish() { made_.clear(); }

 private:
  /// Makes a folder and those above it that are missing, and notes each.
  Result<void> MakeFolder(const fs::path& folder) {
    std::error_code error;
    if (folder.empty() || fs::is_directory(folder, error)) return {};
    if (Result<void> made = MakeFolder(folder.parent_path()); !made) return made;
    NoteIfNew(folder);
    if (fs::create_directory(folder, error) || !error) return {};
    return Fail(fmt::format("cannot make the folder {}: {}", folder.string(), error.message()));
  }

  /// Notes a path that is about to come to be. A link is there even if its target is not.
  void NoteIfNew(const fs::path& path) {
    std::error_code error;
    if (!fs::exists(fs::symlink_status(path, error))) made_.push_back(path);
  }

  std::vector<fs::path> made_;  ///< In the order in which they came to be.
};

/// Removes what an earlier export left in the folder of numbered parts and this one does not have.
/// Only files that are parts go, and the folder only if nothing else is in it.
void RemoveOldParts(const std::string& output, const emit::Exported& exported) {
  if (exported.parts_folder.empty()) return;
  const fs::path folder = fs::path(output).parent_path() / exported.parts_folder;
  // What this export wrote stays.
  std::set<std::string> current;
  for (const emit::CompanionFile& file : exported.companions) {
    current.insert(fs::path(file.path).filename().string());
  }
  std::error_code error;
  std::vector<fs::path> old;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    // A part is called 17.xml and begins as such a part does; anything else is left alone.
    const std::string number = entry.path().stem().string();
    const bool is_part = entry.is_regular_file(error) && entry.path().extension() == ".xml" &&
                         number.find_first_not_of("0123456789") == std::string::npos &&
                         CheckOutput(entry.path(), outputs::kMjcfPart, false, {});
    if (is_part && current.count(entry.path().filename().string()) == 0) {
      old.push_back(entry.path());
    }
  }
  // The folder is not changed while it is being listed.
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

/// Companions first, so that they are there once the main file is. What an earlier main file may
/// still refer to is removed last.
int WriteFiles(const std::string& output, const emit::Exported& exported, bool force,
               const std::vector<std::string>& inputs) {
  const std::vector<std::string> companions = CompanionPaths(output, exported);
  if (!MayWriteBeside(output, companions, force, inputs)) return kUnusable;
  WarnOfMany(exported.warnings);
  ExportedFiles files;
  for (size_t i = 0; i < companions.size(); ++i) {
    const Result<void> written = files.Write(companions[i], exported.companions[i].bytes);
    if (!written) return Unusable(written.error().message);
  }
  const Result<void> written = files.Write(output, exported.text);
  if (!written) return Unusable(written.error().message);
  files.Finish();
  RemoveOldParts(output, exported);
  return kDone;
}

/// Picks the format and the robot or module type, makes the text, and writes it with its
/// companions.
int Export(ExportOptions options) {
  // What is wrong with the options is said before the model is compiled.
  const ExportFormat* format = PickFormat(options);
  if (format == nullptr) return kUnusable;
  const std::optional<std::string> place = PlaceOf(options.output);
  if (!place) return kUnusable;
  options.output = *place;
  ModelSource source;
  const std::optional<model::Model> model = LoadModel({options.file}, &source);
  std::vector<std::string> inputs = source.Files();
  if (!options.program.empty()) inputs.push_back(options.program);
  std::optional<LoadedWorld> world = LoadedWorld();
  if (model && !options.world.empty()) world = LoadWorld(options.world);
  if (!world) return kUnusable;
  // A world that was exported has its meshes where another export of it would write its own.
  inputs.insert(inputs.end(), world->files.begin(), world->files.end());
  if (!model || !MayWrite(options.output, format->kind, options.force, inputs)) return kUnusable;
  const std::optional<emit::Exported> exported =
      Make(*model, *format, options, std::move(world->obstacles));
  if (!exported) return kUnusable;
  // Nothing has been written up to here: a refusal leaves everything as it was.
  return IsStream(options.output) ? WriteToStream(options.output, *exported)
                                  : WriteFiles(options.output, *exported, options.force, inputs);
}

/// Of the formats that `fits`, for the help: "urdf, sdf".
std::string FormatNames(bool (*fits)(const ExportFormat&), const char* between = ", ") {
  std::vector<std::string> names;
  for (const ExportFormat& format : ExportFormats()) {
    if (fits(format)) names.emplace_back(format.name);
  }
  return fmt::format("{}", fmt::join(names, between));
}

}  // namespace

void AddExport(CommandLine* line) {
  Subcommand sub =
      line->Add("export", "Write a model, a module type or a robot for other programs");
  auto options = std::make_shared<ExportOptions>();
  sub.Add("FILE.m3l", &options->file, "M3L file").Required();
  sub.Add("--robot", &options->robot, "Robot (default: the only one)").TypeName("ROBOT");
  sub.Add("--module", &options->module,
          fmt::format("Module type (for {}: default the only one)",
                      FormatNames([](const ExportFormat& f) { return f.of == Of::kModule; })))
      .TypeName("TYPE");
  sub.Add("--to", &options->to, "The format")
      .TypeName(FormatNames([](const ExportFormat&) { return true; }, "|"))
      .Required();
  sub.Add("-o,--output", &options->output,
          "File to write ('-': stdout); what belongs to it is written beside it")
      .TypeName("FILE")
      .Required();
  sub.Force(&options->force);
  sub.Add("--mesh-prefix", &options->mesh_prefix,
          fmt::format("For {}: what to put before the paths of meshes, such as package://robot/ "
                      "(default: nothing, they are relative to the file)",
                      FormatNames([](const ExportFormat& f) { return f.refers_to_meshes; })))
      .TypeName("PREFIX");
  sub.Add("--world", &options->world,
          fmt::format("For {}: SDFormat file of obstacles that stand beside the robot",
                      FormatNames([](const ExportFormat& f) { return f.has_world; })))
      .TypeName("FILE.sdf");
  sub.Add("--program", &options->program,
          fmt::format("For {}: DynaRole program or image that the modules run (default: they hold "
                      "their joints)",
                      FormatNames([](const ExportFormat& f) { return f.takes_program; })))
      .TypeName("PROG.dyn");
  sub.Footer(
      "Examples:\n  morphbus export models/mtran.m3l --module MTRAN --to xml -o mtran.xml\n"
      "  morphbus export models/mtran.m3l --robot quadruped --to mjcf -o quadruped.xml\n"
      "  morphbus export models/mtran.m3l --robot quadruped --to webots --program "
      "models/programs/quadruped.dyn -o quadruped.wbt\n"
      "  morphbus export models/mtran.m3l --robot quadruped --to dot -o - | dot -Tsvg -o "
      "assembly.svg");
  sub.Do([options] { return Export(*options); });
}

}  // namespace morphbus::tools
