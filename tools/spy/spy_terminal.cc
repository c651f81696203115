#include "tools/spy/spy_terminal.h"

#include <langinfo.h>
#include <unistd.h>

#include <algorithm>
#include <clocale>
#include <cstdlib>
#include <cstring>
#include <string_view>

// Comes last: it defines macros with plain names.
#include <curses.h>

namespace morphbus::tools {
namespace {

/// Which of ncurses's colour pairs a style has; 0: the terminal's own colours.
short PairOf(Style style) {
  switch (style) {
    case Style::kHeading:
      return 1;
    case Style::kGood:
      return 2;
    case Style::kBad:
      return 3;
    case Style::kKey:
      return 4;
    case Style::kPlain:
    case Style::kTitle:
    case Style::kSelected:
    case Style::kDim:
      break;
  }
  return 0;
}

/// How a style looks besides its colour, so that it can be told without.
attr_t AttributesOf(Style style) {
  switch (style) {
    case Style::kTitle:
    case Style::kKey:
    case Style::kBad:
      return A_BOLD;
    case Style::kHeading:
    case Style::kSelected:
      return A_REVERSE;
    case Style::kDim:
      return A_DIM;
    case Style::kPlain:
    case Style::kGood:
      break;
  }
  return A_NORMAL;
}

/// What ncurses calls the key.
Key::Code CodeOf(int key) {
  switch (key) {
    case KEY_UP:
      return Key::Code::kUp;
    case KEY_DOWN:
      return Key::Code::kDown;
    case KEY_LEFT:
      return Key::Code::kLeft;
    case KEY_RIGHT:
      return Key::Code::kRight;
    case KEY_PPAGE:
      return Key::Code::kPageUp;
    case KEY_NPAGE:
      return Key::Code::kPageDown;
    case KEY_HOME:
      return Key::Code::kHome;
    case KEY_END:
      return Key::Code::kEnd;
    case KEY_ENTER:
    case '\n':
    case '\r':
      return Key::Code::kEnter;
    case KEY_BACKSPACE:
    case '\b':
    case 0x7f:
      return Key::Code::kBackspace;
    case 0x1b:
      return Key::Code::kEscape;
    case '\t':
      return Key::Code::kTab;
    default:
      return Key::Code::kOther;
  }
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
      attr_set(AttributesOf(span.style), colors_ ? PairOf(span.style) : short{0}, nullptr);
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
