// morphbus draw: a robot as a picture, from its model or from a log.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include "logger/compare/kinematic_tracks.h"
#include "logger/log/event_log.h"
#include "logger/log/run_log.h"
#include "logger/show/drawing.h"
#include "sim/rigid_body_model.h"
#include "tools/commands/commands.h"

namespace morphbus::tools {
namespace {

/// Poses of all links by module and link.
using LinkPoses = std::vector<std::vector<model::Pose>>;

/// Far beyond any log, and its microseconds still fit an integer.
constexpr double kLongestLogSeconds = 1e9;

/// The options of `morphbus draw`.
struct DrawOptions {
  std::string file;
  std::string robot;
  std::string run;
  std::string output;
  std::vector<std::string> views;
  std::optional<double> at;  ///< Sim time of a log, seconds.
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

/// One panel a view, beside each other, in one picture.
int Write(const logger::Scene& scene, const std::string& title,
          const std::vector<logger::View>& views, std::vector<logger::LegendEntry> legend,
          const std::string& path) {
  logger::Drawing drawing;
  drawing.title = title;
  drawing.legend = std::move(legend);
  for (const logger::View view : views) drawing.panels.push_back({scene, view, ""});
  const Result<std::string> picture = logger::RenderPicture(drawing, path);
  if (!picture) return Unusable(picture.error().message);
  const Result<void> written = WriteFile(path, *picture);
  return written ? kDone : Unusable(written.error().message);
}

/// RenderPicture goes by the name as well.
OutputKind KindOf(const std::string& path) {
  return path.ends_with(".png") ? outputs::kPng : outputs::kSvg;
}

/// The robot standing on the ground as it starts, each module in a colour of its own.
int DrawModel(const DrawOptions& options, const std::vector<logger::View>& views) {
  std::vector<std::string> files;
  const std::optional<model::Model> model = LoadModel({options.file}, &files);
  if (!model || !MayWrite(options.output, KindOf(options.output), options.force, files))
    return kUnusable;
  const model::Robot* robot = PickRobot(*model, options.robot);
  if (robot == nullptr) return kUnusable;
  // Modules of one group share a colour.
  std::vector<int> group(robot->modules.size());
  for (size_t m = 0; m < group.size(); ++m) group[m] = static_cast<int>(m);
  return Write(logger::SceneOf(*model, *robot, sim::PlaceOnGround(*model, *robot), group),
               robot->name, views, {}, options.output);
}

/// Poses of all links in the world, where the simulator had them; what no body carries is drawn as
/// it lies in the robot frame at the start.
LinkPoses PosesOf(const logger::RunLog& log, size_t sample) {
  const logger::SimulatedPoses simulated(log);
  LinkPoses X_WL = logger::RestPosesOf(log);
  for (size_t m = 0; m < X_WL.size(); ++m) {
    for (size_t l = 0; l < X_WL[m].size(); ++l) {
      const auto seen = simulated.X_WL(sample, static_cast<int>(m), static_cast<int>(l));
      X_WL[m][l] = seen.value_or(X_WL[m][l]);
    }
  }
  return X_WL;
}

/// The role of each module at a time; one color a role.
std::vector<int> GroupByRole(const logger::RunLog& log, int64_t time_us,
                             std::vector<logger::LegendEntry>* legend) {
  // The last STATUS before the time says which role a module has.
  std::map<std::string, std::vector<int>> modules_of;
  for (size_t m = 0; m < log.robot->modules.size(); ++m) {
    const logger::ModuleSeries* series = log.FindModule(log.robot->modules[m].name);
    std::string role;
    for (size_t i = 0; series != nullptr && i < series->status.size(); ++i) {
      if (series->status[i].time_us <= time_us) role = series->status[i].status.role_name;
    }
    modules_of[role.empty() ? "(no role)" : role].push_back(static_cast<int>(m));
  }
  // Roles are numbered in the order of their names, which the legend keeps.
  std::vector<int> group(log.robot->modules.size());
  int index = 0;
  for (const auto& [role, modules] : modules_of) {
    for (const int m : modules) group[m] = index;
    legend->push_back({role, logger::PaletteColor(index)});
    ++index;
  }
  return group;
}

/// The robot as WORLD had it at or last before --at, modules coloured by role.
int DrawLog(const DrawOptions& options, const std::vector<logger::View>& views) {
  // Whether the picture can be written is found out before the log is read, which takes longer.
  if (!MayWrite(options.output, KindOf(options.output), options.force, {options.file}))
    return kUnusable;
  const Result<logger::RunLog> log = logger::LoadRunLog(options.file, {options.run, true});
  if (!log) return Unusable(log.error().message);
  if (log->robot == nullptr)
    return Unusable(options.file + ": the log does not hold the robot's model");
  if (log->world.empty()) return Unusable(options.file + ": the log holds no simulated poses");
  // An --at beyond all logs is cut so that its microseconds fit an integer; it is refused below.
  const double at_s = std::min(*options.at, kLongestLogSeconds);
  const auto time_us = static_cast<int64_t>(std::llround(at_s * 1e6));
  // The last sample that is not later than --at; before the first one, the first.
  const auto after =
      std::upper_bound(log->world.begin(), log->world.end(), time_us,
                       [](int64_t t, const logger::WorldSample& w) { return t < w.time_us; });
  const logger::WorldSample& world = after == log->world.begin() ? *after : *(after - 1);
  const double shown_s = static_cast<double>(world.time_us) * 1e-6;
  if (*options.at > shown_s + 1.0) {
    return Unusable(fmt::format("--at {}: the log ends at {:.2f} s", *options.at, shown_s));
  }
  // A role keeps its colour whatever modules play it.
  std::vector<logger::LegendEntry> legend;
  const std::vector<int> group = GroupByRole(*log, world.time_us, &legend);
  const LinkPoses X_WL = PosesOf(*log, static_cast<size_t>(&world - log->world.data()));
  return Write(logger::SceneOf(*log->model, *log->robot, X_WL, group),
               fmt::format("{} at {:.2f} s", log->robot->name, shown_s), views, legend,
               options.output);
}

/// Whether the file begins as a log does. A pipe is not looked into: the bytes would be missed.
bool IsLog(const std::string& path) {
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(path, unknown)) return false;
  std::ifstream file(path, std::ios::binary);
  uint32_t magic = 0;
  // The magic number of LCM's log format is big-endian.
  for (int i = 0; i < 4; ++i) magic = magic << 8 | (static_cast<uint32_t>(file.get()) & 0xFF);
  return file.good() && magic == logger::kEventMagic;
}

/// Why the options do not go together; empty if they do.
std::string WhyNotTogether(const DrawOptions& options) {
  if (options.at && !(std::isfinite(*options.at) && *options.at >= 0)) {
    return fmt::format("--at {}: expected a sim time, 0 s or later", *options.at);
  }
  if (!options.at && IsLog(options.file)) {
    return options.file + " is a log: say with --at SECONDS which time of it to draw";
  }
  if (options.at && !options.robot.empty()) {
    return "--robot chooses from a model; a log (--at) holds one robot: leave --robot out";
  }
  if (!options.at && !options.run.empty()) {
    return "--run chooses from a log, and needs --at SECONDS";
  }
  return "";
}

/// Checks the options and draws from the model or, with --at, from the log.
int Draw(const DrawOptions& options) {
  const std::optional<std::vector<logger::View>> views = ParseViews(options.views);
  if (!views) return kUnusable;
  if (const std::string why = WhyNotTogether(options); !why.empty()) return Unusable(why);
  return options.at ? DrawLog(options, *views) : DrawModel(options, *views);
}

}  // namespace

void AddDraw(CommandLine* line) {
  Subcommand sub = line->Add("draw", "A picture of a robot: at its start values, or from a log");
  auto options = std::make_shared<DrawOptions>();
  options->views = {"side"};
  sub.Add("FILE", &options->file, "M3L file, or with --at a log").Required();
  sub.Add("--robot", &options->robot, "A model's robot (default: the only one)");
  sub.Add("--at", &options->at, "Sim time of the log, seconds");
  sub.Add("--run", &options->run, "Which run, if the log holds several (default: the first)");
  sub.Add("--view", &options->views, "side, top, front, iso; several: side,top").Separator(',');
  sub.Add("-o,--output", &options->output, "Picture to write: .svg or .png").Required();
  sub.Force(&options->force);
  sub.Footer(
      "Examples:\n  morphbus draw models/mtran.m3l --robot quadruped --view iso -o quadruped.svg\n"
      "  morphbus draw walk.log --at 12.5 --view side,top -o walking.png");
  sub.Do([options] { return Draw(*options); });
}

}  // namespace morphbus::tools
