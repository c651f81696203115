// morphbus variants: other assemblies congruent to a robot, as M3L.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <filesystem>
#include <system_error>

#include "compiler/congruence/variants.h"
#include "compiler/emit/m3l.h"
#include "compiler/m3l/format.h"
#include "compiler/source/check.h"
#include "tools/commands.h"
#include "tools/seed_option.h"

namespace morphbus::tools {
namespace {

struct Options {
  std::string file;
  std::string robot;
  size_t max = 10;
  uint64_t seed = 0;
  bool sample = false;
  std::string output = "-";
};

/// How a file written to `output` names `file` in an import.
std::string ImportPath(const std::string& file, const std::string& output) {
  namespace fs = std::filesystem;
  const fs::path folder = output == "-" ? fs::path(".") : fs::path(output).parent_path();
  std::error_code error;
  const fs::path relative = fs::relative(file, folder.empty() ? fs::path(".") : folder, error);
  return error || relative.empty() ? fs::absolute(file, error).generic_string()
                                   : relative.generic_string();
}

/// What `run` would show: such a variant moves alike, but does not fall alike.
std::string MassComment(const model::Robot& robot, const congruence::MassComparison& masses) {
  std::string text;
  const auto add = [&](const std::string& difference) {
    text += fmt::format("// Does not run quite as {}: {}.\n", robot.name, difference);
  };
  if (!masses.masses_equal) add(masses.mass_difference);
  if (!masses.hulls_equal) add(masses.hull_difference);
  return text;
}

/// In the layout that `morphbus format` gives.
std::string Formatted(const std::string& text) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText("variants", text);
  const std::optional<std::string> formatted = m3l::Format(sources, file, diagnostics);
  MORPHBUS_CHECK(formatted.has_value());
  return *formatted;
}

int Variants(const Options& options) {
  std::vector<std::string> files;
  const std::optional<model::Model> loaded = LoadModel({options.file}, &files);
  if (!loaded) return kUnusable;
  const model::Model& model = *loaded;
  const model::Robot* robot = PickRobot(model, options.robot);
  if (robot == nullptr || !SparesInputs(options.output, files)) return kUnusable;
  const std::string import = ImportPath(options.file, options.output);
  if (import.find('"') != std::string::npos || import.find('\n') != std::string::npos) {
    return Unusable("M3L cannot import a file of that name");
  }
  congruence::VariantOptions wanted;
  wanted.max = options.max;
  if (options.sample) wanted.seed = options.seed;
  const std::vector<congruence::Variant> variants = congruence::Variants(model, *robot, wanted);
  std::string text =
      fmt::format("// {} of {}: other connections, the same kinematics.\nimport \"{}\"\n",
                  Plural(variants.size(), "variant"), robot->name, import);
  size_t unlike = 0;
  for (const congruence::Variant& variant : variants) {
    const std::string comment = MassComment(*robot, variant.masses);
    unlike += comment.empty() ? 0 : 1;
    text += "\n" + comment + emit::RobotM3l(model, variant.robot);
  }
  const Result<void> written = WriteFile(options.output, Formatted(text));
  if (!written) return Unusable(written.error().message);
  fmt::print(stderr, "{} of {}, each congruent to it{}\n", Plural(variants.size(), "variant"),
             robot->name, variants.size() < options.max ? "; no more were found" : "");
  if (unlike > 0) {
    fmt::print(stderr, "the masses or hulls of {} are not those of {}, so it will not run alike\n",
               unlike == variants.size() ? "all of them" : fmt::format("{} of them", unlike),
               robot->name);
  }
  return kDone;
}

}  // namespace

void AddVariants(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand(
      "variants", "Other assemblies congruent to a robot: modules turned round, other connectors");
  auto options = std::make_shared<Options>();
  sub->add_option("FILE", options->file, "M3L file")->required();
  sub->add_option("--robot", options->robot, "The robot's name (default: the only one)");
  sub->add_option("--max", options->max, "At most so many (default 10)")
      ->check(CLI::Range(1, 10000));
  CLI::Option* seed =
      AddSeed(sub, &options->seed, "Draw them at random with this seed (default: the first ones)");
  sub->add_option("-o,--output", options->output, "M3L file to write (default '-', stdout)");
  sub->footer(
      "The file imports FILE, so `morphbus run` takes it as it is.\n"
      "Example:\n  morphbus variants models/mtran.m3l --robot quadruped --max 5 --seed 1 -o v.m3l\n"
      "  morphbus run v.m3l models/programs/quadruped.dyn --robot quadruped_variant_1 --seconds 20 "
      "--inproc");
  sub->callback([options, seed, action] {
    options->sample = seed->count() > 0;
    *action = [options] { return Variants(*options); };
  });
}

}  // namespace morphbus::tools
