// morphbus compile: a DynaRole program to the image that runs on every robot.

#include <fmt/format.h>

#include <string>
#include <vector>

#include "compiler/base/text.h"
#include "compiler/dynarole/compile.h"
#include "compiler/keywords/keyword_table.h"
#include "compiler/keywords/keywords_xml.h"
#include "tools/base/print.h"
#include "tools/base/program.h"
#include "tools/commands/commands.h"
#include "tools/plan/settings.h"
#include "vm/image/image.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus compile`.
struct CompileOptions {
  std::string program;
  std::vector<std::string> keywords;
  std::string model;
  std::string output;
  std::string dump;
  std::string params;
  std::vector<std::string> set;
  bool strip = false;
  bool force = false;
  bool json = false;
};

/// What a program has that the small profile lacks: instructions by their names in listings, and
/// kinds of fields.
std::vector<std::string> NotInTheSmallProfile(const vm::VerifiedProgram& program) {
  const InstructionPlaces large =
      FindInstructions(program, [](vm::Opcode op) { return !vm::IsInEveryProfile(op); });
  std::vector<std::string> all(large.mnemonics.begin(), large.mnemonics.end());
  bool kept = false, traced = false;
  for (int r = 0; r < program.num_roles(); ++r) {
    const vm::RoleInfo role = program.role(r);
    for (int i = 0; i < role.num_fields; ++i) {
      kept = kept || role.fields.kept(i);
      traced = traced || role.fields.traced(i);
    }
  }
  if (kept) all.emplace_back("kept fields");
  if (traced) all.emplace_back("traced fields");
  return all;
}

/// The keywords of the module types, or why they cannot be had; LoadProgram prints the reason.
using Types = Result<std::vector<keywords::ModuleKeywords>>;

/// The module types' keywords, from XML files or from a model. `read` gets the files that they come
/// from. Nothing if the model does not compile, which has been printed.
std::optional<Types> LoadKeywords(const CompileOptions& options, std::vector<std::string>* read) {
  // A model holds the keywords of all its types; the files that it imports are inputs too.
  if (!options.model.empty()) {
    ModelSource source;
    const std::optional<model::Model> model = LoadModel({options.model}, &source);
    *read = source.Files();
    if (!model) return std::nullopt;
    return keywords::KeywordsOf(*model);
  }
  std::vector<keywords::ModuleKeywords> types;
  *read = options.keywords;
  for (const std::string& path : options.keywords) {
    // Keyword files are small: 1 MiB is far above any, and keeps a wrong file out.
    const Result<std::string> text = ReadFile(path, 1 << 20);
    if (!text) return Fail(text.error().message);
    Result<keywords::ModuleKeywords> type = keywords::ParseKeywordsXml(*text);
    if (!type) return Fail(path + ": " + type.error().message);
    types.push_back(*std::move(type));
  }
  return types;
}

/// Prints what a stage of the compiler made, for those who work on it.
int DumpStage(const CompileOptions& options, const Types& types) {
  // The name of the stage is checked before anything is read.
  const std::optional<dynarole::Dump> stage = dynarole::DumpFromName(options.dump);
  if (!stage) return Unusable("--dump: expected tokens, ast or code");
  const Result<keywords::KeywordTable> table = types.and_then(keywords::KeywordTable::Of);
  if (!table) return Unusable(table.error().message);
  const Result<std::string> text = ReadFile(options.program);
  if (!text) return Unusable(text.error().message);
  // The compiler stops after the stage and leaves its text in `dump`.
  const dynarole::CompileResult result =
      dynarole::CompileProgram(options.program, *text, *table, *stage);
  PrintDiagnostics(result.diagnostics, result.sources);
  PrintText(result.dump);
  return result.image ? kDone : kUnusable;
}

