#pragma once
// What paints onto a cairo context: texts, one panel of a picture, a whole drawing. For pictures
// (drawing.cc) and for pages that have several (sheet_pdf.cc).

#include <cairo.h>

#include <Eigen/Geometry>
#include <string>

#include "logger/show/drawing.h"

namespace morphbus::logger::paint {

/// The size of normal type in pixels.
inline constexpr double kFontSize = 12;

/// The colors of everything but bodies.
struct Theme {
  Color page, panel;    ///< Grounds.
  Color ink, faint;     ///< Texts and lines, and what shall stay in the background.
  Color soil, horizon;  ///< The ground where it is seen edge on, and its edge.
  double lighten;       ///< How far the compass is moved towards white, so that it is read.
};
/// The theme of a drawing, light or dark.
const Theme& ThemeOf(const Drawing& drawing);

/// Maps the picture plane of one panel (metres, v up) to the page (pixels, y down). The middle of
/// the extent comes to the middle of the panel.
struct PanelMap {
  Eigen::AlignedBox2d extent;
  const Theme* theme = nullptr;
  double scale = 1;  ///< Pixels a metre.
  // These are the panel's rectangle on the page.
  double x = 0, y = 0, width = 0, height = 0;

  [[nodiscard]] double U(double u) const {
    return x + width / 2 + (u - extent.center().x()) * scale;
  }
  [[nodiscard]] double V(double v) const {
    return y + height / 2 - (v - extent.center().y()) * scale;
  }
};

void SetColor(cairo_t* cr, const Color& color, double alpha = 1);

enum class Align { kLeft, kCentre };

/// Chooses the type, sans-serif, and measures a text in it (in the context's units).
cairo_text_extents_t Measure(cairo_t* cr, const std::string& text, double size, bool bold);

/// Writes one line of text with its left end or middle at x, on the base line y.
void Text(cairo_t* cr, double x, double y, const std::string& text, double size, Align align,
          bool bold, const Color& color);

/// One view of a scene: ground, robot, lines, names, marks, compass, scale bar, frame and title.
void DrawPanel(cairo_t* cr, const Panel& panel, const PanelMap& map);

/// How large a drawing is, in its own units: width and height.
Eigen::Vector2d SizeOf(const Drawing& drawing);
/// Paints all of it, from the context's origin on.
void PaintDrawing(cairo_t* cr, const Drawing& drawing);

}  // namespace morphbus::logger::paint
