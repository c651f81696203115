// morphbus export: the compiler's back ends.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "compiler/emit/dot.h"
#include "compiler/emit/keywords.h"
#include "compiler/emit/kinematics.h"
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

int Export(const Options& options) {
  const std::optional<model::Model> model = LoadModel({options.file});
  if (!model) return kUnusable;
  Result<std::string> bytes = Fail("");
  if (options.to == "model") {
    bytes = model::SerializeModel(*model);
  } else if (options.to == "dot") {
    const model::Robot* robot = PickRobot(*model, options.robot);
    if (robot == nullptr) return kUnusable;
    bytes = emit::AssemblyGraphDot(*model, *robot);
  } else if (options.to == "kinematics" || options.to == "xml") {
    const std::optional<int> type = PickModuleType(*model, options.module);
    if (!type) return kUnusable;
    bytes = OfModuleType(*model, *type, options.to);
  } else {
    return Unusable(fmt::format("--to {}: expected model, kinematics, xml or dot", options.to));
  }
  if (!bytes) return Unusable(bytes.error().message);
  const Result<void> written = WriteFile(options.output, *bytes);
  return written ? kDone : Unusable(written.error().message);
}

}  // namespace

void AddExport(CLI::App& app, Action* action) {
  CLI::App* sub =
      app.add_subcommand("export", "Write a model, a module type or a robot for other programs");
  auto options = std::make_shared<Options>();
  sub->add_option("FILE", options->file, "M3L file")->required();
  sub->add_option("--robot", options->robot, "Robot (for dot)");
  sub->add_option("--module", options->module,
                  "Module type (for kinematics and xml; default: the only one)");
  sub->add_option("--to", options->to, "model, kinematics, xml or dot")->required();
  sub->add_option("-o,--output", options->output, "File to write ('-': stdout)")->required();
  sub->footer(
      "Examples:\n  morphbus export models/mtran.m3l --module MTRAN --to xml -o mtran.xml\n"
      "  morphbus export models/mtran.m3l --robot quadruped --to dot -o - | dot -Tsvg -o "
      "assembly.svg");
  sub->callback([options, action] { *action = [options] { return Export(*options); }; });
}

}  // namespace morphbus::tools
