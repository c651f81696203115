// morphbus compile: a DynaRole program to the image that runs on every robot.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "compiler/dynarole/compile.h"
#include "compiler/emit/xml.h"
#include "tools/commands.h"
#include "tools/program.h"

namespace morphbus::tools {
namespace {

struct Options {
  std::string program;
  std::vector<std::string> keywords;
  std::string model;
  std::string output;
  std::string dump;
};

/// The module types' keywords, from XML files or from a model; prints what is wrong.
/// `read` gets the files that they come from.
std::optional<dynarole::KeywordTable> LoadKeywords(const Options& options,
                                                   std::vector<std::string>* read) {
  Result<dynarole::KeywordTable> table = Fail("");
  if (!options.model.empty()) {
    const std::optional<model::Model> model = LoadModel({options.model}, read);
    if (!model) return std::nullopt;
    table = KeywordTableOf(*model);
  } else {
    std::vector<emit::ModuleKeywords> types;
    *read = options.keywords;
    for (const std::string& path : options.keywords) {
      const Result<std::string> text = ReadFile(path, 1 << 20);
      Result<emit::ModuleKeywords> type =
          text ? emit::ParseKeywordsXml(*text) : Fail(text.error().message);
      if (!type) {
        Unusable(text ? path + ": " + type.error().message : type.error().message);
        return std::nullopt;
      }
      types.push_back(std::move(*type));
    }
    table = KeywordTableOf(types);
  }
  if (table) return std::move(*table);
  Unusable(table.error().message);
  return std::nullopt;
}

int DumpStage(const Options& options, const dynarole::KeywordTable& keywords) {
  const std::optional<dynarole::Dump> stage = dynarole::DumpFromName(options.dump);
  if (!stage) return Unusable("--dump: expected tokens, ast or code");
  const Result<std::string> text = ReadFile(options.program);
  if (!text) return Unusable(text.error().message);
  const dynarole::CompileResult result =
      dynarole::CompileProgram(options.program, *text, keywords, *stage);
  PrintDiagnostics(result.diagnostics, result.sources);
  fmt::print("{}", result.dump);
  return result.image ? kDone : kUnusable;
}

int Compile(const Options& options) {
  if (options.keywords.empty() == options.model.empty()) {
    return Unusable("expected either --keywords TYPE.xml... or --model FILE.m3l");
  }
  std::vector<std::string> inputs;
  const std::optional<dynarole::KeywordTable> keywords = LoadKeywords(options, &inputs);
  if (!keywords) return kUnusable;
  if (!options.dump.empty()) return DumpStage(options, *keywords);
  if (options.output.empty()) return Unusable("expected -o IMAGE");
  inputs.push_back(options.program);
  if (!SparesInputs(options.output, inputs)) return kUnusable;
  const std::optional<CompiledProgram> program = CompileProgram(options.program, *keywords);
  if (!program) return kUnusable;
  const Result<void> written = WriteFile(options.output, program->image);
  if (!written) return Unusable(written.error().message);
  if (options.output != "-") {
    fmt::print("{}: {} bytes, hash {:016x}\n", options.output, program->image.size(),
               program->hash);
  }
  return kDone;
}

}  // namespace

void AddCompile(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand("compile", "Compile a DynaRole program");
  auto options = std::make_shared<Options>();
  sub->add_option("PROGRAM", options->program, "DynaRole program")->required();
  sub->add_option("--keywords", options->keywords,
                  "XML of the module types (morphbus export --to xml)")
      ->type_name("TYPE.xml...");
  sub->add_option("--model", options->model, "M3L file whose module types the program may use");
  sub->add_option("-o,--output", options->output, "Image to write ('-': stdout)");
  sub->add_option("--dump", options->dump, "Print a stage instead: tokens, ast or code");
  sub->footer(
      "Examples:\n"
      "  morphbus compile models/programs/quadruped.dyn --model models/mtran.m3l -o "
      "quadruped.image\n"
      "  morphbus compile models/programs/quadruped.dyn --keywords mtran.xml -o quadruped.image");
  sub->callback([options, action] { *action = [options] { return Compile(*options); }; });
}

}  // namespace morphbus::tools
