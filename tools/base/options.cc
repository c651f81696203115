#include "tools/base/options.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstddef>
#include <limits>
#include <type_traits>
#include <utility>

#include "compiler/base/quantity.h"
#include "tools/base/messages.h"

namespace morphbus::tools {
namespace {

/// Leaves CLI11 a plain number of what people write with its unit.
CLI::Validator InUnits(const QuantityReader& reader) {
  return CLI::Validator([&reader](std::string& text) { return MakePlain(reader, &text); }, "");
}

/// All subcommands: CLI11 gives without a filter only those that the command line names.
std::vector<const CLI::App*> CommandsOf(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

/// "morphbus sweep": a command with those above it.
std::string FullName(const CLI::App& app) {
  const CLI::App* above = app.get_parent();
  return (above == nullptr ? "" : FullName(*above) + " ") + app.get_name();
}

/// Follows the names of commands at the beginning of `words`, behind the program, and puts in those
/// that are implied. The exit status if a word is meant as a command and is none; the nearest one
/// is named, where CLI11 would call the word an unexpected argument.
std::optional<int> FollowCommands(const CLI::App& program,
                                  const std::map<const CLI::App*, std::string>& implied,
                                  std::vector<std::string>* words) {
  const CLI::App* app = &program;
  for (size_t i = 0;; ++i) {
    const std::vector<const CLI::App*> commands = CommandsOf(*app);
    // Who has no commands takes the rest as options and arguments.
    if (commands.empty() || i == words->size()) return std::nullopt;
    const std::string word = (*words)[i];
    const auto called = [&](const CLI::App* sub) { return sub->check_name(word); };
    if (const auto sub = std::ranges::find_if(commands, called); sub != commands.end()) {
      app = *sub;
      continue;
    }
    // Help and version are of the command that the words before have named.
    const bool of_all = word == "-h" || word == "--help" || word == "--version";
    const auto default_command = implied.find(app);
    if (default_command != implied.end() && !of_all &&
        (word.starts_with("-") || word.find_first_of("./") != std::string::npos)) {
      words->insert(words->begin() + static_cast<std::ptrdiff_t>(i), default_command->second);
      return std::nullopt;
    }
    if (word.starts_with("-")) return std::nullopt;
    std::vector<std::string> names;
    for (const CLI::App* sub : commands) {
      if (!sub->get_group().empty()) names.push_back(sub->get_name());
    }
    return Unusable(fmt::format("there is no command '{}'{}; {} --help lists them", word,
                                DidYouMean(word, names), FullName(*app)));
  }
}

/// The exit status if an option is given an empty value, such as that of a shell's variable that is
/// not set: that is not meant, and CLI11 would take it for an option that was left out.
std::optional<int> RefuseEmptyValue(const std::vector<std::string>& words) {
  std::string option;
  for (const std::string& argument : words) {
    // "--log=" is "--log" and an empty value in one word.
    const size_t equals = argument.starts_with("--") ? argument.find('=') : std::string::npos;
    const bool whole = equals != std::string::npos && equals + 1 == argument.size();
    if (whole) option = argument.substr(0, equals);
    if (whole || (argument.empty() && !option.empty())) {
      return Unusable(
          fmt::format("{}: its value is empty; leave the option out, or give it one", option));
    }
    option = argument.size() > 1 && argument.front() == '-' ? argument : "";
  }
  return std::nullopt;
}

/// The options that a user may write, with their dashes.
std::vector<std::string> OptionNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;  // hidden
    // CLI11 keeps long and short names apart and without their dashes.
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  return names;
}

/// Whether `word` is `name` with letters left out, as "--secs" is of "--seconds".
bool Abbreviates(const std::string& word, const std::string& name) {
  size_t at = 0;
  for (const char c : name) at += at < word.size() && word[at] == c ? 1 : 0;
  return at == word.size();
}

/// The option that is meant: the only one of which the word is an abbreviation, else the nearest.
std::string MeantOption(const std::string& word, const std::vector<std::string>& names) {
  constexpr size_t kShortest = 5;  // With the dashes: three letters.
  std::vector<std::string> longer;
  for (const std::string& name : names) {
    if (word.size() >= kShortest && Abbreviates(word, name)) longer.push_back(name);
  }
  return longer.size() == 1 ? fmt::format(" (did you mean '{}'?)", longer.front())
                            : DidYouMean(word, names);
}

/// "there is no option '--robt' (did you mean '--robot'?)" for the first argument that looks like
/// an option of `app` and is none; "" without one.
std::string UnknownOption(const CLI::App& app) {
  // CLI11 leaves over what it could not assign; an option among it is one that is not defined.
  for (const std::string& argument : app.remaining()) {
    if (argument.size() < 2 || argument.front() != '-') continue;
    const std::string name = argument.substr(0, argument.find('='));
    const bool has_letters = name.starts_with("--");  // one letter is near to every other one
    return fmt::format("there is no option '{}'{}", name,
                       has_letters ? MeantOption(name, OptionNames(app)) : "");
  }
  return "";
}

/// Says what is wrong with the options; help and version are no errors.
int ReportParseError(const CLI::App& app, const CLI::ParseError& error) {
  const auto status = static_cast<CLI::ExitCodes>(error.get_exit_code());
  // CLI11 throws for --help and --version too, and app.exit prints what they ask for.
  if (status == CLI::ExitCodes::Success) return app.exit(error);
  // The hint names the command whose help lists the options.
  const CLI::App* command = &app;
  std::string what = UnknownOption(app);
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().front();
    if (what.empty()) what = UnknownOption(*command);
  }
  // A misspelt option often shows as another that is missing: the misspelt one is the cause.
  if (what.empty()) what = error.what();
  return Unusable(fmt::format("{} (see {} --help)", what, FullName(*command)));
}

/// An option or positional argument as data.
OptionHelp HelpOf(const CLI::Option& option) {
  OptionHelp help;
  // CLI11 keeps short and long names apart and without their dashes.
  for (const std::string& name : option.get_snames()) help.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) help.names.push_back("--" + name);
  if (option.get_positional()) help.names = {option.get_name(true)};
  help.most_values = option.get_items_expected_max();
  // Behind a colon stand the checks of the value, such as its range.
  const std::string type = option.get_type_name();
  if (help.most_values > 0) help.type = type.substr(0, type.find(':'));
  if (help.type.empty() && option.get_positional()) help.type = help.names.front();
  help.value_optional = option.get_items_expected_min() == 0;
  help.required = option.get_required();
  help.repeatable = option.get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll;
  help.what = option.get_description();
  return help;
}

