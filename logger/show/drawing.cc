#include "logger/show/drawing.h"

#include <cairo-svg.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "logger/show/paint.h"
#include "logger/show/projection.h"

namespace morphbus::logger {
namespace {

/// Measures of the page in pixels: the border, and heights of texts.
constexpr double kMargin = 16;
constexpr double kTitleHeight = 34;
constexpr double kPanelTitleHeight = 22;
constexpr double kLegendHeight = 24;

/// Where everything goes on the page, in pixels.
struct Layout {
  std::vector<paint::PanelMap> maps;
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
    paint::PanelMap map;
    map.theme = &paint::ThemeOf(drawing);
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
      paint::PanelMap& map = layout.maps[i];
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
    paint::SetColor(cr, drawing.legend[i].color);
    cairo_rectangle(cr, x, y, 14, 14);
    cairo_fill(cr);
    paint::Text(cr, x + 20, y + 11.5, drawing.legend[i].text, paint::kFontSize, paint::Align::kLeft,
                false, paint::ThemeOf(drawing).ink);
  }
}

/// All of it but the ground of the page.
void DrawParts(cairo_t* cr, const Drawing& drawing, const Layout& layout) {
  const Color& ink = paint::ThemeOf(drawing).ink;
  if (!drawing.title.empty()) {
    paint::Text(cr, kMargin, kMargin + 18, drawing.title, 17, paint::Align::kLeft, true, ink);
  }
  for (size_t i = 0; i < drawing.panels.size(); ++i) {
    paint::DrawPanel(cr, drawing.panels[i], layout.maps[i]);
  }
  DrawLegend(cr, drawing, layout);
}

/// The same on a page that has nothing else.
void DrawAll(cairo_t* cr, const Drawing& drawing, const Layout& layout) {
  paint::SetColor(cr, paint::ThemeOf(drawing).page);
  cairo_paint(cr);
  DrawParts(cr, drawing, layout);
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

Eigen::Vector2d paint::SizeOf(const Drawing& drawing) {
  const Layout layout = Arrange(drawing);
  return {layout.width, layout.height};
}

void paint::PaintDrawing(cairo_t* cr, const Drawing& drawing) {
  DrawParts(cr, drawing, Arrange(drawing));
}

Eigen::AlignedBox2d ExtentOf(const Panel& panel) {
  const Projection projection(panel.view);
  Eigen::AlignedBox2d extent;
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

Result<void> CheckPictureName(const std::string& name) {
  if (name.ends_with(".svg") || name.ends_with(".png")) return {};
  return Fail(name + ": a picture's name ends in .svg or .png");
}

Result<std::string> RenderPicture(const Drawing& drawing, const std::string& name) {
  if (Result<void> named = CheckPictureName(name); !named) return Fail(named.error().message);
  // Only the suffix counts: the caller decides where the bytes go.
  const bool svg = name.ends_with(".svg");
  if (drawing.panels.empty()) return Fail(name + ": there is nothing to draw");
  std::string bytes;
  const cairo_status_t status = Render(drawing, Arrange(drawing), svg, &bytes);
  if (status != CAIRO_STATUS_SUCCESS) {
    return Fail(fmt::format("{}: cannot draw: {}", name, cairo_status_to_string(status)));
  }
  return bytes;
}

}  // namespace morphbus::logger
