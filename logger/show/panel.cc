#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "logger/show/labels.h"
#include "logger/show/paint.h"
#include "logger/show/projection.h"

namespace morphbus::logger::paint {
namespace {

/// The size of a panel's title in pixels.
constexpr double kTitleSize = 12;

constexpr Theme kLight = {{1, 1, 1},
                          {0.975, 0.98, 0.985},
                          {0.13, 0.15, 0.19},
                          {0.80, 0.82, 0.86},
                          {0.93, 0.92, 0.89},
                          {0.45, 0.43, 0.38},
                          0.0};
constexpr Theme kDark = {{0.09, 0.11, 0.14},
                         {0.11, 0.13, 0.17},
                         {0.90, 0.91, 0.94},
                         {0.22, 0.25, 0.30},
                         {0.17, 0.17, 0.16},
                         {0.55, 0.53, 0.48},
                         0.45};

/// A line between two points of the page, in the present color and width.
void Line(cairo_t* cr, double x1, double y1, double x2, double y2) {
  cairo_move_to(cr, x1, y1);
  cairo_line_to(cr, x2, y2);
  cairo_stroke(cr);
}

/// The ground: an edge with a shaded strip below where it is seen edge on, else a grid of 100 mm.
void DrawGround(cairo_t* cr, const Projection& projection, const PanelMap& map) {
  cairo_set_line_width(cr, 1);
  if (projection.sees_ground_edge_on()) {
    SetColor(cr, map.theme->soil);
    cairo_rectangle(cr, map.x, map.V(0), map.width, map.y + map.height - map.V(0));
    cairo_fill(cr);
    SetColor(cr, map.theme->horizon);
    Line(cr, map.x, map.V(0), map.x + map.width, map.V(0));
    return;
  }
  // The grid has lines of constant north and of constant east; 40 of each to either side reach 4 m.
  constexpr double kGrid = 0.1;
  constexpr int kLines = 40;  // Enough for any panel; clipped to it.
  // The grid is centred on what is seen, on whole decimetres of the world.
  const Eigen::Vector2d seen = map.extent.center();
  const Eigen::Vector3d centre = projection.GroundPointAt(seen.x(), seen.y());
  const double x0 = std::round(centre.x() / kGrid) * kGrid;
  const double z0 = std::round(centre.z() / kGrid) * kGrid;
  SetColor(cr, map.theme->faint);
  // A line of the grid from one point of the ground to another, in metres of the world.
  const auto segment = [&](double xa, double za, double xb, double zb) {
    const Eigen::Vector3d a = projection.Project({xa, 0, za});
    const Eigen::Vector3d b = projection.Project({xb, 0, zb});
    Line(cr, map.U(a.x()), map.V(a.y()), map.U(b.x()), map.V(b.y()));
  };
  for (int i = -kLines; i <= kLines; ++i) {
    const double d = i * kGrid;
    segment(x0 + d, z0 - kLines * kGrid, x0 + d, z0 + kLines * kGrid);
    segment(x0 - kLines * kGrid, z0 + d, x0 + kLines * kGrid, z0 + d);
  }
}

/// Paints faces over each other in the order in which they come, with their edges in the faces' own
/// color, darkened.
void DrawFaces(cairo_t* cr, const std::vector<VisibleFace>& faces, const PanelMap& map) {
  cairo_set_line_join(cr, CAIRO_LINE_JOIN_ROUND);
  cairo_set_line_cap(cr, CAIRO_LINE_CAP_ROUND);
  for (const VisibleFace& face : faces) {
    // cairo_line_to begins a path where there is none.
    for (const Eigen::Vector2d& p : face.outline) cairo_line_to(cr, map.U(p.x()), map.V(p.y()));
    cairo_close_path(cr);
    SetColor(cr, face.color);
    cairo_fill_preserve(cr);
    // Faces of a curved surface reach over each other a little, or the ground shines through.
    cairo_set_line_width(cr, 0.4);
    cairo_stroke(cr);
    for (size_t i = 0; i < face.outline.size(); ++i) {
      if (!face.edges[i]) continue;
      const Eigen::Vector2d& next = face.outline[(i + 1) % face.outline.size()];
      cairo_move_to(cr, map.U(face.outline[i].x()), map.V(face.outline[i].y()));
      cairo_line_to(cr, map.U(next.x()), map.V(next.y()));
    }
    cairo_set_line_width(cr, 0.8);
    SetColor(cr, {face.color[0] * 0.45, face.color[1] * 0.45, face.color[2] * 0.45});
    cairo_stroke(cr);
  }
  cairo_set_line_cap(cr, CAIRO_LINE_CAP_BUTT);
}

/// A text in bold type with its middle at x, on the base line y, with a border in the color of the
/// panel, so that it is read on any color.
void TextWithHalo(cairo_t* cr, double x, double y, const std::string& text, double size,
                  double border, const Theme& theme) {
  const cairo_text_extents_t extents = Measure(cr, text, size, true);
  cairo_move_to(cr, x - extents.x_advance / 2, y);
  cairo_text_path(cr, text.c_str());
  SetColor(cr, theme.panel, 0.85);
  cairo_set_line_width(cr, border);
  cairo_stroke_preserve(cr);
  SetColor(cr, theme.ink);
  cairo_fill(cr);
}

/// Names in small type, with a halo so that they can be read on any color, and lines to the modules
/// on which there is no room.
void DrawNames(cairo_t* cr, const Scene& scene, const std::vector<VisibleFace>& faces,
               const Projection& projection, const PanelMap& map) {
  // The type's size is in pixels; labels are placed in metres of the picture plane.
  constexpr double kNameSize = 10;
  constexpr double kCellPx = 3;
  // Each name has the room of the one with the widest characters, so that none covers another.
  double character = 0.65 * kNameSize;
  for (const SceneName& name : scene.names) {
    const double width = Measure(cr, name.text, kNameSize, true).x_advance;
    character = std::max(character, width / static_cast<double>(name.text.size()));
  }
  const LabelPlane plane{map.extent.min(), map.extent.max(), kCellPx / map.scale,
                         character / map.scale, kNameSize / map.scale};
  const std::vector<PlacedLabel> labels = PlaceLabels(scene, faces, projection, plane);
  // Leader lines come first, so that no name is crossed by one.
  for (const PlacedLabel& label : labels) {
    if (!label.tip) continue;
    const double x = map.U(label.tip->x()), y = map.V(label.tip->y());
    SetColor(cr, map.theme->ink);
    cairo_set_line_width(cr, 0.8);
    Line(cr, map.U(label.centre.x()), map.V(label.centre.y()), x, y);
    cairo_arc(cr, x, y, 1.8, 0, 2 * EIGEN_PI);
    cairo_fill(cr);
  }
  // Each name is centred on its place, with a border in the color of the panel under the type.
  for (const PlacedLabel& label : labels) {
    const double height = Measure(cr, label.text, kNameSize, true).height;
    TextWithHalo(cr, map.U(label.centre.x()), map.V(label.centre.y()) + height / 2, label.text,
                 kNameSize, 3, *map.theme);
  }
}

/// Dashes from where something is to where it goes.
void DrawLines(cairo_t* cr, const Scene& scene, const Projection& projection, const PanelMap& map) {
  constexpr double kDash[] = {5, 4};
  cairo_set_dash(cr, kDash, 2, 0);
  cairo_set_line_width(cr, 1.6);
  for (const SceneLine& line : scene.lines) {
    const Eigen::Vector3d p = projection.Project(line.p_W), q = projection.Project(line.q_W);
    SetColor(cr, line.color);
    Line(cr, map.U(p.x()), map.V(p.y()), map.U(q.x()), map.V(q.y()));
  }
  cairo_set_dash(cr, nullptr, 0, 0);
}

/// Dots over everything, with their texts in white, or below them where these are wider; rings,
/// with texts in the color of the mark on the ground of the panel; and texts alone.
void DrawMarks(cairo_t* cr, const Scene& scene, const Projection& projection, const PanelMap& map) {
  constexpr double kRadius = 8;
  for (const SceneMark& mark : scene.marks) {
    const Eigen::Vector3d p = projection.Project(mark.p_W);
    const double x = map.U(p.x()), y = map.V(p.y());
    // The last mark's text has left a point, from which a line would lead here.
    cairo_new_path(cr);
    if (mark.kind == SceneMark::Kind::kText || mark.kind == SceneMark::Kind::kSmallText) {
      const double size = mark.kind == SceneMark::Kind::kText ? 10 : 6;
      TextWithHalo(cr, x, y + 0.35 * size, mark.text, size, 0.24 * size, *map.theme);
      continue;
    }
    const bool dot = mark.kind == SceneMark::Kind::kDot;
    const Color edge = dot ? Color{1, 1, 1} : mark.color;
    const bool holds_text = Measure(cr, mark.text, 10, true).x_advance < 2 * kRadius;
    cairo_arc(cr, x, y, holds_text ? kRadius : kRadius / 2, 0, 2 * EIGEN_PI);
    SetColor(cr, dot ? mark.color : map.theme->panel, dot ? 1 : 0.8);
    cairo_fill_preserve(cr);
    SetColor(cr, edge);
    cairo_set_line_width(cr, dot ? 1.2 : 1.8);
    cairo_stroke(cr);
    if (holds_text) {
      Text(cr, x, y + 3.5, mark.text, 10, Align::kCentre, true, edge);
    } else {
      TextWithHalo(cr, x, y + 16, mark.text, 10, 2.4, *map.theme);
    }
  }
}

/// A length of the 1-2-5 row that takes up to a fifth of the panel, with its name.
void DrawScaleBar(cairo_t* cr, const PanelMap& map) {
  // The largest length of 1, 2 or 5 times a power of ten that is short enough.
  const double wish = map.width / map.scale / 5;
  double length = std::pow(10.0, std::floor(std::log10(wish)));
  if (5 * length <= wish) {
    length *= 5;
  } else if (2 * length <= wish) {
    length *= 2;
  }
  const double right = map.x + map.width - 12;
  const double y = map.y + 16;
  const double left = right - length * map.scale;
  SetColor(cr, map.theme->ink);
  cairo_set_line_width(cr, 1.5);
  Line(cr, left, y, right, y);
  Line(cr, left, y - 3, left, y + 3);
  Line(cr, right, y - 3, right, y + 3);
  Text(cr, (left + right) / 2, y + 14, fmt::format("{:g} mm", length * 1000), 10, Align::kCentre,
       false, map.theme->ink);
}

/// Small arrows north, up and east at the panel's upper left.
void DrawCompass(cairo_t* cr, const Projection& projection, const PanelMap& map) {
  struct Arm {
    Eigen::Vector3d direction;
    const char* name;
    Color color;
  };
  const std::array<Arm, 3> arms = {{{Eigen::Vector3d::UnitX(), "N", {0.80, 0.22, 0.20}},
                                    {Eigen::Vector3d::UnitY(), "up", {0.20, 0.55, 0.25}},
                                    {Eigen::Vector3d::UnitZ(), "E", {0.20, 0.35, 0.75}}}};
  // In a narrow panel it is small, so that the robot stays free.
  const double arm_pixels = 24 * std::min(1.0, map.width / 400);
  const double cx = map.x + arm_pixels + 16, cy = map.y + arm_pixels + 16;
  // Arms keep their length in the world, so one that points at the viewer is short or left out.
  cairo_set_line_width(cr, 2);
  for (const Arm& arm : arms) {
    const Eigen::Vector3d d = projection.Direction(arm.direction);
    const double length = std::hypot(d.x(), d.y());
    if (length < 0.1) continue;  // Points at the viewer or away.
    const double x = cx + arm_pixels * d.x(), y = cy - arm_pixels * d.y();
    Color color = arm.color;
    for (double& c : color) c += (1 - c) * map.theme->lighten;
    SetColor(cr, color);
    Line(cr, cx, cy, x, y);
    const double name_pixels = arm_pixels + 9;
    Text(cr, cx + name_pixels * d.x(), cy - name_pixels * d.y() + 3.5, arm.name, 10, Align::kCentre,
         true, color);
  }
}

}  // namespace

const Theme& ThemeOf(const Drawing& drawing) { return drawing.dark ? kDark : kLight; }

void SetColor(cairo_t* cr, const Color& color, double alpha) {
  cairo_set_source_rgba(cr, color[0], color[1], color[2], alpha);
}

cairo_text_extents_t Measure(cairo_t* cr, const std::string& text, double size, bool bold) {
  cairo_select_font_face(cr, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(cr, size);
  cairo_text_extents_t extents;
  cairo_text_extents(cr, text.c_str(), &extents);
  return extents;
}

void Text(cairo_t* cr, double x, double y, const std::string& text, double size, Align align,
          bool bold, const Color& color) {
  const double width = Measure(cr, text, size, bold).x_advance;
  if (align == Align::kCentre) x -= width / 2;
  SetColor(cr, color);
  cairo_move_to(cr, x, y);
  cairo_show_text(cr, text.c_str());
}

void DrawPanel(cairo_t* cr, const Panel& panel, const PanelMap& map) {
  // What is drawn is clipped to the panel: ground, bodies and names in this order.
  const Projection projection(panel.view);
  cairo_save(cr);
  cairo_rectangle(cr, map.x, map.y, map.width, map.height);
  cairo_clip(cr);
  SetColor(cr, map.theme->panel);
  cairo_paint(cr);
  if (panel.scene.ground) DrawGround(cr, projection, map);
  const std::vector<VisibleFace> faces = VisibleFaces(panel.scene, projection);
  DrawFaces(cr, faces, map);
  DrawNames(cr, panel.scene, faces, projection, map);
  DrawLines(cr, panel.scene, projection, map);
  DrawMarks(cr, panel.scene, projection, map);
  if (panel.compass) DrawCompass(cr, projection, map);
  DrawScaleBar(cr, map);
  // The frame and the title belong to the page, not to the clipped panel.
  cairo_restore(cr);
  SetColor(cr, map.theme->faint);
  cairo_set_line_width(cr, 1);
  cairo_rectangle(cr, map.x + 0.5, map.y + 0.5, map.width - 1, map.height - 1);
  cairo_stroke(cr);
  Text(cr, map.x + 2, map.y - 7, panel.title, kTitleSize, Align::kLeft, true, map.theme->ink);
}

}  // namespace morphbus::logger::paint
