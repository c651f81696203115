// morphbus draw: a robot as a picture, from its model or from a log.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include "compiler/model/forward_kinematics.h"
#include "compiler/model/kinematic_graph.h"
#include "logger/drawing.h"
#include "logger/event_log.h"
#include "logger/run_log.h"
#include "sim/bodies.h"
#include "tools/commands.h"

namespace morphbus::tools {
namespace {

using LinkPoses = std::vector<std::vector<model::Pose>>;

/// Far beyond any log, and its microseconds still fit an integer.
constexpr double kLongestLogSeconds = 1e9;

struct Options {
  std::string file;
  std::string robot;
  std::string run;
  std::string output;
  std::vector<std::string> views;
  std::optional<double> at;  ///< Sim time of a log, seconds.
};

std::optional<std::vector<logger::View>> ParseViews(const std::vector<std::string>& names) {
  const std::map<std::string, logger::View> known = {{"side", logger::View::kSide},
                                                     {"top", logger::View::kTop},
                                                     {"front", logger::View::kFront},
                                                     {"iso", logger::View::kThreeQuarter}};
  std::vector<logger::View> views;
  for (const std::string& name : names) {
    const auto found = known.find(name);
    if (found == known.end()) {
      Unusable(fmt::format("--view {}: expected side, top, front or iso", name));
      return std::nullopt;
    }
    views.push_back(found->second);
  }
  return views;
}

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

int DrawModel(const Options& options, const std::vector<logger::View>& views) {
  std::vector<std::string> files;
  const std::optional<model::Model> model = LoadModel({options.file}, &files);
  if (!model || !SparesInputs(options.output, files)) return kUnusable;
  const model::Robot* robot = PickRobot(*model, options.robot);
  if (robot == nullptr) return kUnusable;
  std::vector<int> group(robot->modules.size());
  for (size_t m = 0; m < group.size(); ++m) group[m] = static_cast<int>(m);
  return Write(logger::SceneOf(*model, *robot, sim::PlaceOnGround(*model, *robot), group),
               robot->name, views, {}, options.output);
}

model::Pose ToPose(const morphbus::body_pose_t& pose) {
  const double* q = pose.orientation_wxyz;
  model::Pose X = model::Pose::Identity();
  X.linear() = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
  X.translation() = Eigen::Map<const Eigen::Vector3d>(pose.position_m);
  return X;
}

/// Poses of all links from those of the bodies: links of one body lie to each other as at the
/// start.
LinkPoses PosesOf(const model::Model& model, const model::Robot& robot,
                  const logger::WorldSample& world) {
  const LinkPoses X_RL = model::ForwardKinematics(model, robot, model::StartValues(robot)).X_RL;
  const std::vector<std::vector<int>> body_of = model::BodiesOf(model, robot);
  LinkPoses X_WL = X_RL;
  for (const morphbus::body_pose_t& body : world.bodies) {
    const auto m0 = static_cast<size_t>(body.module_id);
    const auto l0 = static_cast<size_t>(body.link);
    if (body.module_id < 0 || m0 >= X_RL.size() || body.link < 0 || l0 >= X_RL[m0].size()) continue;
    const model::Pose X_WR = ToPose(body) * X_RL[m0][l0].inverse();
    for (size_t m = 0; m < X_RL.size(); ++m) {
      for (size_t l = 0; l < X_RL[m].size(); ++l) {
        if (body_of[m][l] == body_of[m0][l0]) X_WL[m][l] = X_WR * X_RL[m][l];
      }
    }
  }
  return X_WL;
}

/// The role of each module at a time; one color a role.
std::vector<int> GroupByRole(const logger::RunLog& log, int64_t time_us,
                             std::vector<logger::LegendEntry>* legend) {
  std::map<std::string, std::vector<int>> modules_of;
  for (size_t m = 0; m < log.robot->modules.size(); ++m) {
    const logger::ModuleSeries* series = log.FindModule(log.robot->modules[m].name);
    std::string role;
    for (size_t i = 0; series != nullptr && i < series->status.size(); ++i) {
      if (series->status[i].time_us <= time_us) role = series->status[i].status.role_name;
    }
    modules_of[role.empty() ? "(no role)" : role].push_back(static_cast<int>(m));
  }
  std::vector<int> group(log.robot->modules.size());
  int index = 0;
  for (const auto& [role, modules] : modules_of) {
    for (const int m : modules) group[static_cast<size_t>(m)] = index;
    legend->push_back({role, logger::PaletteColor(index)});
    ++index;
  }
  return group;
}

int DrawLog(const Options& options, const std::vector<logger::View>& views) {
  if (!SparesInputs(options.output, {options.file})) return kUnusable;
  const Result<logger::RunLog> log = logger::LoadRunLog(options.file, {options.run, true});
  if (!log) return Unusable(log.error().message);
  if (log->robot == nullptr)
    return Unusable(options.file + ": the log does not hold the robot's model");
  if (log->world.empty()) return Unusable(options.file + ": the log holds no simulated poses");
  const double at_s = std::min(*options.at, kLongestLogSeconds);
  const auto time_us = static_cast<int64_t>(std::llround(at_s * 1e6));
  const auto after =
      std::upper_bound(log->world.begin(), log->world.end(), time_us,
                       [](int64_t t, const logger::WorldSample& w) { return t < w.time_us; });
  const logger::WorldSample& world = after == log->world.begin() ? *after : *(after - 1);
  const double shown_s = static_cast<double>(world.time_us) * 1e-6;
  if (*options.at > shown_s + 1.0) {
    return Unusable(fmt::format("--at {}: the log ends at {:.2f} s", *options.at, shown_s));
  }
  std::vector<logger::LegendEntry> legend;
  const std::vector<int> group = GroupByRole(*log, world.time_us, &legend);
  const LinkPoses X_WL = PosesOf(*log->model, *log->robot, world);
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
  for (int i = 0; i < 4; ++i) magic = magic << 8 | (static_cast<uint32_t>(file.get()) & 0xFF);
  return file.good() && magic == logger::kEventMagic;
}

/// Why the options do not go together; empty if they do.
std::string WhyNotTogether(const Options& options) {
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

int Draw(const Options& options) {
  const std::optional<std::vector<logger::View>> views = ParseViews(options.views);
  if (!views) return kUnusable;
  if (const std::string why = WhyNotTogether(options); !why.empty()) return Unusable(why);
  return options.at ? DrawLog(options, *views) : DrawModel(options, *views);
}

}  // namespace

void AddDraw(CLI::App& app, Action* action) {
  CLI::App* sub =
      app.add_subcommand("draw", "A picture of a robot: at its start values, or from a log");
  auto options = std::make_shared<Options>();
  options->views = {"side"};
  sub->add_option("FILE", options->file, "M3L file, or with --at a log")->required();
  sub->add_option("--robot", options->robot, "A model's robot (default: the only one)");
  sub->add_option("--at", options->at, "Sim time of the log, seconds");
  sub->add_option("--run", options->run,
                  "Which run, if the log holds several (default: the first)");
  sub->add_option("--view", options->views, "side, top, front, iso; several: side,top")
      ->delimiter(',');
  sub->add_option("-o,--output", options->output, "Picture to write: .svg or .png")->required();
  sub->footer(
      "Examples:\n  morphbus draw models/mtran.m3l --robot quadruped --view iso -o quadruped.svg\n"
      "  morphbus draw walk.log --at 12.5 --view side,top -o walking.png");
  sub->callback([options, action] { *action = [options] { return Draw(*options); }; });
}

}  // namespace morphbus::tools
