#include "tools/cli.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <sstream>
#include <string_view>

#include "compiler/model/loop_constraints.h"
#include "tools/json_text.h"
#include "tools/output_path.h"

namespace morphbus::tools {

bool IsFancyTerminal(int fd) {
  const char* term = std::getenv("TERM");
  const char* no_color = std::getenv("NO_COLOR");
  return isatty(fd) == 1 && (no_color == nullptr || *no_color == '\0') && term != nullptr &&
         std::strcmp(term, "dumb") != 0;
}

namespace {

void Say(const char* severity, const char* color, const std::string& message) {
  if (IsFancyTerminal(STDERR_FILENO)) {
    fmt::print(stderr, "morphbus: {}{}:\033[0m {}\n", color, severity, message);
  } else {
    fmt::print(stderr, "morphbus: {}: {}\n", severity, message);
  }
}

/// A warning without the names and figures that tell it from others of its kind.
std::string KindOf(const std::string& message) {
  std::istringstream words(message);
  std::string kind;
  for (std::string word; words >> word;) {
    const std::string_view inner = std::string_view(word).substr(0, word.size() - 1);
    const bool is_name = inner.find('.') != std::string_view::npos ||
                         word.find_first_of("0123456789") != std::string::npos;
    kind += is_name ? "* " : word + " ";
  }
  return kind;
}

/// Rounds nothing, but prints -0 as 0.
double Plain(double v) { return v == 0.0 ? 0.0 : v; }

}  // namespace

int Unusable(const std::string& message) {
  Say("error", "\033[1;31m", message);
  return kUnusable;
}

int Failed(const std::string& message) {
  Say("error", "\033[1;31m", message);
  return kFailed;
}

void Warn(const std::string& message) { Say("warning", "\033[1;33m", message); }

void WarnOfMany(const std::vector<std::string>& messages) {
  std::vector<std::vector<const std::string*>> kinds;
  std::map<std::string, size_t> index_of;
  for (const std::string& message : messages) {
    const size_t index = index_of.try_emplace(KindOf(message), kinds.size()).first->second;
    if (index == kinds.size()) kinds.emplace_back();
    kinds[index].push_back(&message);
  }
  for (const auto& kind : kinds) {
    for (size_t i = 0; i < std::min(kind.size(), kMostNamed); ++i) Warn(*kind[i]);
    if (kind.size() > kMostNamed) {
      Warn(fmt::format("and {} more like the last", kind.size() - kMostNamed));
    }
  }
}

void PrintDiagnostics(const source::Diagnostics& diagnostics, const source::SourceSet& sources) {
  const std::string text = source::Render(diagnostics, sources, IsFancyTerminal(STDERR_FILENO));
  std::fputs(text.c_str(), stderr);
}

void PrintJson(const Json& json) { fmt::print("{}\n", JsonText(json, 2)); }

std::optional<model::Model> LoadModel(const std::vector<std::string>& paths,
                                      std::vector<std::string>* read) {
  m3l::CompileOutput output = m3l::CompileFiles(paths);
  PrintDiagnostics(output.diagnostics, output.sources);
  for (int file = 0; read != nullptr && file < output.sources.size(); ++file) {
    read->push_back(output.sources.name(file));
  }
  return std::move(output.model);
}

bool SparesInputs(const std::string& output, const std::vector<std::string>& inputs) {
  if (!IsOneOf(output, inputs)) return true;
  Unusable(fmt::format("cannot write {}: this command reads that file; name another", output));
  return false;
}

const model::Robot* PickRobot(const model::Model& model, const std::string& name) {
  std::vector<std::string> names;
  for (const model::Robot& robot : model.robots) names.push_back(robot.name);
  if (name.empty() && model.robots.size() == 1) return &model.robots.front();
  if (const model::Robot* robot = model.FindRobot(name)) return robot;
  if (names.empty()) {
    Unusable("the model defines no robot");
  } else if (name.empty()) {
    Unusable(fmt::format("the model has several robots; choose one with --robot: {}",
                         fmt::join(names, ", ")));
  } else {
    Unusable(fmt::format("the model has no robot '{}'{}; it has {}", name, DidYouMean(name, names),
                         fmt::join(names, ", ")));
  }
  return nullptr;
}

Json PoseJson(const model::Pose& X) {
  Eigen::Quaterniond q(X.linear());
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return Json{{"p", VectorJson(X.translation())},
              {"q", Json::array({Plain(q.w()), Plain(q.x()), Plain(q.y()), Plain(q.z())})}};
}

Json VectorJson(const Eigen::Vector3d& v) {
  return Json::array({Plain(v.x()), Plain(v.y()), Plain(v.z())});
}

Json AttributeJson(const model::AttributeValue& value) {
  return std::visit([](const auto& v) { return Json(v); }, value);
}

std::string DidYouMean(const std::string& name, const std::vector<std::string>& names) {
  const std::string nearest = source::NearestName(name, names);
  return nearest.empty() ? "" : fmt::format(" (did you mean '{}'?)", nearest);
}

std::string MobilityText(const model::KinematicGraph& graph) {
  if (graph.mobility) return fmt::format("mobility {}", *graph.mobility);
  return fmt::format("mobility not computed (over {} joints in one system of loops)",
                     model::kMaxLoopJoints);
}

std::string NameSome(const std::vector<std::string>& names) {
  if (names.size() <= kMostNamed) return fmt::format("{}", fmt::join(names, ", "));
  return fmt::format("{} and {} more", fmt::join(names.begin(), names.begin() + kMostNamed, ", "),
                     names.size() - kMostNamed);
}

std::string Plural(size_t count, const std::string& noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

}  // namespace morphbus::tools
