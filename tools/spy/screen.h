#pragma once
// A screen as text: what the spy draws, before any terminal knows of it.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace morphbus::tools {

/// What a piece of text is, which the terminal shows as it can: by colours, bold, inverse.
enum class Style : uint8_t { kPlain, kTitle, kHeading, kSelected, kDim, kGood, kBad, kKey };

/// A piece of a line, UTF-8, every character of which takes one cell.
struct Span {
  std::string text;
  Style style = Style::kPlain;
};
using ScreenLine = std::vector<Span>;
using Screen = std::vector<ScreenLine>;

/// Text from outside as it may be shown: what could steer a terminal is made visible
/// (EscapeControl), and characters of which terminals disagree how many cells they take, such as
/// Chinese or combining ones, become `?`.
std::string Visible(std::string_view text);

/// The cells that a text of Visible, or of ours, takes.
int Cells(std::string_view text);
/// The text in exactly `width` cells: cut, with `…` for the rest, or filled up with blanks, in
/// front of it if `right`.
std::string FitCells(std::string_view text, int width, bool right = false);
/// The same, but it is the end that is kept: `…_poses[0].position_m[2]`.
std::string FitEnd(std::string_view text, int width);
/// The text in lines of at most `width` cells, broken between words; a longer word has its own.
std::vector<std::string> Wrap(const std::string& text, int width);
/// The line cut to `width` cells and, if it is selected throughout, filled up to them.
ScreenLine FitLine(const ScreenLine& line, int width);

/// The lines without their styles, each with a line feed.
std::string PlainText(const Screen& screen);
/// For terminals that know only ASCII: `…` `µ` `×` `↑` `↓` and the bars of Sparkline and Meter have
/// replacements, other characters become `?`.
std::string ToAscii(std::string_view text);

/// The last `width` values as bars of eight heights, from their least to their greatest; values
/// that are not finite are blank, values that are all equal are low.
std::string Sparkline(const std::vector<double>& values, int width);
/// The same of values that are not negative, from 0 to their greatest; 0 is blank.
std::string SparklineFromZero(const std::vector<double>& values, int width);
/// A bar from the left that fills this share of `width` cells, to an eighth of a cell; 0 to 1.
std::string Meter(double share, int width);

/// Figures in few cells: 49.98, 1234, 12.3k.
std::string ShortRate(double hz);
/// 12µs, 3.45ms, 120ms, 7.1s.
std::string ShortTime(double seconds);
/// 310, 5.1k, 12.3M, of 1000 each.
std::string ShortBytes(double bytes);
/// 123456, 1.23M.
std::string ShortCount(int64_t count);

}  // namespace morphbus::tools
