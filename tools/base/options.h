#pragma once
// Subcommands and their options. CLI11 stands behind these functions and is compiled in one file:
// its templates cost 2.5 s in every file that sees them (docs/libraries.md).

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/base/command_help.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace morphbus::tools {

/// What a parsed subcommand does; returns the exit status.
using Action = std::function<int()>;

/// One option or positional argument of a subcommand, to be described further. A handle: it refers
/// to the parser, which must outlive it.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  /// The command line is refused without it.
  Option& Required();
  /// What the help calls its value, such as "A,B"; by default that is the value's type. Shells
  /// complete the value by it (tools/shell/completion.h): words in small letters with | between
  /// them are what may stand there, and words such as FILE, FOLDER, ROBOT say where to look. The
  /// name of a positional argument counts as its type unless it has another.
  Option& TypeName(const std::string& name);
  /// Several values may stand in one argument, with `separator` between them.
  Option& Separator(char separator);
  /// The option takes one value and may be repeated; every value counts.
  Option& Repeatable();
  /// The option takes so many values, one argument each; its target is a vector.
  Option& Values(int least, int most);
  /// The option may stand without a value.
  Option& ValueOptional();
  /// The help leaves it out.
  Option& Hidden();
  /// A time in seconds, behind which `s` or `ms` may stand; anything else is refused.
  Option& Seconds();
  /// A fraction, 0 to 1, which may be written as a percentage; anything else is refused.
  Option& Fraction();
  /// A whole number from `least` to `most`; anything else is refused.
  Option& Range(int least, int most);

  /// Whether the command line had it. Known once an action runs.
  [[nodiscard]] bool given() const;

 private:
  CLI::Option* option_;
};

class CommandLine;

/// A subcommand: its options, and what it does. A handle, as Option is one.
///
/// `names` of Add and Flag are "-o,--output" for an option, "FILE" for a positional argument. The
/// targets are written when the command line is parsed and must live until then.
class Subcommand {
 public:
  Subcommand(CLI::App* app, CommandLine* line) : app_(app), line_(line) {}

  /// An option with a value. `Value` is std::string, a vector of them, double,
  /// std::optional<double>, int, size_t or bool (written `true` or `false`): options.cc
  /// instantiates these.
  template <typename Value>
  Option Add(const std::string& names, Value* target, const std::string& what);
  /// An option without a value: true if it is there.
  Option Flag(const std::string& names, bool* target, const std::string& what);

  // Options that mean the same in every command that has them.
  /// `--robot`: a robot of the model.
  Option Robot(std::string* target);
  /// `--description`: a file or log with the run's description, for a log that holds none.
  Option Description(std::string* target);
  /// `--force`: an output replaces any file.
  Option Force(bool* target);
  /// `--json`: the result as one JSON object.
  Option Json(bool* target);
  /// `--seed`: a whole number, 0 to 2^64 - 1. What is none, or is larger, is refused (a plain
  /// unsigned option would take -1 for the largest, and cut what is too large).
  Option Seed(uint64_t* target, const std::string& what);

  /// Adds a command below this one, which then does nothing by itself: `morphbus sweep status`.
  Subcommand Command(const std::string& name, const std::string& what);
  /// The command below this one that is meant where a file (a word with a dot or a slash) or an
  /// option stands in the place of its name.
  void Implied(const std::string& name);

  /// The list of commands leaves it out.
  void Hidden();
  /// Examples and exit statuses, at the end of the help.
  void Footer(const std::string& text);
  /// What the subcommand does if the user chose it.
  void Do(Action action);
  /// Passes everything that follows the subcommand to `action`, `--help` too: they are the
  /// arguments of another program.
  void PassArguments(std::function<int(const std::vector<std::string>&)> action);

 private:
  CLI::App* app_;
  CommandLine* line_;
};

/// The command line as a whole: a program with subcommands.
class CommandLine {
 public:
  /// `what` begins the help, `footer` ends it; `version` makes what --version prints, only if that
  /// is asked for.
  CommandLine(const std::string& program, const std::string& what, const std::string& footer,
              std::function<std::string()> version);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  /// Adds a subcommand; `what` is its line in the list of commands and begins its own help.
  Subcommand Add(const std::string& name, const std::string& what);

  /// Parses the arguments. Returns the exit status if nothing is left to do: help was printed, or
  /// the arguments cannot be used, which stderr says with the nearest name for a misspelt one.
  /// Otherwise action() is the chosen one.
  std::optional<int> Parse(int argc, const char* const* argv);
  /// The action of the subcommand that the user chose; empty before a successful Parse.
  [[nodiscard]] const Action& action() const { return action_; }

  /// The program and all its commands, as they have been added so far.
  [[nodiscard]] CommandHelp Help() const;

 private:
  friend class Subcommand;

  std::unique_ptr<CLI::App> app_;
  Action action_;
  /// The commands that are implied below others.
  std::map<const CLI::App*, std::string> implied_;
  /// What the command line has behind a command that passes it on.
  std::vector<std::string> passed_;
};

}  // namespace morphbus::tools
