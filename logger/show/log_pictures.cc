#include "logger/show/log_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "compiler/base/text.h"
#include "logger/show/animation.h"
#include "logger/show/robot_scenes.h"

namespace morphbus::logger {
namespace {

/// Far beyond any log, and its microseconds still fit an integer.
constexpr double kLongestLogSeconds = 1e9;

/// Microseconds of a sim time that a person gave; what lies beyond all logs is cut.
int64_t TimeOf(double seconds) {
  return static_cast<int64_t>(std::llround(std::min(seconds, kLongestLogSeconds) * 1e6));
}

/// The part of a picture plane about `middle`, (u, v) in metres.
Eigen::AlignedBox2d BoxAbout(const Eigen::Vector2d& middle, const Eigen::Vector2d& size) {
  return {middle - size / 2, middle + size / 2};
}

/// Gives all panels the size of the largest, each with its own middle, so that they are of one
/// size.
void MakeAlike(std::vector<Panel>* panels) {
  Eigen::Vector2d size = Eigen::Vector2d::Zero();
  for (Panel& panel : *panels) {
    panel.extent = ExtentOf(panel);
    size = size.cwiseMax(panel.extent->sizes());
  }
  for (Panel& panel : *panels) panel.extent = BoxAbout(panel.extent->center(), size);
}

}  // namespace

LogPictures::LogPictures(const RunLog& log) : log_(log), poses_(log), colors_(ColorsOf({&log})) {}

Result<std::unique_ptr<LogPictures>> LogPictures::Of(const RunLog& log) {
  if (log.robot == nullptr) return Fail("the log does not hold the robot's model");
  if (log.world.empty()) return Fail("the log holds no simulated poses");
  return std::unique_ptr<LogPictures>(new LogPictures(log));
}

Result<std::pair<int64_t, int64_t>> LogPictures::Stretch(const PictureTimes& times) const {
  const int64_t last_us = log_.world.back().time_us;
  const int64_t begin_us = std::max(TimeOf(times.from_s), log_.world.front().time_us);
  const int64_t end_us = times.to_s ? std::min(TimeOf(*times.to_s), last_us) : last_us;
  if (begin_us > end_us) {
    return Fail(
        fmt::format("the log ends at {:.2f} s, before {} s", Seconds(last_us), times.from_s));
  }
  return std::pair(begin_us, end_us);
}

Scene LogPictures::SceneOf(int64_t time_us, bool names) const {
  Scene scene = SceneAt(log_, poses_, WorldAt(log_, time_us), colors_);
  if (!names) scene.names.clear();
  return scene;
}

Result<Drawing> LogPictures::Moment(double at_s, const std::vector<View>& views) const {
  const int64_t time_us = log_.world[WorldAt(log_, TimeOf(at_s))].time_us;
  const double shown_s = Seconds(time_us);
  if (at_s > shown_s + 1.0) {
    return Fail(fmt::format("the log ends at {:.2f} s, before {} s", shown_s, at_s));
  }
  Drawing drawing;
  drawing.title = fmt::format("{} at {:.2f} s", log_.robot->name, shown_s);
  // A role keeps its colour whatever modules play it.
  drawing.legend = RoleLegend(colors_, RolesAt(log_, time_us));
  for (const View view : views) drawing.panels.push_back({SceneOf(time_us, true), view, ""});
  return drawing;
}

Result<Drawing> LogPictures::Strip(int count, const PictureTimes& times,
                                   const std::vector<View>& views) const {
  const Result<std::pair<int64_t, int64_t>> stretch = Stretch(times);
  if (!stretch) return Fail(stretch.error().message);
  const auto [begin_us, end_us] = *stretch;
  Drawing drawing;
  drawing.columns = count;
  // The strip is some 1500 pixels wide, unless panels would be too small or too large to be looked
  // at.
  drawing.panel_width_px = std::clamp(1500.0 / count, 180.0, 760.0);
  std::vector<std::string> roles;
  for (const View view : views) {
    std::vector<Panel> row;
    for (int i = 0; i < count; ++i) {
      // The first moment is at the beginning and the last one at the end.
      const int64_t time_us =
          count == 1 ? begin_us : begin_us + (end_us - begin_us) * i / (count - 1);
      // Small panels have no room for names: the legend tells the roles.
      row.push_back({SceneOf(time_us, false), view, fmt::format("{:.2f} s", Seconds(time_us))});
      for (const std::string& role : RolesAt(log_, time_us)) roles.push_back(role);
    }
    // Each row for itself: views of one robot differ in size.
    MakeAlike(&row);
    drawing.panels.insert(drawing.panels.end(), row.begin(), row.end());
  }
  drawing.title = log_.robot->name;
  drawing.legend = RoleLegend(colors_, roles);
  return drawing;
}

Result<void> LogPictures::Frames(int fps, int width_px, const PictureTimes& times,
                                 const std::vector<View>& views, const FrameTaker& take,
                                 const std::function<void(double)>& progress) const {
  const Result<std::pair<int64_t, int64_t>> stretch = Stretch(times);
  if (!stretch) return Fail(stretch.error().message);
  std::vector<int64_t> moments;
  for (int64_t t = stretch->first; t <= stretch->second;) {
    moments.push_back(t);
    // Each from the beginning, so that fractions of a microsecond do not add up.
    t = stretch->first + static_cast<int64_t>(moments.size()) * 1'000'000 / fps;
  }
  // The largest frame decides the size of all. Scenes are made anew when they are drawn: those of a
  // long log would fill the memory.
  std::vector<Eigen::Vector2d> sizes(views.size(), Eigen::Vector2d::Zero());
  for (const int64_t time_us : moments) {
    Panel panel = {SceneOf(time_us, false), View::kSide, ""};
    for (size_t v = 0; v < views.size(); ++v) {
      panel.view = views[v];
      sizes[v] = sizes[v].cwiseMax(ExtentOf(panel).sizes());
    }
  }
  for (size_t i = 0; i < moments.size(); ++i) {
    if (progress) progress(static_cast<double>(i) / static_cast<double>(moments.size()));
    Drawing drawing;
    drawing.panel_width_px = width_px > 0 ? width_px : 640;
    drawing.columns = static_cast<int>(views.size());
    drawing.title = fmt::format("{}, {:.2f} s", log_.robot->name, Seconds(moments[i]));
    const Scene scene = SceneOf(moments[i], false);
    for (size_t v = 0; v < views.size(); ++v) {
      Panel panel = {scene, views[v], ""};
      panel.extent = BoxAbout(ExtentOf(panel).center(), sizes[v]);
      drawing.panels.push_back(std::move(panel));
    }
    // The same roles in all frames, so that these are of one size.
    drawing.legend = RoleLegend(colors_, RolesIn(log_));
    const Result<Raster> frame = RenderRaster(drawing, 1.0);
    if (!frame) return Fail(frame.error().message);
    // Files count in whole milliseconds, of which some frames get one more than others.
    const auto begin_ms = [&](size_t n) {
      return static_cast<int>(n * 1000 / static_cast<size_t>(fps));
    };
    if (Result<void> taken = take(*frame, begin_ms(i + 1) - begin_ms(i)); !taken) return taken;
  }
  return {};
}

Result<std::string> LogPictures::Video(int fps, int width_px, const PictureTimes& times,
                                       const std::vector<View>& views,
                                       const std::function<void(double)>& progress) const {
  std::unique_ptr<Animation> animation;
  const FrameTaker add = [&](const Raster& frame, int milliseconds) -> Result<void> {
    // The size is known once the first frame is drawn.
    if (!animation) {
      auto created = Animation::Create(frame.width, frame.height);
      if (!created) return Fail(created.error().message);
      animation = std::move(*created);
    }
    return animation->Add(frame, milliseconds);
  };
  const Result<void> drawn = Frames(fps, width_px, times, views, add, progress);
  if (!drawn) return Fail(drawn.error().message);
  return animation->Finish();
}

}  // namespace morphbus::logger