/// Writes the image; nothing is written for a program with errors.
int Compile(const CompileOptions& options) {
  // The keywords have one source: files or a model, not both.
  if (options.keywords.empty() == options.model.empty()) {
    return Unusable("expected either --keywords TYPE.xml... or --model FILE.m3l");
  }
  // What the command reads may not be its output.
  std::vector<std::string> inputs;
  const std::optional<Types> types = LoadKeywords(options, &inputs);
  if (!types) return kUnusable;
  if (!options.dump.empty()) return DumpStage(options, *types);
  if (options.output.empty()) return Unusable("expected -o IMAGE");
  if (options.json && IsStdout(options.output)) {
    return Unusable("-o - and --json both write to standard output: give -o a file");
  }
  inputs.push_back(options.program);
  if (!MayWrite(options.output, outputs::kProgramImage, options.force, inputs)) return kUnusable;
  // Compiles, or checks an image that is given as PROGRAM.
  std::optional<CompiledProgram> program = LoadProgram(options.program, *types);
  if (!program) return kUnusable;
  // The image begins with these values of its parameters; a model has no part in it.
  const std::optional<std::vector<Setting>> settings = ReadSettings(options.params, options.set);
  if (!settings || !SetParameters(*settings, &*program)) return kUnusable;
  for (const Setting& setting : *settings) {
    if (!setting.OfModel()) continue;
    return Unusable(
        fmt::format("{} is an attribute of a model, which no image holds; run --set "
                    "takes it",
                    setting.name));
  }
  // The part that modules run is the first one, and the header says how large it is.
  std::string image = program->image;
  if (options.strip) {
    image.resize(
        vm::image::ReadU32(reinterpret_cast<const uint8_t*>(image.data()) + vm::image::kSizeAt));
  }
  const Result<void> written = WriteFile(options.output, image);
  if (!written) return Unusable(written.error().message);
  // What a microcontroller would have to hold, besides what the quadruped needs.
  const Result<std::unique_ptr<vm::VerifiedProgram>> verified = VerifyProgram(program->image);
  if (!verified) return Unusable(verified.error().message);
  const std::vector<std::string> large = NotInTheSmallProfile(**verified);
  // On standard output the image stands alone.
  if (options.json) {
    PrintJson({{"output", options.output},
               {"bytes", image.size()},
               {"hash", Hex(program->hash)},
               {"large_profile", large}});
  } else if (options.output != "-") {
    Print("{}: {} bytes, hash {:016x}\n", options.output, image.size(), program->hash);
    if (!large.empty()) {
      Print("not for the small profile of microcontrollers: {}\n", fmt::join(large, ", "));
    }
  }
  return kDone;
}

}  // namespace

void AddCompile(CommandLine* line) {
  Subcommand sub = line->Add("compile", "Compile a DynaRole program");
  auto options = std::make_shared<CompileOptions>();
  sub.Add("PROG.dyn", &options->program, "DynaRole program").Required();
  sub.Add("--keywords", &options->keywords, "XML of the module types (morphbus export --to xml)")
      .TypeName("TYPE.xml...");
  sub.Add("--model", &options->model, "M3L file whose module types the program may use")
      .TypeName("FILE.m3l");
  sub.Add("-o,--output", &options->output, "Image to write ('-': stdout)").TypeName("FILE");
  AddSettings(&sub, &options->params, &options->set);
  sub.Flag("--strip", &options->strip,
           "Leave out names and source lines, which a microcontroller need not hold");
  sub.Force(&options->force);
  sub.Add("--dump", &options->dump, "Print a stage instead: tokens, ast or code")
      .TypeName("tokens|ast|code");
  sub.Json(&options->json);
  sub.Footer(
      "Examples:\n"
      "  morphbus compile models/programs/quadruped.dyn --model models/mtran.m3l -o "
      "quadruped.image\n"
      "  morphbus compile models/programs/quadruped.dyn --keywords mtran.xml -o quadruped.image");
  sub.Do([options] { return Compile(*options); });
}

}  // namespace morphbus::tools
