#pragma once
// The command line as plain data, from which the shells' completion and the manual pages are made.

#include <string>
#include <vector>

namespace morphbus::tools {

/// An option or a positional argument.
struct OptionHelp {
  /// With their dashes, as on the command line: "-o", "--output". A positional argument has one
  /// name without any.
  std::vector<std::string> names;
  /// What its value is, in the words of Option::TypeName; empty: it has none.
  std::string type;
  /// How many values may follow it: 0 for a flag, 1 for most, 2^29 and more where there is no
  /// limit.
  int most_values = 0;
  /// It may stand without a value.
  bool value_optional = false;
  /// The command line is refused without it.
  bool required = false;
  /// It may stand there more than once.
  bool repeatable = false;
  /// A sentence for the help.
  std::string what;

  /// Whether its place says what it is, and not a name with dashes.
  [[nodiscard]] bool positional() const { return names.front().front() != '-'; }
};

/// The program, or a command of it. What the help leaves out is not in it.
struct CommandHelp {
  std::string name;  ///< One word: "run".
  std::string what;  ///< A line that says what it does.
  /// Commands, exit statuses and examples, as the help ends with them.
  std::string footer;
  std::vector<OptionHelp> options;  ///< In the order of the help.
  std::vector<CommandHelp> commands;
  /// Which of the commands is meant where a file or an option stands in the place of its name;
  /// empty: none.
  std::string implied;
};

}  // namespace morphbus::tools
