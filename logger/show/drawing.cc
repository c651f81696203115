#include "logger/show/drawing.h"

#include <cairo-svg.h>
#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "compiler/model/convex_hull.h"
#include "logger/show/labels.h"
#include "logger/show/projection.h"

namespace morphbus::logger {
namespace {

/// Measures of the page in pixels: the border, heights of texts, and the size of normal type.
constexpr double kMargin = 16;
constexpr double kTitleHeight = 34;
constexpr double kPanelTitleHeight = 22;
constexpr double kLegendHeight = 24;
constexpr double kFontSize = 12;

/// The colors of everything but bodies.
struct Theme {
  Color page, panel;    ///< Grounds.
  Color ink, faint;     ///< Texts and lines, and what shall stay in the background.
  Color soil, horizon;  ///< The ground where it is seen edge on, and its edge.
  double lighten;       ///< How far the compass is moved towards white, so that it is read.
};
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

const Theme& ThemeOf(const Drawing& drawing) { return drawing.dark ? kDark : kLight; }

/// A box on the picture plane (m).
using Extent = Eigen::AlignedBox2d;

/// Maps the picture plane of one panel (metres, v up) to the page (pixels, y down). The middle of
/// the extent comes to the middle of the panel.
struct PanelMap {
  Extent extent;
  const Theme* theme = &kLight;
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

void SetColor(cairo_t* cr, const Color& c, double alpha = 1) {
  cairo_set_source_rgba(cr, c[0], c[1], c[2], alpha);
}

enum class Align { kLeft, kCentre };

/// Chooses the type, and measures a text in it (pixels).
cairo_text_extents_t Measure(cairo_t* cr, const std::string& text, double size, bool bold) {
  cairo_select_font_face(cr, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(cr, size);
  cairo_text_extents_t extents;
  cairo_text_extents(cr, text.c_str(), &extents);
  return extents;
}

/// Writes one line of text with its left end or middle at x, on the base line y
/// (pixels).
void Text(cairo_t* cr, double x, double y, const std::string& text, double size, Align align,
          bool bold, const Color& color) {
  const double width = Measure(cr, text, size, bold).x_advance;
  if (align == Align::kCentre) x -= width / 2;
  SetColor(cr, color);
  cairo_move_to(cr, x, y);
  cairo_show_text(cr, text.c_str());
}

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

/// Names in small type, with a halo so that they can be read on any color, and lines to the modules
/// on which there is no room.
void DrawNames(cairo_t* cr, const Scene& scene, const std::vector<VisibleFace>& faces,
               const Projection& projection, const PanelMap& map) {
  // The type's size is in pixels; labels are placed in metres of the picture plane.
  constexpr double kNameSize = 10;
  constexpr double kCellPx = 3;
  const LabelPlane plane{map.extent.min(), map.extent.max(), kCellPx / map.scale,
                         0.65 * kNameSize / map.scale, kNameSize / map.scale};
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
    const cairo_text_extents_t extents = Measure(cr, label.text, kNameSize, true);
    cairo_move_to(cr, map.U(label.centre.x()) - extents.x_advance / 2,
                  map.V(label.centre.y()) + extents.height / 2);
    cairo_text_path(cr, label.text.c_str());
    SetColor(cr, map.theme->panel, 0.85);
    cairo_set_line_width(cr, 3);
    cairo_stroke_preserve(cr);
    SetColor(cr, map.theme->ink);
    cairo_fill(cr);
  }
}

/// Dots over everything, with their texts in white.
void DrawMarks(cairo_t* cr, const Scene& scene, const Projection& projection, const PanelMap& map) {
  constexpr double kRadius = 8;
  for (const SceneMark& mark : scene.marks) {
    const Eigen::Vector3d p = projection.Project(mark.p_W);
    const double x = map.U(p.x()), y = map.V(p.y());
    cairo_new_path(
        cr);  // The last mark's text has left a point, from which a line would lead here.
    cairo_arc(cr, x, y, kRadius, 0, 2 * EIGEN_PI);
    SetColor(cr, mark.color);
    cairo_fill_preserve(cr);
    SetColor(cr, {1, 1, 1});
    cairo_set_line_width(cr, 1.2);
    cairo_stroke(cr);
    Text(cr, x, y + 3.5, mark.text, 10, Align::kCentre, true, {1, 1, 1});
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

/// One view of a scene: ground, robot, names, compass, scale bar and frame.
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
  DrawMarks(cr, panel.scene, projection, map);
  DrawCompass(cr, projection, map);
  DrawScaleBar(cr, map);
  // The frame and the title belong to the page, not to the clipped panel.
  cairo_restore(cr);
  SetColor(cr, map.theme->faint);
  cairo_set_line_width(cr, 1);
  cairo_rectangle(cr, map.x + 0.5, map.y + 0.5, map.width - 1, map.height - 1);
  cairo_stroke(cr);
  Text(cr, map.x + 2, map.y - 7, panel.title, kFontSize, Align::kLeft, true, map.theme->ink);
}

/// Where everything goes on the page, in pixels.
struct Layout {
  std::vector<PanelMap> maps;
  double width = 0, height = 0;
  double legend_y = 0;
};

/// One scale for all panels: the largest at which every panel is wide enough. Rows are as high as
/// their tallest panel.
Layout Arrange(const Drawing& drawing) {
  // The scale that every panel bears decides, so that lengths can be compared between panels.
  const size_t columns = std::max(1, drawing.columns);
  Layout layout;
  double scale = std::numeric_limits<double>::infinity();
  for (const Panel& panel : drawing.panels) {
    PanelMap map;
    map.theme = &ThemeOf(drawing);
    map.extent = panel.extent ? *panel.extent : ExtentOf(panel);
    // A panel is at most one and a half times as high as wide.
    const Eigen::Vector2d size = map.extent.sizes();
    scale = std::min(
        {scale, drawing.panel_width_px / size.x(), 1.5 * drawing.panel_width_px / size.y()});
    layout.maps.push_back(map);
  }
  // Rows below each other, panels beside each other.
  double y = kMargin + (drawing.title.empty() ? 0 : kTitleHeight);
  for (size_t row = 0; row * columns < layout.maps.size(); ++row) {
    const size_t begin = row * columns, end = std::min(begin + columns, layout.maps.size());
    // A row has at least this height, so that compass and scale bar fit into it.
    double height = 110;
    for (size_t i = begin; i < end; ++i) {
      height = std::max(height, layout.maps[i].extent.sizes().y() * scale);
    }
    y += kPanelTitleHeight;
    for (size_t i = begin; i < end; ++i) {
      PanelMap& map = layout.maps[i];
      map.scale = scale;
      map.x = kMargin + static_cast<double>(i - begin) * (drawing.panel_width_px + kMargin);
      map.y = y;
      map.width = drawing.panel_width_px;
      map.height = height;
    }
    y += height + kMargin;
  }
  const size_t used = std::min(columns, layout.maps.size());
  layout.width = kMargin + static_cast<double>(used) * (drawing.panel_width_px + kMargin);
  // The legend below, in as many rows as its entries need.
  layout.legend_y = y;
  if (!drawing.legend.empty()) {
    // An entry takes 190 pixels, in which the name of a role has room; DrawLegend counts alike.
    const double per_row = std::max(1.0, std::floor((layout.width - 2 * kMargin) / 190));
    y += kLegendHeight * std::ceil(static_cast<double>(drawing.legend.size()) / per_row);
  }
  layout.height = y + kMargin / 2;
  return layout;
}

/// One entry after another, as many in a row as Arrange() made room for.
void DrawLegend(cairo_t* cr, const Drawing& drawing, const Layout& layout) {
  const int per_row = std::max(1, static_cast<int>((layout.width - 2 * kMargin) / 190));
  for (size_t i = 0; i < drawing.legend.size(); ++i) {
    const double x = kMargin + 190.0 * static_cast<double>(static_cast<int>(i) % per_row);
    const double y = layout.legend_y + kLegendHeight * (static_cast<int>(i) / per_row);
    SetColor(cr, drawing.legend[i].color);
    cairo_rectangle(cr, x, y, 14, 14);
    cairo_fill(cr);
    Text(cr, x + 20, y + 11.5, drawing.legend[i].text, kFontSize, Align::kLeft, false,
         ThemeOf(drawing).ink);
  }
}

void DrawAll(cairo_t* cr, const Drawing& drawing, const Layout& layout) {
  SetColor(cr, ThemeOf(drawing).page);
  cairo_paint(cr);
  if (!drawing.title.empty()) {
    Text(cr, kMargin, kMargin + 18, drawing.title, 17, Align::kLeft, true, ThemeOf(drawing).ink);
  }
  for (size_t i = 0; i < drawing.panels.size(); ++i) {
    DrawPanel(cr, drawing.panels[i], layout.maps[i]);
  }
  DrawLegend(cr, drawing, layout);
}

/// Takes what cairo writes; `bytes` is a std::string.
cairo_status_t Append(void* bytes, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

/// Draws into `bytes`; returns cairo's verdict.
cairo_status_t Render(const Drawing& drawing, const Layout& layout, bool svg, std::string* bytes) {
  constexpr double kPixelRatio = 2;  // PNG: sharp on dense screens.
  const double ratio = svg ? 1 : kPixelRatio;
  // An SVG is written as it is drawn, a PNG at its end.
  cairo_surface_t* surface =
      svg ? cairo_svg_surface_create_for_stream(Append, bytes, layout.width, layout.height)
          : cairo_image_surface_create(CAIRO_FORMAT_RGB24,
                                       static_cast<int>(std::ceil(layout.width * ratio)),
                                       static_cast<int>(std::ceil(layout.height * ratio)));
  cairo_t* cr = cairo_create(surface);
  cairo_scale(cr, ratio, ratio);
  DrawAll(cr, drawing, layout);
  // The first error of any drawing call sticks to the context.
  cairo_status_t status = cairo_status(cr);
  cairo_destroy(cr);
  if (status == CAIRO_STATUS_SUCCESS && !svg) {
    status = cairo_surface_write_to_png_stream(surface, Append, bytes);
  }
  cairo_surface_finish(surface);
  if (status == CAIRO_STATUS_SUCCESS) status = cairo_surface_status(surface);
  cairo_surface_destroy(surface);
  return status;
}

}  // namespace

Eigen::AlignedBox2d ExtentOf(const Panel& panel) {
  const Projection projection(panel.view);
  Extent extent;
  for (const SceneHull& hull : panel.scene.hulls) {
    for (const Eigen::Vector3d& p_L : hull.points_L) {
      extent.extend(Eigen::Vector2d(projection.Project(hull.X_WL * p_L).head<2>()));
    }
  }
  // A panel without bodies shows a square of 20 cm.
  if (extent.isEmpty()) extent = {Eigen::Vector2d(-0.1, -0.1), Eigen::Vector2d(0.1, 0.1)};
  // A robot that hangs in the air is shown with the ground below it.
  if (panel.scene.ground && projection.sees_ground_edge_on()) {
    extent.extend(Eigen::Vector2d(extent.min().x(), 0));
  }
  // A margin of 6 % of the larger side, so that nothing touches the frame.
  const double pad = 0.06 * std::max(extent.sizes().maxCoeff(), 0.01);
  return {extent.min().array() - pad, extent.max().array() + pad};
}

Scene SceneOf(const model::Model& model, const model::Robot& robot,
              const std::vector<std::vector<model::Pose>>& X_WL, const std::vector<Color>& colors) {
  Scene scene;
  // A module's links, and its name in the middle of all their corners.
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const model::ModuleType& type = model.TypeOf(robot, static_cast<int>(m));
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int corners = 0;
    for (size_t l = 0; l < type.links.size(); ++l) {
      Color color = colors[m];
      // Every second link of a module is a little lighter, so that joints can be seen.
      if (l % 2 == 1) {
        for (double& c : color) c = 1 - (1 - c) * 0.72;
      }
      for (model::VisualPart& part : type.links[l].Looks()) {
        scene.hulls.push_back({std::move(part.points), X_WL[m][l], part.color.value_or(color),
                               static_cast<int>(m), std::move(part.triangles)});
      }
      for (const Eigen::Vector3d& p_L : type.links[l].hull) {
        sum += X_WL[m][l] * p_L;
        ++corners;
      }
    }
    if (corners > 0) {
      scene.names.push_back({robot.modules[m].name, sum / corners, static_cast<int>(m)});
    }
  }
  return scene;
}

Result<Raster> RenderRaster(const Drawing& drawing, double ratio) {
  if (drawing.panels.empty()) return Fail("there is nothing to draw");
  const Layout layout = Arrange(drawing);
  Raster raster;
  raster.width = static_cast<int>(std::ceil(layout.width * ratio));
  raster.height = static_cast<int>(std::ceil(layout.height * ratio));
  cairo_surface_t* surface =
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, raster.width, raster.height);
  cairo_t* cr = cairo_create(surface);
  cairo_scale(cr, ratio, ratio);
  DrawAll(cr, drawing, layout);
  const cairo_status_t status = cairo_status(cr);
  cairo_destroy(cr);
  // Cairo may draw late; after this the pixels are in memory.
  cairo_surface_flush(surface);
  if (status == CAIRO_STATUS_SUCCESS) {
    // Cairo has a pixel as one number, 0x00RRGGBB, in the machine's order.
    const unsigned char* rows = cairo_image_surface_get_data(surface);
    const int stride = cairo_image_surface_get_stride(surface);
    raster.rgba.reserve(static_cast<size_t>(raster.width) * static_cast<size_t>(raster.height) * 4);
    for (int y = 0; y < raster.height; ++y) {
      for (int x = 0; x < raster.width; ++x) {
        uint32_t pixel = 0;
        std::memcpy(&pixel, rows + ptrdiff_t{y} * stride + ptrdiff_t{x} * 4, sizeof pixel);
        for (const int shift : {16, 8, 0}) {
          raster.rgba.push_back(static_cast<uint8_t>(pixel >> shift));
        }
        raster.rgba.push_back(255);
      }
    }
  }
  cairo_surface_destroy(surface);
  if (status != CAIRO_STATUS_SUCCESS) {
    return Fail(fmt::format("cannot draw: {}", cairo_status_to_string(status)));
  }
  return raster;
}

Result<std::string> RenderPicture(const Drawing& drawing, const std::string& name) {
  // Only the suffix counts: the caller decides where the bytes go.
  const bool svg = name.ends_with(".svg");
  if (!svg && !name.ends_with(".png")) {
    return Fail(name + ": a picture's name ends in .svg or .png");
  }
  if (drawing.panels.empty()) return Fail(name + ": there is nothing to draw");
  std::string bytes;
  const cairo_status_t status = Render(drawing, Arrange(drawing), svg, &bytes);
  if (status != CAIRO_STATUS_SUCCESS) {
    return Fail(fmt::format("{}: cannot draw: {}", name, cairo_status_to_string(status)));
  }
  return bytes;
}

}  // namespace morphbus::logger
