// morphbus variants: other assemblies congruent to a robot, as M3L.

#include <fmt/format.h>

#include <filesystem>
#include <system_error>

#include "compiler/base/text.h"
#include "compiler/congruence/variants.h"
#include "tools/base/print.h"
#include "tools/base/variants_text.h"
#include "tools/commands/commands.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus variants`.
struct VariantsOptions {
  std::string file;
  std::string robot;
  size_t max = 10;
  uint64_t seed = 0;
  bool sample = false;
  bool force = false;
  bool json = false;
  std::string output = "-";
};

/// How a file written to `output` names `file` in an import.
std::string ImportPath(const std::string& file, const std::string& output) {
  namespace fs = std::filesystem;
  // An import is relative to the file that it stands in; what goes to stdout is taken for a file
  // here.
  const fs::path folder = output == "-" ? fs::path(".") : fs::path(output).parent_path();
  std::error_code error;
  const fs::path relative = fs::relative(file, folder.empty() ? fs::path(".") : folder, error);
  return error || relative.empty() ? fs::absolute(file, error).generic_string()
                                   : relative.generic_string();
}

/// Finds variants and writes them as M3L, with a comment where masses differ.
int Variants(const VariantsOptions& options) {
  ModelSource source;
  const std::optional<model::Model> loaded = LoadModel({options.file}, &source);
  if (!loaded) return kUnusable;
  const model::Model& model = *loaded;
  const model::Robot* robot = PickRobot(model, options.robot);
  // Finding variants may take long, so what cannot be written is refused now.
  if (robot == nullptr ||
      !MayWrite(options.output, outputs::kVariants, options.force, source.Files()))
    return kUnusable;
  // The output imports the model, so a name that M3L cannot write cannot be used.
  const std::string import = ImportPath(options.file, options.output);
  if (import.find('"') != std::string::npos || import.find('\n') != std::string::npos) {
    return Unusable("M3L cannot import a file of that name");
  }
  // Without --seed the first ones of an enumeration, with it a sample of all.
  congruence::VariantOptions wanted;
  wanted.max = options.max;
  if (options.sample) wanted.seed = options.seed;
  const std::vector<congruence::Variant> variants = congruence::Variants(model, *robot, wanted);
  // Counts those that will not run alike, for the remark at the end.
  size_t unlike = 0;
  Json list = Json::array();
  for (const congruence::Variant& variant : variants) {
    unlike += variant.masses.masses_equal && variant.masses.hulls_equal ? 0 : 1;
    list.push_back({{"robot", variant.robot.name},
                    {"masses_equal", variant.masses.masses_equal},
                    {"hulls_equal", variant.masses.hulls_equal}});
  }
  // With --json and no file the text is part of the object: stdout holds nothing else.
  const std::string text = VariantsText(model, *robot, variants, import);
  Json json = {{"robot", robot->name}, {"variants", list}};
  if (options.json && IsStdout(options.output)) {
    json["m3l"] = text;
  } else if (const Result<void> written = WriteFile(options.output, text); !written) {
    return Unusable(written.error().message);
  }
  if (options.json) PrintJson(json);
  // On stderr: stdout may be the M3L text.
  Say("{} of {}, each congruent to it{}\n", Counted(variants.size(), "variant"), robot->name,
      variants.size() < options.max ? "; no more were found" : "");
  // The user should not expect such variants to fall and slide alike.
  if (unlike > 0) {
    Say("the masses or hulls of {} are not those of {}, so it will not run alike\n",
        unlike == variants.size() ? "all of them" : fmt::format("{} of them", unlike), robot->name);
  }
  return kDone;
}

}  // namespace

void AddVariants(CommandLine* line) {
  Subcommand sub = line->Add(
      "variants", "Other assemblies congruent to a robot: modules turned round, other connectors");
  auto options = std::make_shared<VariantsOptions>();
  sub.Add("FILE.m3l", &options->file, "M3L file").Required();
  sub.Robot(&options->robot);
  sub.Add("--max", &options->max, "At most so many (default 10)").Range(1, 10000);
  const Option seed =
      sub.Seed(&options->seed, "Draw them at random with this seed (default: the first ones)");
  sub.Add("-o,--output", &options->output, "M3L file to write (default '-', stdout)")
      .TypeName("FILE.m3l");
  sub.Force(&options->force);
  sub.Json(&options->json);
  sub.Footer(
      "The file imports FILE, so `morphbus run` takes it as it is.\n"
      "Example:\n  morphbus variants models/mtran.m3l --robot quadruped --max 5 --seed 1 -o v.m3l\n"
      "  morphbus run v.m3l models/programs/quadruped.dyn --robot quadruped_variant_1 --seconds 20 "
      "--inproc");
  sub.Do([options, seed] {
    options->sample = seed.given();
    return Variants(*options);
  });
}

}  // namespace morphbus::tools