/// A command, and those below it, as data.
CommandHelp HelpOf(const CLI::App& app, const std::map<const CLI::App*, std::string>& implied) {
  CommandHelp help = {app.get_name(), app.get_description(), app.get_footer(), {}, {}, ""};
  for (const CLI::Option* option : app.get_options()) {
    // The empty group is that of what is hidden.
    if (!option->get_group().empty()) help.options.push_back(HelpOf(*option));
  }
  for (const CLI::App* sub : CommandsOf(app)) {
    if (!sub->get_group().empty()) help.commands.push_back(HelpOf(*sub, implied));
  }
  if (const auto it = implied.find(&app); it != implied.end()) help.implied = it->second;
  return help;
}

}  // namespace

Option& Option::Required() {
  option_->required();
  return *this;
}

Option& Option::TypeName(const std::string& name) {
  option_->type_name(name);
  return *this;
}

Option& Option::Separator(char separator) {
  option_->delimiter(separator);
  return *this;
}

Option& Option::Repeatable() {
  // Without expected(1) one option would swallow all values behind it, the files too.
  option_->expected(1)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  return *this;
}

Option& Option::Values(int least, int most) {
  option_->expected(least, most);
  return *this;
}

Option& Option::ValueOptional() {
  option_->expected(0, 1);
  return *this;
}

Option& Option::Hidden() {
  // CLI11 lists options by group, and the empty group not at all.
  option_->group("");
  return *this;
}

Option& Option::Seconds() {
  option_->transform(InUnits(kSecondsReader))->type_name("TIME");
  return *this;
}

Option& Option::Fraction() {
  option_->transform(InUnits(kFractionReader))->type_name("FRACTION");
  return *this;
}

Option& Option::Range(int least, int most) {
  option_->check(CLI::Range(least, most));
  return *this;
}

bool Option::given() const { return option_->count() > 0; }

namespace {

/// The number in an option that may be left out, or the number itself.
template <typename Value>
struct NumberIn {
  using Type = Value;
};
template <typename Value>
struct NumberIn<std::optional<Value>> {
  using Type = Value;
};

/// What is wrong with the text of a number, which CLI11 does not say; "" if nothing is.
template <typename Number>
std::string WhyNoNumber(const std::string& text) {
  if constexpr (std::is_integral_v<Number>) {
    // CLI11 takes -1 and what is too large for the largest number of the type.
    if (ReadNumber<Number>(text)) return "";
    return fmt::format("expected a whole number{} below 2^{}, not '{}'",
                       std::is_unsigned_v<Number> ? ", 0 or more and" : "",
                       std::numeric_limits<Number>::digits, text);
  } else {
    Number number = 0;
    return CLI::detail::lexical_cast(text, number) ? "" : "expected a number, not '" + text + "'";
  }
}

}  // namespace

