#pragma once
// What may stand where the cursor is on a shell's command line.

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tools/base/command_help.h"

namespace morphbus::tools {

/// A word that may stand there, and what it is, for people.
struct Candidate {
  std::string word, what;
};

/// All that may. Which files there are the shell knows better: it has the user's tilde and quotes.
struct Completion {
  /// Those that begin with what is there already. One that ends in '=' or '@' wants a value behind
  /// it.
  std::vector<Candidate> candidates;
  bool files = false, folders = false;
  /// Of the files' names; empty: files of any name. Where there is none with such an ending, any
  /// other may be meant.
  std::vector<std::string> endings;
};

/// The words before the cursor, taken apart as far as they can be.
struct TypedLine {
  /// The command that they name; it belongs to the program's help.
  const CommandHelp* command = nullptr;
  std::vector<std::string> arguments;  ///< The positional ones.
  /// Values of options, under the last of their names ("--output" of "-o,--output").
  std::map<std::string, std::vector<std::string>> options;
};

/// What stands for a value.
struct TypeValues {
  std::vector<Candidate> words;
  /// Another type that the value has on this line, such as FILE.dyn; empty: none.
  std::string type = {};
};
/// Finds what stands for a value of this type (Option::TypeName), which names neither files nor the
/// values themselves: the robots of the model on the line for ROBOT, and so on. Those words that do
/// not fit what is typed already are left out by who asks.
using ValueFinder = std::function<TypeValues(const std::string& type, const TypedLine& line)>;

/// What may stand in the place of the last of `words`, which follow the name of the program; the
/// last one is as far typed as it is, and may be empty. Nothing where the words before it are no
/// command.
Completion Complete(const CommandHelp& program, const std::vector<std::string>& words,
                    const ValueFinder& values);

}  // namespace morphbus::tools
