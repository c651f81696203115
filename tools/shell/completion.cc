#include "tools/shell/completion.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <utility>

namespace morphbus::tools {
namespace {

/// The pieces of a text between separators.
std::vector<std::string> Split(const std::string& text, char separator) {
  std::vector<std::string> pieces;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(separator, begin), text.size());
    pieces.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return pieces;
}

/// ".m3l" of "FILE.m3l"; "" for a type that is no file with an ending, such as
/// "MODULE.JOINT=VALUE".
std::string EndingOf(const std::string& type) {
  const auto is_upper = [](unsigned char c) { return std::isupper(c) != 0; };
  const size_t dot = type.find('.');
  if (dot == std::string::npos || dot == 0) return "";
  const std::string ending = type.substr(dot);
  return std::all_of(type.begin(), type.begin() + static_cast<std::ptrdiff_t>(dot), is_upper) &&
                 std::ranges::none_of(ending, is_upper)
             ? ending
             : "";
}

/// What is being completed.
class Completer {
 public:
  Completer(const CommandHelp& program, const ValueFinder& values)
      : program_(program), values_(values) {
    line_.command = &program;
  }

  Completion Run(const std::vector<std::string>& words) {
    size_t at = 0;
    if (!FollowCommands(words, &at)) return {};
    for (; at + 1 < words.size(); ++at) Take(words[at]);
    Offer(words.back());
    return std::move(found_);
  }

 private:
  /// Goes down to the command that the words name; `at` is then the word behind its name. False if
  /// one of them is no command.
  bool FollowCommands(const std::vector<std::string>& words, size_t* at) {
    for (; *at + 1 < words.size() && !line_.command->commands.empty(); ++*at) {
      const CommandHelp* below = Find(words[*at]);
      if (below == nullptr) {
        // A file or an option in the place of the name stands for the command that is implied.
        below = Find(line_.command->implied);
        if (below == nullptr) return false;
        line_.command = below;
        return true;
      }
      line_.command = below;
    }
    return true;
  }

  /// The command of this name below the present one; null: none.
  const CommandHelp* Find(const std::string& name) const {
    const auto& commands = line_.command->commands;
    const auto at = std::ranges::find(commands, name, &CommandHelp::name);
    return at == commands.end() ? nullptr : &*at;
  }

  /// The option with this name, dashes included; null: none.
  const OptionHelp* FindOption(const std::string& name) const {
    for (const OptionHelp& option : line_.command->options) {
      if (!option.positional() && std::ranges::count(option.names, name) > 0) return &option;
    }
    return nullptr;
  }

  /// Takes in a word before the cursor.
  void Take(const std::string& word) {
    if (!only_arguments_ && word.starts_with("-")) {
      TakeOption(word);
      return;
    }
    if (open_ == nullptr) {
      line_.arguments.push_back(word);
      return;
    }
    std::vector<std::string>& values = line_.options[open_->names.back()];
    values.push_back(word);
    if (++taken_ >= open_->most_values) open_ = nullptr;
  }

  /// Takes in an option, with the value that stands in the same word.
  void TakeOption(const std::string& word) {
    // Whatever the option before it still wanted does not come any more.
    open_ = nullptr;
    only_arguments_ = word == "--";
    const size_t equals = word.find('=');
    const OptionHelp* option = FindOption(word.substr(0, equals));
    if (option == nullptr) return;
    std::vector<std::string>& values = line_.options[option->names.back()];
    if (equals != std::string::npos) {
      values.push_back(word.substr(equals + 1));
    } else if (option->most_values > 0) {
      open_ = option;
      taken_ = 0;
    }
  }

