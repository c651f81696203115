// morphbus draw: a robot as a picture, from its model or from a log.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "compiler/base/text.h"
#include "logger/log/log_bytes.h"
#include "logger/log/run_log.h"
#include "logger/show/drawing.h"
#include "logger/show/log_pictures.h"
#include "tools/base/lent_description.h"
#include "tools/base/work_progress.h"
#include "tools/commands/commands.h"
#include "tools/commands/draw_model.h"
#include "tools/commands/draw_video.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus draw`.
struct DrawOptions {
  ModelPicture model;  ///< Its file is the log's, too.
  std::string run;
  std::string description;
  std::string output;
  std::string picture;  ///< The output, too, where it is named without -o.
  std::vector<std::string> views;
  std::optional<double> at;  ///< Sim time of a log, seconds.
  int strip = 0;             ///< So many moments beside each other; 0: none.
  bool video = false;
  int fps = 0;               ///< Of a video; 0: the default.
  double from = 0.0;         ///< Sim times between which a strip or a video lies, seconds.
  std::optional<double> to;  ///< None: the log's end.
  int width = 0;  ///< Of each view, in units of an SVG; 0: as each kind of picture has it.
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

/// RenderPicture goes by the name as well.
OutputKind KindOf(const std::string& path) {
  if (const OutputKind* video = VideoKindOf(path)) return *video;
  return path.ends_with(".png") ? outputs::kPng : outputs::kSvg;
}

/// The scene of a model, a panel a view beside each other.
int DrawOfModel(const DrawOptions& options, const std::vector<logger::View>& views) {
  std::optional<logger::Drawing> drawing =
      DrawModel(options.model, options.output, KindOf(options.output), options.force);
  if (!drawing) return kUnusable;
  const logger::Scene scene = std::move(drawing->panels[0].scene);
  drawing->panels.clear();
  for (const logger::View view : views) drawing->panels.push_back({scene, view, ""});
  if (options.width > 0) drawing->panel_width_px = options.width;
  return WriteDrawing(*drawing, options.output);
}

/// Draws a log in motion, which is encoded as it is drawn.
int DrawInMotion(const DrawOptions& options, const std::vector<logger::View>& views,
                 const logger::LogPictures& pictures) {
  WorkProgress progress;
  constexpr int kDefaultFps = 10;
  const int fps = options.fps > 0 ? options.fps : kDefaultFps;
  const VideoOptions video = {fps, options.width, {options.from, options.to}, views};
  const Result<void> written = WriteVideo(
      pictures, video, options.output, [&](double share) { progress.Show(options.output, share); });
  return written ? kDone : Unusable(written.error().message);
}

/// Draws from a log: one moment, a strip of moments, or all as a moving picture.
int DrawLog(const DrawOptions& options, const std::vector<logger::View>& views) {
  // Whether the picture can be written is found out before the log is read, which takes longer.
  if (!MayWrite(options.output, KindOf(options.output), options.force, {options.model.file}))
    return kUnusable;
  if (options.video) {
    if (const Result<void> may = MayEncode(options.output); !may)
      return Unusable(may.error().message);
  }
  const Result<logger::RunLog> log =
      LoadLog(options.model.file, {options.run, true}, options.description);
  if (!log) return Unusable(log.error().message);
  const auto pictures = logger::LogPictures::Of(*log);
  if (!pictures) {
    const char* lend = log->robot == nullptr ? " (--description lends it one)" : "";
    return Unusable(options.model.file + ": " + pictures.error().message + lend);
  }
  if (options.video) return DrawInMotion(options, views, **pictures);
  Result<logger::Drawing> drawing =
      options.at ? (*pictures)->Moment(*options.at, views)
                 : (*pictures)->Strip(options.strip, {options.from, options.to}, views);
  if (!drawing) return Unusable(drawing.error().message);
  if (options.width > 0) drawing->panel_width_px = options.width;
  return WriteDrawing(*drawing, options.output);
}

/// Whether the options ask for something of a log.
bool OfLog(const DrawOptions& options) {
  return options.at.has_value() || options.strip > 0 || options.video;
}

/// What is wrong with the times; empty if nothing is.
std::string WhyNotTimes(const DrawOptions& options) {
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
  return "";
}

/// Which options of a model are given for a log; empty if none is.
std::string WhyNotOfLog(const ModelPicture& model) {
  if (!model.robot.empty()) {
    return "--robot chooses from a model; a log (--at, --strip, --video) holds one robot: leave "
           "--robot out";
  }
  if (!model.module.empty() || !model.program.empty() || !model.connection.empty() ||
      model.number > 0) {
    return "--module, --connection, --number and --program draw from a model; a log has a robot "
           "and roles of its own: leave them out";
  }
  if (!model.world.empty()) {
    return "--world stands beside a model's robot; a log has its own world: leave --world out";
  }
  return "";
}

/// Why the options do not go together for a picture of a model; empty if they do.
std::string WhyNotOfModel(const DrawOptions& options) {
  const ModelPicture& model = options.model;
  if (logger::BeginsAsLog(model.file)) {
    return model.file +
           " is a log: say with --at SECONDS which time of it to draw, or use --strip or --video";
  }
  // Each of these is another picture.
  const bool of_robot = !(model.robot.empty() && model.program.empty() && model.world.empty());
  const bool of_module = !model.module.empty();
  const bool of_connection = model.number > 0;
  if (int{of_robot} + int{of_module} + int{of_connection} > 1) {
    return "--robot (with --program or --world), --module and --number are three pictures: choose "
           "one of them";
  }
  if (!model.connection.empty() && !of_connection) {
    return "--connection " + model.connection +
           ": say with --number which of its ways to draw; morphbus connections lists them";
  }
  // What follows are options of a log.
  if (!options.run.empty()) {
    return "--run chooses from a log, and needs --at SECONDS, --strip or --video";
  }
  if (!options.description.empty()) {
    return "--description is for a log, and needs --at SECONDS, --strip or --video";
  }
  return "";
}

/// Why the picture's name does not do; empty if it does. The kind of picture is its name's, so that
/// name and --video must agree.
std::string WhyNotName(const DrawOptions& options) {
  const std::string& name = options.output;
  const bool video = VideoKindOf(name) != nullptr;
  if (options.video != video) {
    return name + (options.video ? ": a video's name ends in .mp4, .gif or .webp"
                                 : ": this is the name of a video: add --video");
  }
  const Result<void> picture = video ? Result<void>() : logger::CheckPictureName(name);
  return picture ? "" : picture.error().message;
}

/// Why the options do not go together; empty if they do.
std::string WhyNotTogether(const DrawOptions& options) {
  if (const std::string why = WhyNotTimes(options); !why.empty()) return why;
  // Without one of the three the file is a model.
  if ((options.at ? 1 : 0) + (options.strip > 0 ? 1 : 0) + (options.video ? 1 : 0) > 1) {
    return "--at, --strip and --video are three pictures: choose one of them";
  }
  if (const std::string why = WhyNotName(options); !why.empty()) return why;
  if (options.fps > 0 && !options.video) {
    return "--fps is of a video: add --video, or leave --fps out";
  }
  if ((options.from > 0 || options.to) && options.strip == 0 && !options.video) {
    return "--from and --to are of a strip or a video: add --strip or --video, or leave them out";
  }
  return OfLog(options) ? WhyNotOfLog(options.model) : WhyNotOfModel(options);
}

/// Checks the options and draws from the model or the log.
int Draw(DrawOptions options) {
  if (options.output.empty() == options.picture.empty()) {
    return Unusable(options.output.empty()
                        ? "which picture to write? -o FILE, or FILE as the second word"
                        : fmt::format("{} and -o {}: two names of one picture: leave one out",
                                      options.picture, options.output));
  }
  if (options.output.empty()) options.output = options.picture;
  const std::optional<std::vector<logger::View>> views = ParseViews(options.views);
  if (!views) return kUnusable;
  if (const std::string why = WhyNotTogether(options); !why.empty()) return Unusable(why);
  return OfLog(options) ? DrawLog(options, *views) : DrawOfModel(options, *views);
}

}  // namespace

