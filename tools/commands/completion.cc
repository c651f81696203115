// morphbus completion, complete, man: the command line, told to shells and to man.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "compiler/base/version.h"
#include "tools/base/json.h"
#include "tools/base/print.h"
#include "tools/commands/commands.h"
#include "tools/shell/completion.h"
#include "tools/shell/completion_values.h"
#include "tools/shell/manual_page.h"
#include "tools/shell/shell_scripts.h"

namespace morphbus::tools {
namespace {

/// `completion SHELL`: prints a shell's script.
int PrintScript(const std::string& shell) {
  const std::string script = CompletionScript(shell);
  if (script.empty()) {
    return Unusable(fmt::format("there is no completion for '{}'{}; there is for {}", shell,
                                DidYouMean(shell, Shells()), NameSome(Shells())));
  }
  PrintText(script);
  return kDone;
}

/// What a shell's script asks: a line for each word that may stand there, with a tab and what it is
/// behind it; `:files .m3l .dyn` and `:folders` where paths may. The words follow a "--", so that
/// those that begin with a dash are none of our options.
int PrintCandidates(const CommandHelp& help, std::vector<std::string> words) {
  if (!words.empty() && words.front() == "--") words.erase(words.begin());
  if (words.empty()) words.emplace_back();
  const Completion completion = Complete(help, words, ValuesOfType);
  for (const Candidate& one : completion.candidates) Print("{}\t{}\n", one.word, one.what);
  if (completion.files) {
    Print(":files{}{}\n", completion.endings.empty() ? "" : " ",
          fmt::join(completion.endings, " "));
  }
  if (completion.folders) Print(":folders\n");
  return kDone;
}

/// The options of `morphbus man`.
struct ManualOptions {
  std::string command;
  std::string folder;
  bool force = false;
  bool json = false;
};

/// What the help says of a command, for programs that show it in their own way.
Json HelpAsJson(const CommandHelp& command) {
  constexpr int kAnyNumber = 1 << 29;  // What CLI11 has for no limit (OptionHelp::most_values).
  Json options = Json::array();
  for (const OptionHelp& option : command.options) {
    options.push_back(
        {{"names", option.names},
         {"type", option.type},
         {"values", option.most_values < kAnyNumber ? Json(option.most_values) : Json()},
         {"value_optional", option.value_optional},
         {"required", option.required},
         {"repeatable", option.repeatable},
         {"what", option.what}});
  }
  Json json = {{"name", command.name},
               {"what", command.what},
               {"options", std::move(options)},
               {"footer", command.footer},
               {"commands", Json::array()}};
  for (const CommandHelp& below : command.commands) json["commands"].push_back(HelpAsJson(below));
  return json;
}

/// All pages, as files of a folder.
int WritePages(const CommandHelp& help, const ManualOptions& options, const std::string& version) {
  // The folder may be there, and those above it need not.
  std::error_code error;
  std::filesystem::create_directories(options.folder, error);
  if (error) return Unusable(fmt::format("cannot make {}: {}", options.folder, error.message()));
  // By their paths. A refusal leaves all files as they were.
  std::map<std::string, const CommandHelp*> pages;
  const auto path_of = [&](const CommandHelp* command) {
    return fmt::format("{}/{}.1", options.folder, ManualName(help, command));
  };
  pages[path_of(nullptr)] = nullptr;
  for (const CommandHelp& command : help.commands) pages[path_of(&command)] = &command;
  for (const auto& [path, command] : pages) {
    if (!MayWrite(path, outputs::kManual, options.force, {})) return kUnusable;
  }
  for (const auto& [path, command] : pages) {
    const Result<void> written = WriteFile(path, ManualPage(help, command, version));
    if (!written) return Unusable(written.error().message);
  }
  return kDone;
}

/// `man`: one page on stdout, or all.
int Manual(const CommandHelp& help, const ManualOptions& options) {
  const std::string version = std::string(help.name) + " " + Version();
  // A folder gets all pages, so that a name beside it would mean something else.
  if (!options.folder.empty() && !options.command.empty())
    return Unusable("--output writes the pages of all commands: leave out " + options.command);
  if (!options.folder.empty() && options.json)
    return Unusable("--json prints one object, and --output writes manual pages: leave one out");
  if (!options.folder.empty()) return WritePages(help, options, version);
  // Without a name it is the page of the program, which has the list of commands.
  const auto command = std::ranges::find(help.commands, options.command, &CommandHelp::name);
  if (!options.command.empty() && command == help.commands.end()) {
    std::vector<std::string> names;
    for (const CommandHelp& one : help.commands) names.push_back(one.name);
    return Unusable(fmt::format("there is no command '{}'{}; morphbus --help lists them",
                                options.command, DidYouMean(options.command, names)));
  }
  if (options.json) {
    PrintJson(HelpAsJson(options.command.empty() ? help : *command));
  } else {
    PrintText(ManualPage(help, options.command.empty() ? nullptr : &*command, version));
  }
  return kDone;
}

}  // namespace

void AddCompletion(CommandLine* line) {
  Subcommand sub = line->Add("completion", "What teaches a shell the words of this command line");
  auto shell = std::make_shared<std::string>();
  sub.Add("SHELL", shell.get(), "bash, zsh or fish").Required().TypeName("bash|zsh|fish");
  sub.Footer(
      "Examples:\n"
      "  source <(morphbus completion bash)\n"
      "  morphbus completion fish > ~/.config/fish/completions/morphbus.fish");
  sub.Do([shell] { return PrintScript(*shell); });
  // What the scripts ask is of no use to people.
  Subcommand complete = line->Add("complete", "What may stand in the place of the last word");
  complete.Hidden();
  complete.PassArguments([line](const std::vector<std::string>& words) {
    return PrintCandidates(line->Help(), words);
  });
}

void AddManual(CommandLine* line) {
  Subcommand sub = line->Add("man", "Manual pages: one on stdout, or all in a folder");
  auto options = std::make_shared<ManualOptions>();
  sub.Add("NAME", &options->command, "The command whose page it is (default: that of the program)")
      .TypeName("SUBCOMMAND");
  sub.Add("-o,--output", &options->folder, "Write the pages of all commands into this folder")
      .TypeName("FOLDER");
  sub.Force(&options->force);
  sub.Json(&options->json);
  sub.Footer(
      "Examples:\n"
      "  morphbus man run | man -l -\n"
      "  morphbus man -o ~/.local/share/man/man1");
  sub.Do([line, options] { return Manual(line->Help(), *options); });
}

}  // namespace morphbus::tools
