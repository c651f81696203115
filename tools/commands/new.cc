// morphbus new: files to begin with, which check and run as they are.

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>
#include <vector>

#include "compiler/keywords/module_keywords.h"
#include "tools/base/print.h"
#include "tools/commands/commands.h"
#include "tools/templates/templates.h"

namespace morphbus::tools {
namespace {

namespace fs = std::filesystem;

/// The options of all three.
struct NewOptions {
  std::string path;
  std::string model;
  bool force = false;
};

/// A file that is to be written.
struct NewFile {
  std::string path;
  std::string text;
};

/// The text of a template with a word in place of its name, `@NAME@`.
std::string Filled(const char* name, const std::string& place, const std::string& word) {
  std::string text(TemplateText(name));
  for (size_t at = text.find(place); at != std::string::npos; at = text.find(place, at)) {
    text.replace(at, place.size(), word);
    at += word.size();
  }
  return text;
}

/// The name of a module type from that of its file: `knee-joint.m3l` is KNEE_JOINT. Empty if no
/// name can be made of it.
std::string TypeNameOf(const std::string& path) {
  std::string name = fs::path(path).stem();
  for (char& c : name) {
    const auto byte = static_cast<unsigned char>(c);
    c = std::isalnum(byte) != 0 ? static_cast<char>(std::toupper(byte)) : '_';
  }
  const bool begins = !name.empty() && std::isdigit(static_cast<unsigned char>(name[0])) == 0;
  return begins ? name : "";
}

/// Writes the files, none of which may be there yet, and says which.
int WriteFiles(const std::vector<NewFile>& files, bool force) {
  // All are looked at before the first is written.
  for (const NewFile& file : files) {
    std::error_code error;
    if (!force && fs::exists(fs::symlink_status(file.path, error))) {
      return Unusable(fmt::format("{} is there already; --force writes over it", file.path));
    }
  }
  for (const NewFile& file : files) {
    const Result<void> written = WriteFile(file.path, file.text);
    if (!written) return Unusable(written.error().message);
    Print("{}\n", file.path);
  }
  return kDone;
}

bool HasEnding(const std::string& path, const std::string& ending) {
  if (path.ends_with(ending) && path.size() > ending.size()) return true;
  Unusable(fmt::format("{}: expected a name that ends in {}", path, ending));
  return false;
}

int NewModule(const NewOptions& options) {
  if (!HasEnding(options.path, ".m3l")) return kUnusable;
  const std::string name = TypeNameOf(options.path);
  if (name.empty()) {
    return Unusable(fmt::format("{}: the file names the module type, and so begins with a letter",
                                options.path));
  }
  return WriteFiles({{options.path, Filled("module.m3l", "@NAME@", name)}}, options.force);
}

/// The keyword of the first joint that turns, of any module type of a model.
Result<std::string> TurningJoint(const model::Model& model) {
  for (const model::ModuleType& type : model.module_types) {
    const Result<keywords::ModuleKeywords> words = keywords::KeywordsOf(type);
    if (!words) return Fail(words.error().message);
    for (const keywords::JointKeyword& joint : words->joints) {
      const bool turns =
          joint.type == model::JointType::kRevolute || joint.type == model::JointType::kContinuous;
      if (turns) return joint.keyword;
    }
  }
  return Fail("no module type of the model has a joint that turns");
}

int NewProgram(const NewOptions& options) {
  if (!HasEnding(options.path, ".dyn")) return kUnusable;
  // The joint of the module that `new module` makes.
  std::string joint = "HINGE";
  if (!options.model.empty()) {
    const std::optional<model::Model> model = LoadModel({options.model});
    if (!model) return kUnusable;
    Result<std::string> found = TurningJoint(*model);
    if (!found) return Unusable(options.model + ": " + found.error().message);
    joint = std::move(*found);
  }
  return WriteFiles({{options.path, Filled("program.dyn", "@JOINT@", joint)}}, options.force);
}

int NewProject(const NewOptions& options) {
  if (options.path.empty()) return Unusable("FOLDER is empty: name the folder");
  const fs::path folder(options.path);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return Unusable(fmt::format("cannot make {}: {}", options.path, error.message()));
  // "walker/" is the same folder as "walker".
  const fs::path named = folder.has_filename() ? folder : folder.parent_path();
  return WriteFiles({{folder / "module.m3l", Filled("module.m3l", "@NAME@", "HINGE")},
                     {folder / "wave.dyn", Filled("program.dyn", "@JOINT@", "HINGE")},
                     {folder / "amplitude.toml", std::string(TemplateText("amplitude.toml"))},
                     {folder / "README.md", Filled("README.md", "@NAME@", named.filename())}},
                    options.force);
}

}  // namespace

void AddNew(CommandLine* line) {
  Subcommand sub = line->Add("new", "Files to begin with: a module type, a program, a project");
  sub.Footer(
      "Examples:\n  morphbus new project walker\n  morphbus new module knee.m3l\n"
      "  morphbus new program wave.dyn --model knee.m3l");
  auto options = std::make_shared<NewOptions>();
  const auto force = [options](Subcommand* command) {
    command->Flag("--force", &options->force, "Write over files that are there");
  };

  Subcommand module = sub.Command("module", "A module type with a joint, and a robot of five");
  module.Add("FILE.m3l", &options->path, "The file, which names the module type").Required();
  force(&module);
  module.Do([options] { return NewModule(*options); });

  Subcommand program = sub.Command("program", "A program that sends a wave along a robot");
  program.Add("FILE.dyn", &options->path, "The file").Required();
  program.Add("--model", &options->model, "Model whose first joint that turns is moved")
      .TypeName("FILE.m3l");
  force(&program);
  program.Do([options] { return NewProgram(*options); });

  Subcommand project =
      sub.Command("project", "A folder with a module type, a program, a sweep and a README");
  project.Add("FOLDER", &options->path, "The folder").Required();
  force(&project);
  project.Do([options] { return NewProject(*options); });
}

}  // namespace morphbus::tools
