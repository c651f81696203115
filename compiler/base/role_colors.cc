#include "compiler/base/role_colors.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>

namespace morphbus {
namespace {

/// Of modules without a role.
constexpr Color kNoRole = {0.72, 0.74, 0.78};

/// Relative luminance of an sRGB color, 0 to 1 (WCAG 2.2).
double Luminance(const Color& color) {
  // The inverse of sRGB's transfer function (IEC 61966-2-1).
  const auto linear = [](double c) {
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  };
  return 0.2126 * linear(color[0]) + 0.7152 * linear(color[1]) + 0.0722 * linear(color[2]);
}

/// FNV-1a with 32 bits (Fowler, Noll, Vo): the same on every machine.
uint32_t HashOf(const std::string& text) {
  uint32_t hash = 2166136261U;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  return hash;
}

}  // namespace

// The first nine are Tableau 10 (2016) without its grey; navy, lime and wine lie between them.
Color PaletteColor(int index) {
  static constexpr std::array<Color, kPaletteSize> kPalette = {{{0.30, 0.47, 0.66},
                                                                {0.95, 0.56, 0.17},
                                                                {0.88, 0.34, 0.35},
                                                                {0.46, 0.72, 0.70},
                                                                {0.35, 0.63, 0.31},
                                                                {0.93, 0.79, 0.28},
                                                                {0.69, 0.48, 0.63},
                                                                {1.00, 0.62, 0.65},
                                                                {0.61, 0.46, 0.37},
                                                                {0.18, 0.29, 0.49},
                                                                {0.71, 0.83, 0.33},
                                                                {0.56, 0.13, 0.32}}};
  Color color = kPalette[index % kPaletteSize];
  // The second and third round are darker: factors of 0.7 and 0.49 in sRGB's own values.
  for (int again = index / kPaletteSize % 3; again > 0; --again) {
    for (double& c : color) c *= 0.7;
  }
  return color;
}

std::vector<Color> PaletteColors(size_t count) {
  std::vector<Color> colors;
  for (size_t i = 0; i < count; ++i) colors.push_back(PaletteColor(static_cast<int>(i)));
  return colors;
}

std::string CssColor(const Color& color) {
  const auto byte = [](double c) { return static_cast<unsigned>(std::lround(c * 255)); };
  char text[16];
  std::snprintf(text, sizeof text, "#%02x%02x%02x", byte(color[0]), byte(color[1]), byte(color[2]));
  return text;
}

double Contrast(const Color& a, const Color& b) {
  const auto [low, high] = std::minmax({Luminance(a), Luminance(b)});
  // The 0.05 stand for light that the screen reflects (WCAG 2.2, "contrast ratio").
  return (high + 0.05) / (low + 0.05);
}

Color TextColorOn(const Color& ground) {
  constexpr Color kBlack = {0, 0, 0};
  constexpr Color kWhite = {1, 1, 1};
  return Contrast(kBlack, ground) > Contrast(kWhite, ground) ? kBlack : kWhite;
}

void RoleColors::Add(const std::vector<std::string>& roles) {
  // try_emplace leaves the entry of a role that has one.
  for (size_t i = 0; i < roles.size(); ++i) index_.try_emplace(roles[i], static_cast<int>(i));
}

Color RoleColors::Of(const std::string& role) const {
  // A module without a role is no role of its own, and has no color of the palette.
  if (role.empty()) return kNoRole;
  const auto found = index_.find(role);
  return PaletteColor(found != index_.end() ? found->second
                                            : static_cast<int>(HashOf(role) % kPaletteSize));
}

}  // namespace morphbus