template <typename Value>
Option Subcommand::Add(const std::string& names, Value* target, const std::string& what) {
  // CLI11 picks the parser by the type of the target.
  CLI::Option* option = app_->add_option(names, *target, what);
  using Number = typename NumberIn<Value>::Type;
  if constexpr (std::is_arithmetic_v<Number> && !std::is_same_v<Number, bool>) {
    option->check(CLI::Validator([](std::string& text) { return WhyNoNumber<Number>(text); }, ""));
  }
  // The name of a positional argument says what it is, so that "TEXT" behind it would say nothing.
  if (option->get_positional()) option->type_name("");
  return Option(option);
}

// The header only declares the template: these are the types that options may have.
using Text = std::string;
template Option Subcommand::Add(const Text&, Text*, const Text&);
template Option Subcommand::Add(const Text&, std::vector<Text>*, const Text&);
template Option Subcommand::Add(const Text&, double*, const Text&);
template Option Subcommand::Add(const Text&, std::optional<double>*, const Text&);
template Option Subcommand::Add(const Text&, int*, const Text&);
template Option Subcommand::Add(const Text&, size_t*, const Text&);
template Option Subcommand::Add(const Text&, bool*, const Text&);

Option Subcommand::Flag(const std::string& names, bool* target, const std::string& what) {
  return Option(app_->add_flag(names, *target, what));
}

Option Subcommand::Robot(std::string* target) {
  return Add("--robot", target, "The robot's name (default: the only one)").TypeName("ROBOT");
}

Option Subcommand::Description(std::string* target) {
  return Add("--description", target,
             "The run's description for a log that holds none: a file of convert --to description, "
             "or another log of the same model")
      .TypeName("FILE|LOG");
}

Option Subcommand::Force(bool* target) {
  return Flag("--force", target, "Write over a file that is not of the output's kind");
}

Option Subcommand::Json(bool* target) {
  return Flag("--json", target, "One JSON object on stdout");
}

Option Subcommand::Seed(uint64_t* target, const std::string& what) {
  return Add("--seed", target, what);
}

Subcommand Subcommand::Command(const std::string& name, const std::string& what) {
  app_->require_subcommand(1);
  return {app_->add_subcommand(name, what), line_};
}

void Subcommand::Implied(const std::string& name) { line_->implied_[app_] = name; }

void Subcommand::Hidden() { app_->group(""); }

void Subcommand::Footer(const std::string& text) { app_->footer(text); }

void Subcommand::Do(Action action) {
  // CLI11 calls this while it parses; the action itself runs later, when all options are read.
  app_->callback([chosen = &line_->action_, action = std::move(action)] { *chosen = action; });
}

void Subcommand::PassArguments(std::function<int(const std::vector<std::string>&)> action) {
  app_->prefix_command();
  app_->set_help_flag();
  Do([line = line_, action = std::move(action)] { return action(line->passed_); });
}

CommandLine::CommandLine(const std::string& program, const std::string& what,
                         const std::string& footer, std::function<std::string()> version)
    : app_(std::make_unique<CLI::App>(what, program)) {
  app_->set_version_flag("--version", std::move(version));
  // Without a subcommand there is nothing to do, which is an error.
  app_->require_subcommand(1);
  app_->footer(footer);
}

CommandLine::~CommandLine() = default;

Subcommand CommandLine::Add(const std::string& name, const std::string& what) {
  return {app_->add_subcommand(name, what), this};
}

CommandHelp CommandLine::Help() const { return HelpOf(*app_, implied_); }

std::optional<int> CommandLine::Parse(int argc, const char* const* argv) {
  // This comes before CLI11 sees the arguments: a misspelt command may look like an argument of the
  // program.
  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  if (const auto status = FollowCommands(*app_, implied_, &words)) return status;
  // What follows a command that passes it on is nothing that CLI11, or a check, should see.
  const auto passes = [&](const CLI::App* sub) {
    return sub->get_prefix_command() && !words.empty() && sub->check_name(words.front());
  };
  if (std::ranges::any_of(CommandsOf(*app_), passes)) {
    passed_.assign(words.begin() + 1, words.end());
    words.resize(1);
  }
  if (const std::optional<int> status = RefuseEmptyValue(words)) return status;
  try {
    // CLI11 takes them from the end.
    std::ranges::reverse(words);
    app_->parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    return ReportParseError(*app_, error);
  }
  // A parse that chose no action would be a subcommand without Do().
  return action_ ? std::nullopt : std::optional<int>(kUnusable);
}

}  // namespace morphbus::tools
