#include "tools/spy/screen.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>
#include <sstream>

#include "compiler/base/text.h"
#include "compiler/base/utf8.h"

namespace morphbus::tools {
namespace {

// The bars of a sparkline, and what they become in ASCII.
constexpr std::array<const char*, 8> kBars = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
constexpr std::string_view kAsciiBars = "_.-=+*%#";
// The last cell of a meter, by eighths; a whole one is the highest bar above.
constexpr std::array<const char*, 7> kEighths = {"▏", "▎", "▍", "▌", "▋", "▊", "▉"};

/// The length of the character at `at`, in bytes.
size_t CharacterAt(std::string_view text, size_t at) {
  size_t end = at + 1;
  while (end < text.size() && ContinuesCharacter(text[end])) ++end;
  return end - at;
}

/// The last `width` values, a cell each; fewer if there are not so many.
std::span<const double> LastOf(const std::vector<double>& values, int width) {
  const size_t count = std::min(values.size(), static_cast<size_t>(std::max(0, width)));
  return std::span(values).last(count);
}

/// The bar of a value that is this share of the way from the lowest to the highest.
const char* BarOf(double share) {
  return kBars[static_cast<size_t>(std::clamp(share * 7.999, 0.0, 7.0))];
}

/// True for characters of one cell on every terminal: ASCII, Latin, Greek, Cyrillic.
bool IsNarrow(std::string_view character) {
  const auto first = static_cast<unsigned char>(character[0]);
  if (character.size() == 1) return true;
  if (character.size() != 2) return false;
  // Two bytes, U+0080 to U+07FF: without combining marks (U+0300 to U+036F), soft hyphens, and what
  // is written from right to left.
  const unsigned code = (first & 0x1FU) << 6U | (static_cast<unsigned char>(character[1]) & 0x3FU);
  return code != 0xAD &&
         (code < 0x300 || (code >= 0x370 && code < 0x483) || (code >= 0x48A && code < 0x530));
}

}  // namespace

std::string Visible(std::string_view text) {
  // What comes from the bus may hold anything: control characters would steer the terminal, wide
  // ones break the columns.
  const std::string escaped = EscapeControl(text);
  std::string out;
  for (size_t at = 0; at < escaped.size();) {
    const size_t length = CharacterAt(escaped, at);
    const std::string_view character = std::string_view(escaped).substr(at, length);
    out += IsNarrow(character) ? character : "?";
    at += length;
  }
  return out;
}

int Cells(std::string_view text) { return static_cast<int>(CountCharacters(text)); }

std::string FitCells(std::string_view text, int width, bool right) {
  if (width <= 0) return "";
  const int cells = Cells(text);
  const std::string blanks(static_cast<size_t>(std::max(0, width - cells)), ' ');
  // Numbers stand to the right, texts to the left.
  if (cells <= width) return right ? blanks + std::string(text) : std::string(text) + blanks;
  // Cut before the character that would stand where the mark does.
  size_t end = 0;
  for (int i = 0; i < width - 1; ++i) end += CharacterAt(text, end);
  return std::string(text.substr(0, end)) + "…";
}

std::string FitEnd(std::string_view text, int width) {
  const int cells = Cells(text);
  if (width <= 0 || cells <= width) return FitCells(text, width);
  size_t begin = 0;
  // The mark stands in for the characters that are dropped in front.
  for (int i = 0; i < cells - width + 1; ++i) begin += CharacterAt(text, begin);
  return "…" + std::string(text.substr(begin));
}

std::vector<std::string> Wrap(const std::string& text, int width) {
  std::istringstream words(text);
  std::vector<std::string> lines(1);
  for (std::string word; words >> word;) {
    std::string& line = lines.back();
    if (line.empty()) {
      line = word;
    } else if (Cells(line) + 1 + Cells(word) <= width) {
      line += " " + word;
    } else {
      lines.push_back(word);
    }
  }
  return lines;
}

ScreenLine FitLine(const ScreenLine& line, int width) {
  ScreenLine out;
  int left = width;
  for (const Span& span : line) {
    const int cells = Cells(span.text);
    if (left <= 0) break;
    out.push_back({cells <= left ? span.text : FitCells(span.text, left), span.style});
    left -= std::min(cells, left);
  }
  // A selected line is marked over its whole width.
  if (left > 0 && !line.empty() && line.back().style == Style::kSelected) {
    out.push_back({std::string(static_cast<size_t>(left), ' '), Style::kSelected});
  }
  return out;
}

std::string PlainText(const Screen& screen) {
  std::string out;
  for (const ScreenLine& line : screen) {
    const size_t begin = out.size();
    for (const Span& span : line) out += span.text;
    // Blanks at the end of a line are nobody's.
    const size_t last = out.find_last_not_of(' ');
    out.resize(last == std::string::npos || last < begin ? begin : last + 1);
    out += '\n';
  }
  return out;
}

std::string ToAscii(std::string_view text) {
  static const std::map<std::string_view, char> ascii = {
      {"…", '~'}, {"µ", 'u'}, {"×", 'x'}, {"↑", '^'}, {"↓", 'v'}};
  std::string out;
  for (size_t at = 0; at < text.size();) {
    const size_t length = CharacterAt(text, at);
    const std::string_view character = text.substr(at, length);
    const auto bar = std::find(kBars.begin(), kBars.end(), character);
    const auto eighth = std::find(kEighths.begin(), kEighths.end(), character);
    const auto other = ascii.find(character);
    // ASCII is itself, bars have their likes, all else is one of the few signs above.
    if (length == 1) {
      out += text[at];
    } else if (bar != kBars.end()) {
      out += kAsciiBars[static_cast<size_t>(bar - kBars.begin())];
    } else if (eighth != kEighths.end()) {
      out += eighth - kEighths.begin() < 3 ? '-' : '=';
    } else {
      out += other == ascii.end() ? '?' : other->second;
    }
    at += length;
  }
  return out;
}

std::string Sparkline(const std::vector<double>& values, int width) {
  const std::span<const double> shown = LastOf(values, width);
  double least = INFINITY;
  double most = -INFINITY;
  // The bars are between the least and the most of what is shown.
  for (const double value : shown) {
    if (!std::isfinite(value)) continue;
    least = std::min(least, value);
    most = std::max(most, value);
  }
  std::string out;
  // A value that is no number leaves a gap.
  for (const double value : shown) {
    if (!std::isfinite(value)) {
      out += ' ';
      continue;
    }
    // The range is halved, for the whole of it may not be a finite number.
    const double range = most / 2 - least / 2;
    out += BarOf(range > 0 ? (value / 2 - least / 2) / range : 0.0);
  }
  return out;
}

std::string SparklineFromZero(const std::vector<double>& values, int width) {
  const std::span<const double> shown = LastOf(values, width);
  const double most = shown.empty() ? 0.0 : *std::ranges::max_element(shown);
  std::string out;
  for (const double value : shown) out += value > 0 ? BarOf(value / most) : " ";
  return out;
}

std::string Meter(double share, int width) {
  const int eighths = static_cast<int>(std::lround(std::clamp(share, 0.0, 1.0) * 8 * width));
  std::string out;
  for (int i = 0; i < eighths / 8; ++i) out += kBars.back();
  if (eighths % 8 > 0) out += kEighths[static_cast<size_t>(eighths % 8 - 1)];
  return out;
}

std::string ShortRate(double hz) {
  if (hz <= 0) return "0";
  // The bounds lie where rounding would add a digit.
  if (hz < 99.995) return fmt::format("{:.2f}", hz);
  if (hz < 999.95) return fmt::format("{:.1f}", hz);
  return hz < 99999.5 ? fmt::format("{:.0f}", hz) : fmt::format("{:.0f}k", hz / 1e3);
}

std::string ShortTime(double seconds) {
  if (seconds < 0.9995e-3) return fmt::format("{:.0f}µs", seconds * 1e6);
  if (seconds < 9.995e-3) return fmt::format("{:.2f}ms", seconds * 1e3);
  if (seconds < 0.9995) return fmt::format("{:.0f}ms", seconds * 1e3);
  if (seconds < 99.95) return fmt::format("{:.1f}s", seconds);
  return seconds < 99999.5 ? fmt::format("{:.0f}s", seconds)
                           : fmt::format("{:.0f}h", seconds / 3600);
}

std::string ShortBytes(double bytes) {
  if (bytes < 999.5) return fmt::format("{:.0f}", bytes);
  if (bytes < 999.95e3) return fmt::format("{:.1f}k", bytes / 1e3);
  return bytes < 999.95e6 ? fmt::format("{:.1f}M", bytes / 1e6)
                          : fmt::format("{:.1f}G", bytes / 1e9);
}

std::string ShortCount(int64_t count) {
  if (count < 1'000'000) return std::to_string(count);
  const auto number = static_cast<double>(count);
  if (number < 9.995e9) return fmt::format("{:.{}f}M", number / 1e6, number < 99.95e6 ? 2 : 0);
  return number < 9.995e12 ? fmt::format("{:.0f}G", number / 1e9) : fmt::format("{:.0e}", number);
}

}  // namespace morphbus::tools
