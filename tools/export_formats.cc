#include "tools/export_formats.h"

#include <fmt/format.h>

#include "compiler/emit/c99.h"
#include "compiler/emit/dot.h"
#include "compiler/emit/keywords.h"
#include "compiler/emit/kinematics.h"
#include "compiler/emit/mjcf.h"
#include "compiler/emit/robot_tree.h"
#include "compiler/emit/sdf.h"
#include "compiler/emit/urdf.h"
#include "compiler/emit/webots.h"
#include "compiler/emit/xml.h"
#include "compiler/model/model_proto.h"

namespace morphbus::tools {
namespace {

using emit::Exported;

Exported TextOnly(std::string text) {
  Exported exported;
  exported.text = std::move(text);
  return exported;
}

uint64_t HashOf(const model::Model& model) {
  return model::ModelHash(model::SerializeModel(model));
}

Result<Exported> ToModel(const ExportRequest& request) {
  return TextOnly(model::SerializeModel(request.model));
}

Result<Exported> ToKinematics(const ExportRequest& request) {
  Result<std::string> image =
      emit::KinematicsImage(request.model, request.type, HashOf(request.model));
  if (!image) return Fail(image.error().message);
  return TextOnly(*std::move(image));
}

Result<Exported> ToXml(const ExportRequest& request) {
  const Result<emit::ModuleKeywords> keywords =
      emit::KeywordsOf(request.model.module_types[static_cast<size_t>(request.type)]);
  if (!keywords) return Fail(keywords.error().message);
  return TextOnly(emit::KeywordsXml(*keywords));
}

Result<Exported> ToDot(const ExportRequest& request) {
  return TextOnly(emit::AssemblyGraphDot(request.model, *request.robot));
}

Result<Exported> ToC(const ExportRequest& request) {
  for (const char c : request.stem) {
    if (c != '"' && c != '\\' && static_cast<unsigned char>(c) >= ' ') continue;
    return Fail(
        fmt::format("cannot write C to {0}.c: it includes \"{0}.h\", and an #include takes "
                    "no quotes, backslashes or control characters; name the file otherwise",
                    request.stem));
  }
  if (request.type >= 0) {
    return emit::ModuleToC(request.model, request.type, HashOf(request.model), request.stem);
  }
  return emit::ToC(emit::TreeOf(request.model, *request.robot), request.stem);
}

emit::MeshPlace MeshPlaceOf(const ExportRequest& request) {
  return {request.stem, request.mesh_prefix};
}

Result<Exported> ToUrdf(const ExportRequest& request) {
  return emit::ToUrdf(request.model, emit::OpenTreeOf(request.model, *request.robot),
                      MeshPlaceOf(request));
}

Result<Exported> ToSdf(const ExportRequest& request) {
  return emit::ToSdf(request.model, emit::TreeOf(request.model, *request.robot),
                     MeshPlaceOf(request));
}

Result<Exported> ToMjcf(const ExportRequest& request) {
  return emit::ToMjcf(request.model, emit::TreeOf(request.model, *request.robot), request.stem);
}

Result<Exported> ToWebots(const ExportRequest& request) {
  model::Robot robot = *request.robot;
  // A Robot node of Webots has a name.
  if (request.type >= 0) robot.modules[0].name = robot.name;
  return emit::ToWebots(request.model, robot, request.controllers);
}

}  // namespace

const std::vector<ExportFormat>& ExportFormats() {
  static const std::vector<ExportFormat> formats = {
      {"model", Of::kFile, false, ToModel},     {"kinematics", Of::kModule, false, ToKinematics},
      {"xml", Of::kModule, false, ToXml},       {"dot", Of::kRobot, false, ToDot},
      {"c", Of::kEither, false, ToC},           {"urdf", Of::kEither, true, ToUrdf},
      {"sdf", Of::kEither, true, ToSdf},        {"mjcf", Of::kEither, false, ToMjcf},
      {"webots", Of::kEither, false, ToWebots},
  };
  return formats;
}

}  // namespace morphbus::tools