  /// What may stand in the place of `word`.
  void Offer(const std::string& word) {
    const size_t equals = word.starts_with("--") ? word.find('=') : std::string::npos;
    if (equals != std::string::npos) {
      // "--robot=qua": the option stays before its value.
      const OptionHelp* option = FindOption(word.substr(0, equals));
      if (option == nullptr) return;
      before_ = word.substr(0, equals + 1);
      OfferValue(*option, 0, word);
      return;
    }
    const bool needs_value = open_ != nullptr && taken_ == 0 && !open_->value_optional;
    if (open_ != nullptr) OfferValue(*open_, taken_, word);
    if (needs_value) return;
    const bool option = word.starts_with("-") && !only_arguments_;
    if (option) OfferOptions(word);
    if (!option && line_.command->commands.empty()) OfferArgument(word);
    if (line_.command->commands.empty()) return;
    if (!option) {
      for (const CommandHelp& below : line_.command->commands) Add(below.name, below.what, word);
    }
    // Beside the names of commands there may be what the implied one takes.
    const CommandHelp* implied = Find(line_.command->implied);
    if (implied == nullptr) return;
    line_.command = implied;
    option ? OfferOptions(word) : OfferArgument(word);
  }

  /// Options of the command, those that are there already left out where they count once.
  void OfferOptions(const std::string& word) {
    for (const OptionHelp& option : line_.command->options) {
      if (option.positional()) continue;
      if (line_.options.contains(option.names.back()) && !option.repeatable) continue;
      Add(option.names.back(), option.what, word);
    }
  }

  /// The positional argument whose turn it is.
  void OfferArgument(const std::string& word) {
    int before = static_cast<int>(line_.arguments.size());
    for (const OptionHelp& argument : line_.command->options) {
      if (!argument.positional()) continue;
      if (before < argument.most_values) {
        OfferValue(argument, before, word);
        return;
      }
      before -= argument.most_values;
    }
  }

  /// The values of an option or argument, of which there are `taken` already.
  void OfferValue(const OptionHelp& option, int taken, const std::string& word) {
    // "MODULE [ROLE]" has a word for each of its values.
    std::vector<std::string> types = Split(option.type, ' ');
    const size_t which = std::min(types.size() - 1, static_cast<size_t>(taken));
    std::string type = types[which];
    if (type.starts_with("[") && type.ends_with("]")) type = type.substr(1, type.size() - 2);
    if (type.ends_with("...")) type.resize(type.size() - 3);
    for (const std::string& one : Split(type, '|')) OfferType(one, option.what, word);
  }

  /// What a value of one type may be; a type that is in no list is left to `values_`.
  void OfferType(const std::string& type, const std::string& what, const std::string& word) {
    if (type == "FILE" || type == "IMAGE" || type == "DB") {
      found_.files = true;
    } else if (type == "LOG") {
      found_.files = true;
      for (const char* ending : {".log", ".log.zst", ".partial"})
        found_.endings.emplace_back(ending);
    } else if (type == "FOLDER") {
      found_.folders = true;
    } else if (type == "SUBCOMMAND") {
      for (const CommandHelp& one : program_.commands) Add(one.name, one.what, word);
    } else if (const std::string ending = EndingOf(type); !ending.empty()) {
      found_.files = true;
      found_.endings.push_back(ending);
    } else if (!type.empty() && std::islower(static_cast<unsigned char>(type[0])) != 0) {
      Add(type, what, word);
    } else {
      const TypeValues values = values_(type, line_);
      for (const Candidate& one : values.words) Add(one.word, one.what, word);
      if (!values.type.empty()) OfferType(values.type, what, word);
    }
  }

  /// A candidate, if it begins with what is there.
  void Add(const std::string& candidate, const std::string& what, const std::string& word) {
    const std::string whole = before_ + candidate;
    // An implied command has options that the one above it has, too.
    const bool there = std::ranges::count(found_.candidates, whole, &Candidate::word) > 0;
    if (whole.starts_with(word) && !there) found_.candidates.push_back({whole, what});
  }

  const CommandHelp& program_;
  const ValueFinder& values_;
  TypedLine line_;
  Completion found_;
  /// The option whose values are still coming, and how many it has; null: none.
  const OptionHelp* open_ = nullptr;
  int taken_ = 0;
  /// Behind "--" there are no options.
  bool only_arguments_ = false;
  std::string before_;  ///< "--robot=", where the value follows in the same word.
};

}  // namespace

Completion Complete(const CommandHelp& program, const std::vector<std::string>& words,
                    const ValueFinder& values) {
  return Completer(program, values).Run(words);
}

}  // namespace morphbus::tools
