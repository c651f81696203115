// morphbus export: the compiler's back ends.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <filesystem>

#include "compiler/emit/c99.h"
#include "compiler/emit/dot.h"
#include "compiler/emit/keywords.h"
#include "compiler/emit/kinematics.h"
#include "compiler/emit/mjcf.h"
#include "compiler/emit/robot_tree.h"
#include "compiler/emit/sdf.h"
#include "compiler/emit/urdf.h"
#include "compiler/emit/webots.h"
#include "compiler/emit/xml.h"
#include "compiler/model/model_proto.h"
#include "tools/commands.h"

namespace morphbus::tools {
namespace {

struct Options {
  std::string file;
  std::string robot;
  std::string module;
  std::string to;
  std::string output;
};

/// What a format can be made of.
enum class Of { kFile, kModule, kRobot, kEither };

struct Format {
  const char* name;
  Of of;
};
constexpr Format kFormats[] = {
    {"model", Of::kFile}, {"kinematics", Of::kModule}, {"xml", Of::kModule},
    {"dot", Of::kRobot},  {"c", Of::kEither},          {"urdf", Of::kEither},
    {"sdf", Of::kEither}, {"mjcf", Of::kEither},       {"webots", Of::kEither}};

/// The format by name; if there is none, or not of what was asked for, says so.
const Format* PickFormat(const Options& options) {
  std::vector<std::string> names;
  for (const Format& format : kFormats) {
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
    } else {
      return &format;
    }
    return nullptr;
  }
  const std::string nearest = source::NearestName(options.to, names);
  Unusable(fmt::format("--to {}{}: expected one of {}", options.to,
                       nearest.empty() ? "" : fmt::format(" (did you mean {}?)", nearest),
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
  Unusable(fmt::format("--module '{}': expected one of {}", name, fmt::join(names, ", ")));
  return std::nullopt;
}

Result<std::string> OfModuleType(const model::Model& model, int type, const std::string& to) {
  if (to == "kinematics") {
    return emit::KinematicsImage(model, type, model::ModelHash(model::SerializeModel(model)));
  }
  const Result<emit::ModuleKeywords> keywords =
      emit::KeywordsOf(model.module_types[static_cast<size_t>(type)]);
  if (!keywords) return Fail(keywords.error().message);
  return emit::KeywordsXml(*keywords);
}

/// What files beside the main one are called after.
std::string Stem(const Options& options, const std::string& name) {
  return options.output == "-" ? name : std::filesystem::path(options.output).stem().string();
}

/// Webots looks for the controllers of worlds/x.wbt in controllers/ beside worlds/.
std::string ControllersFolder(const Options& options) {
  const std::filesystem::path folder = std::filesystem::absolute(options.output).parent_path();
  return options.output != "-" && folder.filename() == "worlds" ? "../controllers" : "controllers";
}

emit::Exported OfRobot(const model::Model& model, const model::Robot& robot,
                       const Options& options) {
  const std::string stem = Stem(options, robot.name);
  if (options.to == "urdf") return emit::ToUrdf(model, emit::OpenTreeOf(model, robot), stem);
  const emit::RobotTree tree = emit::TreeOf(model, robot);
  if (options.to == "c") return emit::ToC(tree, stem);
  if (options.to == "sdf") return emit::ToSdf(model, tree, stem);
  return emit::ToMjcf(model, tree, stem);
}

/// Makes the text; empty if the options do not fit the model, which has then been said.
std::optional<emit::Exported> Make(const model::Model& model, const Format& format,
                                   const Options& options) {
  emit::Exported exported;
  if (format.of == Of::kFile) {
    exported.text = model::SerializeModel(model);
    return exported;
  }
  if (format.of == Of::kModule || !options.module.empty()) {
    const std::optional<int> type = PickModuleType(model, options.module);
    if (!type) return std::nullopt;
    if (format.of == Of::kModule) {
      const Result<std::string> text = OfModuleType(model, *type, options.to);
      if (!text) {
        Unusable(text.error().message);
        return std::nullopt;
      }
      exported.text = *text;
      return exported;
    }
    if (options.to == "webots") {
      model::Robot robot = emit::ModuleAsRobot(model, *type);
      robot.modules[0].name = robot.name;
      return emit::ToWebots(model, robot, ControllersFolder(options));
    }
    const model::Robot robot = emit::ModuleAsRobot(model, *type);
    if (options.to != "c") return OfRobot(model, robot, options);
    return emit::ModuleToC(model, *type, model::ModelHash(model::SerializeModel(model)),
                           Stem(options, robot.name));
  }
  const model::Robot* robot = PickRobot(model, options.robot);
  if (robot == nullptr) return std::nullopt;
  if (format.of == Of::kRobot) {
    exported.text = emit::AssemblyGraphDot(model, *robot);
    return exported;
  }
  if (options.to == "webots") return emit::ToWebots(model, *robot, ControllersFolder(options));
  return OfRobot(model, *robot, options);
}

/// Companions first: whoever sees the main file finds them.
int Write(const Options& options, const emit::Exported& exported) {
  for (const std::string& warning : exported.warnings) Warn(warning);
  const std::filesystem::path output(options.output);
  const std::filesystem::path folder = output.parent_path();
  std::error_code error;
  if (!folder.empty() && !std::filesystem::is_directory(folder, error)) {
    return Unusable(
        fmt::format("cannot write {}: there is no folder {}", options.output, folder.string()));
  }
  for (const emit::CompanionFile& file : exported.companions) {
    if (options.output == "-") {
      Warn(fmt::format("{} belongs to this output, but is written only beside a file", file.path));
      continue;
    }
    const std::filesystem::path path = folder / file.path;
    if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), error);
    if (error) {
      return Unusable(fmt::format("cannot make the folder {}: {}", path.parent_path().string(),
                                  error.message()));
    }
    const Result<void> written = WriteFile(path.string(), file.bytes);
    if (!written) return Unusable(written.error().message);
  }
  const Result<void> written = WriteFile(options.output, exported.text);
  return written ? kDone : Unusable(written.error().message);
}

int Export(const Options& options) {
  const Format* format = PickFormat(options);
  if (format == nullptr) return kUnusable;
  const std::optional<model::Model> model = LoadModel({options.file});
  if (!model) return kUnusable;
  const std::optional<emit::Exported> exported = Make(*model, *format, options);
  return exported ? Write(options, *exported) : kUnusable;
}

}  // namespace

void AddExport(CLI::App& app, Action* action) {
  CLI::App* sub =
      app.add_subcommand("export", "Write a model, a module type or a robot for other programs");
  auto options = std::make_shared<Options>();
  sub->add_option("FILE", options->file, "M3L file")->required();
  sub->add_option("--robot", options->robot, "Robot (default: the only one)");
  sub->add_option("--module", options->module,
                  "Module type (for kinematics and xml: default the only one)");
  sub->add_option("--to", options->to, "webots, urdf, sdf, mjcf, c, xml, kinematics, model or dot")
      ->required();
  sub->add_option("-o,--output", options->output,
                  "File to write ('-': stdout); what belongs to it is written beside it")
      ->required();
  sub->footer(
      "Examples:\n  morphbus export models/mtran.m3l --module MTRAN --to xml -o mtran.xml\n"
      "  morphbus export models/mtran.m3l --robot quadruped --to mjcf -o quadruped.xml\n"
      "  morphbus export models/mtran.m3l --robot quadruped --to dot -o - | dot -Tsvg -o "
      "assembly.svg");
  sub->callback([options, action] { *action = [options] { return Export(*options); }; });
}

}  // namespace morphbus::tools
