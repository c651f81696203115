// morphbus draw: a robot as a picture, from its model or from a log.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "compiler/base/text.h"
#include "logger/compare/kinematic_tracks.h"
#include "logger/log/log_bytes.h"
#include "logger/log/run_log.h"
#include "logger/show/animation.h"
#include "logger/show/drawing.h"
#include "logger/show/robot_scenes.h"
#include "sim/rigid_body_model.h"
#include "tools/base/lent_description.h"
#include "tools/base/work_progress.h"
#include "tools/base/world_file.h"
#include "tools/commands/commands.h"

namespace morphbus::tools {
namespace {

/// Far beyond any log, and its microseconds still fit an integer.
constexpr double kLongestLogSeconds = 1e9;

/// The options of `morphbus draw`.
struct DrawOptions {
  std::string file;
  std::string robot;
  std::string run;
  std::string description;
  std::string world;  ///< SDFormat file of obstacles beside a model's robot.
  std::string output;
  std::vector<std::string> views;
  std::optional<double> at;  ///< Sim time of a log, seconds.
  int strip = 0;             ///< So many moments beside each other; 0: none.
  bool video = false;
  int fps = 10;
  double from = 0.0;         ///< Sim times between which a strip or a video lies, seconds.
  std::optional<double> to;  ///< None: the log's end.
  bool force = false;
};

/// The views by their names; says which name is none.
std::optional<std::vector<logger::View>> ParseViews(const std::vector<std::string>& names) {
  const std::map<std::string, logger::View> known = {{"side", logger::View::kSide},
                                                     {"top", logger::View::kTop},
                                                     {"front", logger::View::kFront},
                                                     {"iso", logger::View::kThreeQuarter}};
  std::vector<logger::View> views;
  for (const std::string& name : names) {
    const auto found = known.find(name);
    if (found == known.end()) {
      return Refuse(fmt::format("--view {}: expected side, top, front or iso", name));
    }
    views.push_back(found->second);
  }
  return views;
}

/// Renders a picture and writes it.
int WriteDrawing(const logger::Drawing& drawing, const std::string& path) {
  const Result<std::string> picture = logger::RenderPicture(drawing, path);
  if (!picture) return Unusable(picture.error().message);
  const Result<void> written = WriteFile(path, *picture);
  return written ? kDone : Unusable(written.error().message);
}

/// One panel a view, beside each other, in one picture.
int Write(const logger::Scene& scene, const std::string& title,
          const std::vector<logger::View>& views, std::vector<logger::LegendEntry> legend,
          const std::string& path) {
  logger::Drawing drawing;
  drawing.title = title;
  drawing.legend = std::move(legend);
  for (const logger::View view : views) drawing.panels.push_back({scene, view, ""});
  return WriteDrawing(drawing, path);
}

/// RenderPicture goes by the name as well.
OutputKind KindOf(const std::string& path) {
  if (path.ends_with(".webp")) return outputs::kWebp;
  return path.ends_with(".png") ? outputs::kPng : outputs::kSvg;
}

/// The robot standing on the ground as it starts, each module in a colour of its own.
int DrawModel(const DrawOptions& options, const std::vector<logger::View>& views) {
  ModelSource source;
  const std::optional<model::Model> model = LoadModel({options.file}, &source);
  if (!model || !MayWrite(options.output, KindOf(options.output), options.force, source.Files()))
    return kUnusable;
  const model::Robot* robot = PickRobot(*model, options.robot);
  if (robot == nullptr) return kUnusable;
  // Each module has a colour of its own.
  std::vector<Color> colors(robot->modules.size());
  for (size_t m = 0; m < colors.size(); ++m) colors[m] = PaletteColor(static_cast<int>(m));
  // The robot stands where a run of it begins, half a millimetre above the ground.
  logger::Scene scene = logger::SceneOf(*model, *robot, sim::PlaceOnGround(*model, *robot), colors);
  if (!options.world.empty()) {
    const std::optional<LoadedWorld> world = LoadWorld(options.world);
    if (!world) return kUnusable;
    logger::AddObstacles(world->obstacles, &scene);
  }
  return Write(scene, robot->name, views, {}, options.output);
}

/// The part of a log that is drawn: its samples of WORLD from --from to --to.
struct Stretch {
  /// It stays where it is, for the poses refer to it.
  std::unique_ptr<const logger::RunLog> log;
  std::unique_ptr<const logger::SimulatedPoses> poses;
  RoleColors colors;
  int64_t begin_us = 0;
  int64_t end_us = 0;

