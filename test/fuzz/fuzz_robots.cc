// Any M3L text whose robots compile: every back end takes them, and each robot is congruent to
// itself.

#include <cstdint>
#include <string>
#include <vector>

#include "compiler/congruence/congruence.h"
#include "compiler/emit/back_ends.h"
#include "compiler/emit/webots.h"
#include "compiler/keywords/keywords_xml.h"
#include "compiler/m3l/compile.h"
#include "compiler/model/kinematic_graph.h"

namespace {

using namespace morphbus;  // NOLINT: a program of one file

/// Larger robots are for the benchmarks; here they would only take time.
constexpr size_t kMaxModules = 32;

void Require(bool holds) {
  if (!holds) __builtin_trap();
}

void ExportTree(const model::Model& model, const model::Robot& robot) {
  const emit::RobotTree tree = emit::TreeOf(model, robot);
  Require(!emit::ToC(tree, "fuzz").text.empty());
  Require(!emit::ToUrdf(model, emit::OpenTreeOf(model, robot), {"fuzz", ""}).text.empty());
  Require(!emit::ToSdf(model, tree, {"fuzz", ""}).text.empty());
  Require(!emit::ToMjcf(model, tree, "fuzz").text.empty());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const m3l::CompileOutput output = m3l::CompileText("fuzz.m3l", text);
  if (!output.model) return 0;
  const model::Model& model = *output.model;
  for (size_t type = 0; type < model.module_types.size(); ++type) {
    ExportTree(model, emit::ModuleAsRobot(model, static_cast<int>(type)));
    Require(!emit::ModuleToC(model, static_cast<int>(type), 0, "module").text.empty());
    const Result<keywords::ModuleKeywords> keywords =
        keywords::KeywordsOf(model.module_types[type]);
    if (keywords) Require(keywords::ParseKeywordsXml(keywords::KeywordsXml(*keywords)).has_value());
  }
  for (const model::Robot& robot : model.robots) {
    if (robot.modules.size() > kMaxModules) continue;
    ExportTree(model, robot);
    Require(!emit::ToWebots(model, robot, {.controllers = "controllers"})->text.empty());
    Require(!emit::AssemblyGraphDot(model, robot).empty());
    const congruence::Congruence self = congruence::Compare(model, robot, model, robot);
    Require(!self.decided || (self.congruent() && self.mappings.front().keeps_frame));
  }
  return 0;
}
