#include "tools/base/messages.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <map>
#include <sstream>
#include <string_view>

#include "compiler/base/text.h"
#include "tools/base/print.h"

namespace morphbus::tools {

bool IsFancyTerminal(int fd) {
  // https://no-color.org: the variable counts if it is not empty.
  // A dumb terminal, such as an editor's shell window, would show the escapes as text.
  const char* term = std::getenv("TERM");
  const char* no_color = std::getenv("NO_COLOR");
  if (fd == STDERR_FILENO && HeldSaying::Any()) return false;
  return isatty(fd) == 1 && (no_color == nullptr || *no_color == '\0') && term != nullptr &&
         std::strcmp(term, "dumb") != 0;
}

namespace {

/// Prints one line on stderr, with the severity in `color` (an escape sequence) on a terminal.
void SayLine(const char* severity, const char* color, const std::string& message) {
  if (IsFancyTerminal(STDERR_FILENO)) {
    // The escape \033[0m ends the colour.
    Say("morphbus: {}{}:\033[0m {}\n", color, severity, message);
  } else {
    Say("morphbus: {}: {}\n", severity, message);
  }
}

/// A warning without the names and figures that tell it from others of its kind.
std::string KindOf(const std::string& message) {
  std::istringstream words(message);
  std::string kind;
  for (std::string word; words >> word;) {
    // A word is taken for a name or a figure if it has a point inside or a digit anywhere.
    const std::string_view inner = std::string_view(word).substr(0, word.size() - 1);
    // A point at the end of a word ends a sentence and makes no name of it.
    const bool is_name = inner.find('.') != std::string_view::npos ||
                         word.find_first_of("0123456789") != std::string::npos;
    kind += is_name ? "* " : word + " ";
  }
  return kind;
}

}  // namespace

int Unusable(const std::string& message) {
  SayLine("error", "\033[1;31m", message);
  return kUnusable;
}

std::nullopt_t Refuse(const std::string& message) {
  Unusable(message);
  return std::nullopt;
}

int Failed(const std::string& message) {
  SayLine("error", "\033[1;31m", message);
  return kFailed;
}

void Warn(const std::string& message) { SayLine("warning", "\033[1;33m", message); }

void WarnOfMany(const std::vector<std::string>& messages) {
  // Messages of one kind, kinds in the order in which they first appear.
  std::vector<std::vector<const std::string*>> kinds;
  std::map<std::string, size_t> index_of;
  for (const std::string& message : messages) {
    const size_t index = index_of.try_emplace(KindOf(message), kinds.size()).first->second;
    if (index == kinds.size()) kinds.emplace_back();
    kinds[index].push_back(&message);
  }
  for (const auto& kind : kinds) {
    // Each kind is cut by itself, so that a flood of one does not hide another.
    for (size_t i = 0; i < std::min(kind.size(), kMostNamed); ++i) Warn(*kind[i]);
    if (kind.size() > kMostNamed) {
      Warn(fmt::format("and {} more like the last", kind.size() - kMostNamed));
    }
  }
}

void PrintDiagnostics(const source::Diagnostics& diagnostics, const source::SourceSet& sources) {
  SayText(source::Render(diagnostics, sources, IsFancyTerminal(STDERR_FILENO)));
}

std::string DidYouMean(const std::string& name, const std::vector<std::string>& names) {
  // This is the measure by which the compilers suggest names in sources.
  const std::string nearest = source::NearestName(name, names);
  return nearest.empty() ? "" : fmt::format(" (did you mean '{}'?)", nearest);
}

std::string NameSome(const std::vector<std::string>& names) { return NameFirst(names, kMostNamed); }

}  // namespace morphbus::tools