  [[nodiscard]] logger::Scene SceneAt(int64_t time_us) const {
    return logger::SceneAt(*log, *poses, logger::WorldAt(*log, time_us), colors);
  }
};

/// Microseconds of a sim time on the command line; what lies beyond all logs is cut so that it fits
/// an integer.
int64_t TimeOf(double seconds) {
  return static_cast<int64_t>(std::llround(std::min(seconds, kLongestLogSeconds) * 1e6));
}

/// Loads the log; says why it cannot be drawn.
std::optional<Stretch> LoadStretch(const DrawOptions& options) {
  Result<logger::RunLog> log = LoadLog(options.file, {options.run, true}, options.description);
  if (!log) return Refuse(log.error().message);
  if (log->robot == nullptr) {
    return Refuse(options.file +
                  ": the log does not hold the robot's model (--description lends it one)");
  }
  if (log->world.empty()) return Refuse(options.file + ": the log holds no simulated poses");
  Stretch stretch;
  // SimulatedPoses refers to the log, which therefore must not move when the stretch does.
  stretch.log = std::make_unique<const logger::RunLog>(std::move(*log));
  stretch.poses = std::make_unique<const logger::SimulatedPoses>(*stretch.log);
  stretch.colors = logger::ColorsOf({stretch.log.get()});
  const int64_t last_us = stretch.log->world.back().time_us;
  // Cut to what the log holds, so that a range may be wider than it.
  stretch.begin_us = std::max(TimeOf(options.from), stretch.log->world.front().time_us);
  stretch.end_us = options.to ? std::min(TimeOf(*options.to), last_us) : last_us;
  if (stretch.begin_us > stretch.end_us) {
    return Refuse(
        fmt::format("--from {}: the log ends at {:.2f} s", options.from, Seconds(last_us)));
  }
  return stretch;
}

/// The robot as WORLD had it at or last before --at, modules coloured by role.
int DrawMoment(const DrawOptions& options, const std::vector<logger::View>& views) {
  const std::optional<Stretch> stretch = LoadStretch(options);
  if (!stretch) return kUnusable;
  const logger::RunLog& log = *stretch->log;
  const int64_t time_us = log.world[logger::WorldAt(log, TimeOf(*options.at))].time_us;
  const double shown_s = Seconds(time_us);
  // Up to a second beyond the end is the end: people round times.
  if (*options.at > shown_s + 1.0) {
    return Unusable(fmt::format("--at {}: the log ends at {:.2f} s", *options.at, shown_s));
  }
  // A role keeps its colour whatever modules play it.
  return Write(stretch->SceneAt(time_us), fmt::format("{} at {:.2f} s", log.robot->name, shown_s),
               views, logger::RoleLegend(stretch->colors, logger::RolesAt(log, time_us)),
               options.output);
}

/// Gives all panels the size of the largest, each with its own middle, so that they are of one
/// size.
void MakeAlike(std::vector<logger::Panel>* panels) {
  Eigen::Vector2d size = Eigen::Vector2d::Zero();
  for (logger::Panel& panel : *panels) {
    panel.extent = logger::ExtentOf(panel);
    size = size.cwiseMax(panel.extent->sizes());
  }
  for (logger::Panel& panel : *panels) {
    const Eigen::Vector2d middle = panel.extent->center();
    panel.extent = Eigen::AlignedBox2d(middle - size / 2, middle + size / 2);
  }
}

/// The robot at --strip moments, evenly spread, beside each other; a row for each view.
int DrawStrip(const DrawOptions& options, const std::vector<logger::View>& views) {
  const std::optional<Stretch> stretch = LoadStretch(options);
  if (!stretch) return kUnusable;
  logger::Drawing drawing;
  drawing.columns = options.strip;
  // The strip is some 1500 pixels wide, unless panels would be too small or too large to be looked
  // at.
  drawing.panel_width_px = std::clamp(1500.0 / options.strip, 180.0, 760.0);
  std::vector<std::string> roles;
  for (const logger::View view : views) {
    std::vector<logger::Panel> row;
    for (int i = 0; i < options.strip; ++i) {
      // The first moment is at the beginning and the last one at the end.
      const int64_t span = stretch->end_us - stretch->begin_us;
      const int64_t time_us = options.strip == 1
                                  ? stretch->begin_us
                                  : stretch->begin_us + span * i / (options.strip - 1);
      logger::Panel panel{stretch->SceneAt(time_us), view,
                          fmt::format("{:.2f} s", Seconds(time_us))};
      // Small panels have no room for names: the legend tells the roles.
      panel.scene.names.clear();
      row.push_back(std::move(panel));
      for (const std::string& role : logger::RolesAt(*stretch->log, time_us)) roles.push_back(role);
    }
    // Each row for itself: views of one robot differ in size.
    MakeAlike(&row);
    drawing.panels.insert(drawing.panels.end(), row.begin(), row.end());
  }
  drawing.title = stretch->log->robot->name;
  drawing.legend = logger::RoleLegend(stretch->colors, roles);
  return WriteDrawing(drawing, options.output);
}

/// The robot in motion, --fps pictures a second of sim time, as animated WebP. The camera goes with
/// the robot; the ground shows where it goes.
int DrawVideo(const DrawOptions& options, const std::vector<logger::View>& views,
              WorkProgress* progress) {
  const std::optional<Stretch> stretch = LoadStretch(options);
  if (!stretch) return kUnusable;
  // All frames first get their scenes, because the largest decides the size of all.
  std::vector<std::vector<logger::Panel>> rows(views.size());
  std::vector<int64_t> times;
  for (int64_t t = stretch->begin_us; t <= stretch->end_us;) {
    times.push_back(t);
    // Each from the beginning, so that fractions of a microsecond do not add up.
    t = stretch->begin_us + static_cast<int64_t>(times.size()) * 1'000'000 / options.fps;
  }
  for (size_t v = 0; v < views.size(); ++v) {
    for (const int64_t time_us : times) {
      logger::Panel panel{stretch->SceneAt(time_us), views[v], ""};
      panel.scene.names.clear();
      rows[v].push_back(std::move(panel));
    }
    MakeAlike(&rows[v]);
  }
  std::unique_ptr<logger::Animation> animation;
  for (size_t i = 0; i < times.size(); ++i) {
    progress->Show(options.output, static_cast<double>(i) / static_cast<double>(times.size()));
    logger::Drawing drawing;
    drawing.panel_width_px = 640;
    drawing.columns = static_cast<int>(views.size());
    drawing.title = fmt::format("{}, {:.2f} s", stretch->log->robot->name, Seconds(times[i]));
    for (auto& row : rows) drawing.panels.push_back(row[i]);
    // The same roles in all frames, so that these are of one size.
    drawing.legend = logger::RoleLegend(stretch->colors, logger::RolesIn(*stretch->log));
    const Result<logger::Raster> frame = logger::RenderRaster(drawing, 1.0);
    if (!frame) return Unusable(frame.error().message);
    // The size is known once the first frame is drawn.
    if (!animation) {
      auto created = logger::Animation::Create(frame->width, frame->height);
      if (!created) return Unusable(created.error().message);
      animation = std::move(*created);
    }
    // WebP counts in whole milliseconds, of which some frames get one more than others.
    const auto begin_ms = [&](size_t n) { return static_cast<int>(n * 1000 / options.fps); };
    const Result<void> added = animation->Add(*frame, begin_ms(i + 1) - begin_ms(i));
    if (!added) return Unusable(added.error().message);
  }
  const Result<std::string> bytes = animation->Finish();
  if (!bytes) return Unusable(bytes.error().message);
  const Result<void> written = WriteFile(options.output, *bytes);
  return written ? kDone : Unusable(written.error().message);
}

/// Draws from a log: one moment, a strip of moments, or all as a moving picture.
int DrawLog(const DrawOptions& options, const std::vector<logger::View>& views) {
  WorkProgress progress;
  // Whether the picture can be written is found out before the log is read, which takes longer.
  if (!MayWrite(options.output, KindOf(options.output), options.force, {options.file}))
    return kUnusable;
  if (options.at) return DrawMoment(options, views);
  return options.video ? DrawVideo(options, views, &progress) : DrawStrip(options, views);
}

/// Whether the options ask for something of a log.
bool OfLog(const DrawOptions& options) {
  return options.at.has_value() || options.strip > 0 || options.video;
}

/// Why the options do not go together; empty if they do.
std::string WhyNotTogether(const DrawOptions& options) {
  if (options.at && !(std::isfinite(*options.at) && *options.at >= 0)) {
    return fmt::format("--at {}: expected a sim time, 0 s or later", *options.at);
  }
  // Without --to its check is that of --from, which passes twice or fails once.
  for (const auto& [name, time_s] :
       {std::pair("--from", options.from), std::pair("--to", options.to.value_or(options.from))}) {
    if (!(time_s >= 0 && std::isfinite(time_s))) {
      return fmt::format("{} {}: expected a sim time, 0 s or later", name, time_s);
    }
  }
  if (options.to && *options.to < options.from) {
    return fmt::format("--from {} --to {}: --to must be the later time", options.from, *options.to);
  }
  // Without one of the three the file is a model.
  if ((options.at ? 1 : 0) + (options.strip > 0 ? 1 : 0) + (options.video ? 1 : 0) > 1) {
    return "--at, --strip and --video are three pictures: choose one of them";
  }
  // The kind of picture is its name's, so that name and --video must agree.
  const bool webp = options.output.ends_with(".webp");
  if (options.video != webp) {
    return options.video ? options.output + ": a video's name ends in .webp"
                         : options.output + ": WebP is for videos: add --video";
  }
  // What follows are options of a log given for a model, and of a model given for a log.
  if (!OfLog(options) && logger::BeginsAsLog(options.file)) {
    return options.file +
           " is a log: say with --at SECONDS which time of it to draw, or use --strip or --video";
  }
  if (OfLog(options) && !options.robot.empty()) {
    return "--robot chooses from a model; a log (--at, --strip, --video) holds one robot: leave "
           "--robot out";
  }
  if (!OfLog(options) && !options.run.empty()) {
    return "--run chooses from a log, and needs --at SECONDS, --strip or --video";
  }
  if (OfLog(options) && !options.world.empty()) {
    return "--world stands beside a model's robot; a log has its own world: leave --world out";
  }
  if (!OfLog(options) && !options.description.empty()) {
    return "--description is for a log, and needs --at SECONDS, --strip or --video";
  }
  return "";
}

/// Checks the options and draws from the model or the log.
int Draw(const DrawOptions& options) {
  const std::optional<std::vector<logger::View>> views = ParseViews(options.views);
  if (!views) return kUnusable;
  if (const std::string why = WhyNotTogether(options); !why.empty()) return Unusable(why);
  return OfLog(options) ? DrawLog(options, *views) : DrawModel(options, *views);
}

}  // namespace

void AddDraw(CommandLine* line) {
  Subcommand sub = line->Add("draw", "A picture of a robot: at its start values, or from a log");
  auto options = std::make_shared<DrawOptions>();
  options->views = {"side"};
  sub.Add("FILE", &options->file, "M3L file, or with --at, --strip or --video a log")
      .TypeName("FILE.m3l|LOG")
      .Required();
  sub.Add("--robot", &options->robot, "A model's robot (default: the only one)").TypeName("ROBOT");
  sub.Add("--world", &options->world, "SDFormat file of obstacles beside a model's robot")
      .TypeName("FILE");
  sub.Add("--at", &options->at, "Sim time of the log, seconds").Seconds();
  sub.Add("--strip", &options->strip, "So many moments of a log beside each other").Range(1, 100);
  sub.Flag("--video", &options->video, "A log in motion, as animated WebP");
  sub.Add("--fps", &options->fps, "Pictures of a video a second of sim time (default: 10)")
      .Range(1, 50);
  sub.Add("--from", &options->from, "Sim time at which a strip or a video begins, seconds")
      .Seconds();
  sub.Add("--to", &options->to, "Sim time at which it ends, seconds").Seconds();
  sub.Add("--run", &options->run, "Which run, if the log holds several (default: the first)")
      .TypeName("NAME");
  sub.Description(&options->description);
  sub.Add("--view", &options->views, "side, top, front, iso; several: side,top")
      .TypeName("side|top|front|iso")
      .Separator(',');
  sub.Add("-o,--output", &options->output, "Picture to write: .svg, .png, or .webp for a video")
      .TypeName("FILE")
      .Required();
  sub.Force(&options->force);
  sub.Footer(
      "Examples:\n  morphbus draw models/mtran.m3l --robot quadruped --view iso -o quadruped.svg\n"
      "  morphbus draw walk.log --at 12.5 --view side,top -o walking.png\n"
      "  morphbus draw walk.log --strip 6 --from 9 --to 16 -o cycle.png\n"
      "  morphbus draw walk.log --video --view iso -o walk.webp");
  sub.Do([options] { return Draw(*options); });
}

}  // namespace morphbus::tools
