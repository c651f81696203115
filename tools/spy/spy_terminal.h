#pragma once
// The terminal: draws screens and reads keys, by ncurses. Nothing else of the spy knows of it.

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "compiler/base/result.h"
#include "tools/spy/screen.h"
#include "tools/spy/spy_ui.h"

namespace morphbus::tools {

/// The terminal of standard input and output while it shows a screen of ours; the destructor gives
/// it back as it was. One at a time.
class SpyTerminal {
 public:
  /// Takes the terminal over. Colours only if it has them and the user has not asked for none
  /// (NO_COLOR); characters beyond ASCII only if the locale is UTF-8. Fails if the terminal cannot
  /// place text (TERM is unknown, or dumb).
  static Result<std::unique_ptr<SpyTerminal>> Open();
  ~SpyTerminal();
  SpyTerminal(const SpyTerminal&) = delete;
  SpyTerminal& operator=(const SpyTerminal&) = delete;

  /// Cells in a line, and lines.
  [[nodiscard]] std::pair<int, int> Size() const;
  /// Shows the screen; only what has changed is written.
  void Draw(const Screen& screen);
  /// The next key that was pressed, if there is one; never waits. kOther for what is no key of
  /// ours, such as a change of the window's size.
  std::optional<Key> ReadKey();

 private:
  explicit SpyTerminal(bool utf8) : utf8_(utf8) {}

  bool utf8_;
  bool colors_ = false;
};

/// True if standard input and output are a terminal that can show a screen (TERM is not dumb).
bool CanShowScreen();

}  // namespace morphbus::tools
