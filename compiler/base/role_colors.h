#pragma once
// Which color stands for which role. Pictures, pages and what viewers are sent ask this one
// mapping, so that a role looks alike in all of them.

#include <array>
#include <map>
#include <string>
#include <vector>

namespace morphbus {

/// Red, green and blue of sRGB, each 0…1.
using Color = std::array<double, 3>;

/// The color of entry `index` (0 or more) of a legend: twelve well separable ones, which then begin
/// again, darker, and after 36 as they are. Modules by their index have these, too.
[[nodiscard]] Color PaletteColor(int index);
/// A color each for so many modules.
[[nodiscard]] std::vector<Color> PaletteColors(size_t count);
/// How many colors there are before they begin again.
inline constexpr int kPaletteSize = 12;

/// "#4d78a8": the color as style sheets, SVG and the monitor's messages have it.
[[nodiscard]] std::string CssColor(const Color& color);

/// Contrast of two colors, 1 to 21 (Web Content Accessibility Guidelines 2.2, "contrast ratio");
/// text wants 4.5.
[[nodiscard]] double Contrast(const Color& a, const Color& b);
/// Black or white, whichever is read better on that ground; never less than a contrast of 4.58.
[[nodiscard]] Color TextColorOn(const Color& ground);

/// Colors of roles, by name.
class RoleColors {
 public:
  /// Gives colors to the roles of a program that modules can play, in the program's order. A role
  /// that has one keeps it: of two programs that are compared the first decides.
  void Add(const std::vector<std::string>& roles);

  /// The color of a role; grey for the empty one, which stands for none. A role that no program
  /// named, such as one of a program deployed later, has a color of the palette that its name alone
  /// decides, everywhere the same, which may be another's, too.
  [[nodiscard]] Color Of(const std::string& role) const;

 private:
  std::map<std::string, int> index_;  ///< Into the palette.
};

}  // namespace morphbus
