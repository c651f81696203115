#include <morphbus/view/view.h>

#include <algorithm>

#include "compiler/base/role_colors.h"
#include "logger/compare/comparer.h"
#include "logger/show/drawing.h"
#include "logger/show/log_pictures.h"
#include "logger/show/report.h"
#include "sim/rigid_body_model.h"
#include "tools/libraries/log_content.h"
#include "tools/libraries/model_content.h"

namespace morphbus {
namespace {

std::vector<logger::View> ToInternal(const std::vector<View>& views) {
  std::vector<logger::View> told;
  for (const View view : views) told.push_back(static_cast<logger::View>(view));
  return told;
}

/// What is in the result. Throws Failure where it is an error.
template <class Value>
Value OrThrow(Result<Value> result) {
  if (!result) throw Failure(result.error().message);
  return std::move(*result);
}

std::string Render(const logger::Drawing& drawing, PictureFormat format) {
  // The kind of a picture is that of a file's name.
  return OrThrow(logger::RenderPicture(drawing, format == PictureFormat::kPng ? "x.png" : "x.svg"));
}

void CheckCount(const char* what, int value, int most) {
  if (value < 1 || value > most) {
    throw Failure(std::string(what) + ": expected 1 to " + std::to_string(most) + ", and not " +
                  std::to_string(value));
  }
}

/// The stretch as the pictures take it.
logger::PictureTimes ToInternal(const Stretch& stretch) {
  if (!(stretch.from_s >= 0 && stretch.to_s.value_or(stretch.from_s) >= stretch.from_s)) {
    throw Failure("a stretch of a log begins at 0 s or later, and ends after that");
  }
  return {stretch.from_s, stretch.to_s};
}

/// What draws a log; refers to it.
std::unique_ptr<logger::LogPictures> PicturesOf(const Log& log) {
  return OrThrow(logger::LogPictures::Of(log.content()->log));
}

}  // namespace

std::string DrawRobot(const Robot& robot, std::span<const double> joint_values,
                      const std::vector<View>& views, PictureFormat format) {
  const model::Model& model = robot.content()->of_model->model;
  model::Robot posed = robot.content()->robot;
  if (!joint_values.empty()) {
    // The picture shows a robot that starts so.
    const model::JointValues by_module = robot.content()->ByModule(joint_values);
    for (size_t m = 0; m < by_module.size(); ++m) posed.modules[m].start = by_module[m];
  }
  // It stands where a run of it begins, each module in a colour of its own.
  const logger::Scene scene = logger::SceneOf(model, posed, sim::PlaceOnGround(model, posed),
                                              PaletteColors(posed.modules.size()));
  logger::Drawing drawing;
  drawing.title = robot.name();
  for (const logger::View view : ToInternal(views)) drawing.panels.push_back({scene, view, ""});
  return Render(drawing, format);
}

std::string DrawMoment(const Log& log, double at_s, const std::vector<View>& views,
                       PictureFormat format) {
  if (!(at_s >= 0)) throw Failure("a time of a log is 0 s or later");
  return Render(OrThrow(PicturesOf(log)->Moment(at_s, ToInternal(views))), format);
}

std::string DrawStrip(const Log& log, int count, const Stretch& stretch,
                      const std::vector<View>& views, PictureFormat format) {
  CheckCount("moments", count, 100);
  return Render(OrThrow(PicturesOf(log)->Strip(count, ToInternal(stretch), ToInternal(views))),
                format);
}

std::string DrawVideo(const Log& log, int fps, const Stretch& stretch,
                      const std::vector<View>& views) {
  CheckCount("pictures a second", fps, 50);
  return OrThrow(PicturesOf(log)->Video(fps, 0, ToInternal(stretch), ToInternal(views)));
}

std::string ReportHtml(const Log& log) { return logger::RunReportHtml(log.content()->log); }

std::string ReportHtml(const Log& a, const Log& b) {
  const logger::RunLog& log_a = a.content()->log;
  const logger::RunLog& log_b = b.content()->log;
  return logger::ReportHtml(log_a, log_b, logger::Compare(log_a, log_b));
}

}  // namespace morphbus
