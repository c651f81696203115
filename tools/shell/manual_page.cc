#include "tools/shell/manual_page.h"

#include <fmt/format.h>

#include <sstream>

namespace morphbus::tools {
namespace {

/// Text that roff takes as it is: backslashes and dashes are signs of its language, and so are a
/// full stop or an apostrophe that begins a line.
std::string Plain(const std::string& text) {
  std::string plain;
  for (const char c : text) {
    // roff takes a line that begins so for one of its requests.
    const bool begins = plain.empty() || plain.back() == '\n';
    if (begins && (c == '.' || c == '\'')) plain += "\\&";
    if (c == '\\') {
      plain += "\\e";
    } else if (c == '-') {
      plain += "\\-";
    } else {
      plain += c;
    }
  }
  return plain;
}

/// In bold stands what is typed as it is, in italics what others stand for (man-pages(7)).
std::string Bold(const std::string& text) { return "\\fB" + Plain(text) + "\\fR"; }
std::string Italic(const std::string& text) { return "\\fI" + Plain(text) + "\\fR"; }

/// "[OPTIONS] FILE.m3l [PROGRAM...]": what stands behind the name of a command.
std::string Synopsis(const CommandHelp& command) {
  std::string text = " [" + Italic("OPTIONS") + "]";
  if (!command.commands.empty()) return text + " " + Italic("COMMAND") + " ...";
  for (const OptionHelp& argument : command.options) {
    if (!argument.positional()) continue;
    std::string word = Italic(argument.names.front());
    if (argument.most_values > 1) word += "...";
    text += argument.required ? " " + word : " [" + word + "]";
  }
  return text;
}

/// A paragraph with a tag for each option, or for each positional argument.
std::string Options(const CommandHelp& command, bool positional) {
  std::string text;
  for (const OptionHelp& option : command.options) {
    if (option.positional() != positional) continue;
    std::string tag;
    for (const std::string& name : option.names) {
      if (!tag.empty()) tag += ", ";
      tag += positional ? Italic(name) : Bold(name);
    }
    // The name of a positional argument says already what it is.
    if (!positional && option.most_values > 0) {
      const std::string value = Italic(option.type);
      tag += option.value_optional ? " [" + value + "]" : " " + value;
    }
    text += ".TP\n" + tag + "\n" + Plain(option.what) + "\n";
  }
  return text;
}

/// The end of the help: sentences are paragraphs, a line with a colon at its end begins a list that
/// is set as it stands.
std::string Footer(const std::string& footer) {
  std::string text;
  std::istringstream lines(footer);
  bool as_it_stands = false;
  for (std::string line; std::getline(lines, line);) {
    // What is indented in the help are lines to type, or a table: it keeps its lines here.
    const bool indented = line.starts_with("  ");
    if (as_it_stands && !indented) text += ".EE\n.RE\n";
    if (!indented) {
      text += ".PP\n" + Plain(line) + "\n";
    } else if (!as_it_stands) {
      text += ".PP\n.RS 4\n.EX\n";
    }
    if (indented) text += Plain(line.substr(2)) + "\n";
    as_it_stands = indented;
  }
  if (as_it_stands) text += ".EE\n.RE\n";
  return text;
}

/// Arguments, options and footer of a command, under headings of this kind (".SH" or ".SS").
std::string Body(const CommandHelp& command, const std::string& heading) {
  std::string text;
  const std::string arguments = Options(command, true);
  if (!arguments.empty()) text += heading + " ARGUMENTS\n" + arguments;
  const std::string options = Options(command, false);
  if (!options.empty()) text += heading + " OPTIONS\n" + options;
  if (!command.footer.empty()) text += heading + " NOTES AND EXAMPLES\n" + Footer(command.footer);
  return text;
}

}  // namespace

std::string ManualName(const CommandHelp& program, const CommandHelp* command) {
  return command == nullptr ? program.name : program.name + "-" + command->name;
}

std::string ManualPage(const CommandHelp& program, const CommandHelp* command,
                       const std::string& version) {
  const CommandHelp& subject = command == nullptr ? program : *command;
  const std::string name = ManualName(program, command);
  const std::string words = command == nullptr ? name : program.name + " " + command->name;
  std::string page =
      fmt::format(".TH {} 1 \"\" \"{}\" \"Morphbus\"\n", Plain(name), Plain(version));
  page += fmt::format(".SH NAME\n{} \\- {}\n", Plain(name), Plain(subject.what));
  // One line for the command, and one for each of those below it.
  page += ".SH SYNOPSIS\n" + Bold(words) + Synopsis(subject) + "\n";
  for (const CommandHelp& below :
       command == nullptr ? std::vector<CommandHelp>() : subject.commands)
    page += ".br\n" + Bold(words + " " + below.name) + Synopsis(below) + "\n";
  // The program's commands have pages of their own, and those of a command stand on its page.
  if (command == nullptr) {
    page += ".SH COMMANDS\n";
    for (const CommandHelp& below : subject.commands) {
      page += ".TP\n" + Bold(ManualName(program, &below)) + "(1)\n" + Plain(below.what) + "\n";
    }
  }
  page += Body(subject, ".SH");
  if (command != nullptr) {
    for (const CommandHelp& below : subject.commands) {
      page += ".SH " + Plain(words + " " + below.name) + "\n" + Plain(below.what) + ".\n";
      page += Body(below, ".SS");
    }
    page += ".SH SEE ALSO\n" + Bold(program.name) + "(1)\n";
  }
  return page;
}

}  // namespace morphbus::tools
