#include "logger/show/moment_pictures.h"

#include <fmt/format.h>

#include "compiler/base/text.h"
#include "logger/show/svg_plot.h"

namespace morphbus::logger {

std::string MomentPicturesHtml(const RunLog& log, const SimulatedPoses& poses,
                               const RoleColors& colors, const std::vector<Moment>& moments,
                               double width_px) {
  std::vector<Panel> panels;
  std::vector<std::string> titles;
  Eigen::Vector2d size = Eigen::Vector2d::Zero();
  // The scene at each moment, and the largest extent among them.
  for (const Moment& moment : moments) {
    const size_t sample = WorldAt(log, moment.time_us);
    Panel panel{SceneAt(log, poses, sample, colors), View::kThreeQuarter, ""};
    panel.extent = ExtentOf(panel);
    size = size.cwiseMax(panel.extent->sizes());
    titles.push_back(fmt::format("{:.2f} s{}{}", Seconds(log.world[sample].time_us),
                                 moment.name.empty() ? "" : ": ", moment.name));
    panels.push_back(std::move(panel));
  }
  std::string html;
  for (size_t i = 0; i < panels.size(); ++i) {
    const Eigen::Vector2d middle = panels[i].extent->center();
    panels[i].extent = Eigen::AlignedBox2d(middle - size / 2, middle + size / 2);
    Drawing drawing;
    drawing.panels = {panels[i]};
    drawing.panel_width_px = width_px;
    html += fmt::format("<figure>{}<figcaption>{}</figcaption></figure>",
                        PictureHtml(drawing, titles[i]), EscapeHtml(titles[i]));
  }
  return html;
}

std::string StripHtml(const RunLog& log, int count, double width_px) {
  if (log.robot == nullptr || log.world.empty()) return "";
  std::vector<Moment> moments;
  const int64_t end_us = log.world.back().time_us;
  for (int i = 0; i < count; ++i) moments.push_back({end_us * i / (count - 1), ""});
  return MomentPicturesHtml(log, SimulatedPoses(log), ColorsOf({&log}), moments, width_px);
}

}  // namespace morphbus::logger
