#include "tools/spy/spy_terminal.h"

#include <langinfo.h>
#include <unistd.h>

#include <algorithm>
#include <clocale>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string_view>

// Comes last: it defines macros with plain names.
#include <curses.h>

namespace morphbus::tools {
namespace {

/// How a style looks: which of ncurses's colour pairs it has (0: the terminal's own colours), and
/// what tells it from others without colour.
struct Look {
  short pair = 0;
  attr_t attributes = A_NORMAL;
};

Look LookOf(Style style) {
  switch (style) {
    case Style::kHeading:
      return {1, A_REVERSE};
    case Style::kGood:
      return {2, A_NORMAL};
    case Style::kBad:
      return {3, A_BOLD};
    case Style::kKey:
      return {4, A_BOLD};
    case Style::kTitle:
      return {0, A_BOLD};
    case Style::kSelected:
      return {0, A_REVERSE};
    case Style::kDim:
      return {0, A_DIM};
    case Style::kPlain:
      break;
  }
  return {};
}

/// What ncurses calls the key.
Key::Code CodeOf(int key) {
  using Code = Key::Code;
  static const std::map<int, Code> codes = {
      {KEY_UP, Code::kUp},       {KEY_DOWN, Code::kDown},    {KEY_LEFT, Code::kLeft},
      {KEY_RIGHT, Code::kRight}, {KEY_PPAGE, Code::kPageUp}, {KEY_NPAGE, Code::kPageDown},
      {KEY_HOME, Code::kHome},   {KEY_END, Code::kEnd},      {KEY_ENTER, Code::kEnter},
      {'\n', Code::kEnter},      {'\r', Code::kEnter},       {KEY_BACKSPACE, Code::kBackspace},
      {'\b', Code::kBackspace},  {0x7f, Code::kBackspace},   {0x1b, Code::kEscape},
      {'\t', Code::kTab}};
  const auto found = codes.find(key);
  return found == codes.end() ? Code::kOther : found->second;
}

}  // namespace

bool CanShowScreen() {
  // In a pipe, or on a terminal that only knows lines, the spy prints its tables instead.
  const char* term = std::getenv("TERM");
  return isatty(STDIN_FILENO) == 1 && isatty(STDOUT_FILENO) == 1 && term != nullptr &&
         *term != '\0' && std::strcmp(term, "dumb") != 0;
}

Result<std::unique_ptr<SpyTerminal>> SpyTerminal::Open() {
  // The locale tells which bytes a character has; numbers stay as they are in C.
  std::setlocale(LC_CTYPE, "");
  const bool utf8 = std::strcmp(nl_langinfo(CODESET), "UTF-8") == 0;
  // Unlike initscr, newterm returns if the terminal is unknown.
  if (newterm(nullptr, stdout, stdin) == nullptr) {
    const char* term = std::getenv("TERM");
    return Fail(std::string("the terminal cannot show a screen (TERM is '") +
                (term == nullptr ? "" : term) + "')");
  }
  std::unique_ptr<SpyTerminal> terminal(new SpyTerminal(utf8));
  // Keys come at once, unechoed and decoded, and reading never waits.
  // Ctrl-C stays a signal, which ends the program in order.
  cbreak();
  noecho();
  nonl();
  keypad(stdscr, TRUE);
  nodelay(stdscr, TRUE);
  // An Escape that no sequence follows at once is the key.
  set_escdelay(25);
  curs_set(0);
  // Without colours the attributes still tell styles apart (no-color.org).
  const char* no_color = std::getenv("NO_COLOR");
  if (has_colors() == TRUE && (no_color == nullptr || *no_color == '\0')) {
    start_color();
    use_default_colors();
    init_pair(1, COLOR_CYAN, -1);
    init_pair(2, COLOR_GREEN, -1);
    init_pair(3, COLOR_RED, -1);
    init_pair(4, COLOR_YELLOW, -1);
    terminal->colors_ = true;
  }
  return terminal;
}

SpyTerminal::~SpyTerminal() {
  // The terminal is given back as it was before memory is.
  endwin();
  delscreen(set_term(nullptr));
}

std::pair<int, int> SpyTerminal::Size() const { return {getmaxx(stdscr), getmaxy(stdscr)}; }

void SpyTerminal::Draw(const Screen& screen) {
  // ncurses finds out what has changed and sends only that.
  erase();
  // The window may have become smaller since the screen was laid out for it.
  const int lines = std::min(getmaxy(stdscr), static_cast<int>(screen.size()));
  for (int y = 0; y < lines; ++y) {
    move(y, 0);
    // Each span in its style; lines were cut to the width before.
    for (const Span& span : screen[y]) {
      const std::string text = utf8_ ? span.text : ToAscii(span.text);
      const Look look = LookOf(span.style);
      attr_set(look.attributes, colors_ ? look.pair : short{0}, nullptr);
      addstr(text.c_str());
    }
  }
  attr_set(A_NORMAL, 0, nullptr);
  refresh();
}

std::optional<Key> SpyTerminal::ReadKey() {
  // Characters beyond ASCII are no keys of the spy's.
  const int key = getch();
  if (key == ERR) return std::nullopt;
  Key read;
  read.code = CodeOf(key);
  // Printable characters are keys of their own, and text where a filter is typed.
  if (key >= 0x20 && key < 0x7f) {
    read.code = Key::Code::kCharacter;
    read.character = static_cast<char>(key);
  }
  return read;
}

}  // namespace morphbus::tools