void AddDraw(CommandLine* line) {
  Subcommand sub =
      line->Add("draw", "A picture: of a robot, a module type, a connection, or from a log");
  auto options = std::make_shared<DrawOptions>();
  options->views = {"side"};
  sub.Add("FILE", &options->model.file, "M3L file, or with --at, --strip or --video a log")
      .TypeName("FILE.m3l|LOG")
      .Required();
  sub.Add("PICTURE", &options->picture, "Picture to write, in the place of -o").TypeName("FILE");
  sub.Add("--robot", &options->model.robot, "A model's robot (default: the only one)")
      .TypeName("ROBOT");
  sub.Add("--program", &options->model.program,
          "Colour the robot's modules by the roles that they take in this program")
      .TypeName("PROG.dyn");
  sub.Add("--module", &options->model.module, "A module type of the model, with its connectors")
      .TypeName("TYPE");
  sub.Add("--connection", &options->model.connection,
          "With --number: which connection (default: the only one)")
      .TypeName("CONNECTION");
  sub.Add("--number", &options->model.number,
          "Two modules, mated in this of the numbered ways (morphbus connections)")
      .Range(1, 1'000'000);
  sub.Add("--world", &options->model.world, "SDFormat file of obstacles beside a model's robot")
      .TypeName("FILE");
  sub.Add("--at", &options->at, "Sim time of the log, seconds").Seconds();
  sub.Add("--strip", &options->strip, "So many moments of a log beside each other").Range(1, 100);
  sub.Flag("--video", &options->video, "A log in motion, as MP4, GIF or animated WebP");
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
  sub.Add("--width", &options->width,
          "Width of each view, in units of an SVG; a PNG has two pixels to each")
      .Range(100, 4000);
  sub.Add("-o,--output", &options->output,
          "Picture to write: .svg, .png, or for a video .mp4, .gif (both by ffmpeg) or .webp")
      .TypeName("FILE");
  sub.Force(&options->force);
  sub.Footer(
      "Examples:\n  morphbus draw models/mtran.m3l --robot quadruped --view iso -o quadruped.svg\n"
      "  morphbus draw models/mtran.m3l --robot quadruped --program models/programs/quadruped.dyn "
      "-o roles.svg\n"
      "  morphbus draw models/mtran.m3l --module MTRAN --view iso -o module.svg\n"
      "  morphbus draw models/mtran.m3l --number 12 --view iso -o mated.svg\n"
      "  morphbus draw walk.log --at 12.5 --view side,top -o walking.png\n"
      "  morphbus draw walk.log --strip 6 --from 9 --to 16 -o cycle.png\n"
      "  morphbus draw walk.log --video --view iso -o walk.webp\n"
      "  morphbus draw walk.log --video walk.mp4 --fps 30");
  sub.Do([options] { return Draw(*options); });
}

}  // namespace morphbus::tools
