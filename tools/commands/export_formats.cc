#include "tools/commands/export_formats.h"

#include <fmt/format.h>

#include "compiler/emit/back_ends.h"
#include "compiler/emit/kinematics.h"
#include "compiler/emit/robot_tree.h"
#include "compiler/emit/triangle_plates.h"
#include "compiler/emit/webots.h"
#include "compiler/keywords/keywords_xml.h"
#include "compiler/model/model_proto.h"

namespace morphbus::tools {
namespace {

using emit::Exported;

/// An output without companions or warnings.
Exported TextOnly(std::string text) {
  Exported exported;
  exported.text = std::move(text);
  return exported;
}

/// The hash by which images and logs know their model.
uint64_t HashOf(const model::Model& model) {
  return model::ModelHash(model::SerializeModel(model));
}

/// The compiled model as Protocol Buffers, as it lies in logs.
Result<Exported> ToModel(const ExportRequest& request) {
  return TextOnly(model::SerializeModel(request.model));
}

/// What a module's VM knows of its own body.
Result<Exported> ToKinematics(const ExportRequest& request) {
  Result<std::string> image =
      emit::KinematicsImage(request.model, request.type, HashOf(request.model));
  if (!image) return Fail(image.error().message);
  return TextOnly(*std::move(image));
}

/// The keywords that a DynaRole program may use of this module type.
Result<Exported> ToXml(const ExportRequest& request) {
  const Result<keywords::ModuleKeywords> keywords =
      keywords::KeywordsOf(request.model.module_types[request.type]);
  if (!keywords) return Fail(keywords.error().message);
  return TextOnly(keywords::KeywordsXml(*keywords));
}

/// How modules are connected, for Graphviz.
Result<Exported> ToDot(const ExportRequest& request) {
  return TextOnly(emit::AssemblyGraphDot(request.model, *request.robot));
}

/// Forward kinematics as C99, of a robot or of one module type.
Result<Exported> ToC(const ExportRequest& request) {
  // The header is included by this name.
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

/// Meshes lie in a folder called after the main file.
emit::MeshPlace MeshPlaceOf(const ExportRequest& request) {
  return {request.stem, request.mesh_prefix};
}

/// URDF has no loops: the tree is cut open, and what was cut is listed beside it.
Result<Exported> ToUrdf(const ExportRequest& request) {
  return emit::ToUrdf(request.model, emit::OpenTreeOf(request.model, *request.robot),
                      MeshPlaceOf(request));
}

/// SDFormat keeps loops: it takes the tree together with the joints that close it.
Result<Exported> ToSdf(const ExportRequest& request) {
  return emit::ToSdf(request.model, emit::TreeOf(request.model, *request.robot),
                     MeshPlaceOf(request), request.obstacles);
}

/// MJCF for MuJoCo, whose parts are called after the main file.
Result<Exported> ToMjcf(const ExportRequest& request) {
  size_t triangles = 0;
  for (const world::Obstacle& obstacle : request.obstacles) {
    if (obstacle.mesh) triangles += obstacle.mesh->triangles.size();
  }
  if (triangles > emit::kMostPlates) {
    return Fail(fmt::format(
        "--world: MuJoCo takes a mesh for its convex hull, so that in MJCF each triangle is a "
        "plate of its own, of {} at most; the world's meshes and height maps have {}. SDF and "
        "Webots take them as they are",
        emit::kMostPlates, triangles));
  }
  return emit::ToMjcf(request.model, emit::TreeOf(request.model, *request.robot), request.stem,
                      request.obstacles);
}

/// A world with the robot in it, whose modules run the program, if there is one; a module type
/// stands alone in its world.
Result<Exported> ToWebots(const ExportRequest& request) {
  model::Robot robot = *request.robot;
  // A Robot node of Webots has a name.
  if (request.type >= 0) robot.modules[0].name = robot.name;
  return emit::ToWebots(
      request.model, robot,
      {request.controllers, request.program, HashOf(request.model), request.obstacles});
}

}  // namespace

OutputKind CompanionKind(const std::string& path) {
  if (path.ends_with(".stl")) return outputs::kMesh;
  if (path.ends_with(".json")) return outputs::kCuts;
  return path.ends_with(".xml") ? outputs::kMjcfPart : outputs::kCode;
}

const std::vector<ExportFormat>& ExportFormats() {
  static const std::vector<ExportFormat> formats = {
      {"model", Of::kFile, false, false, false, outputs::kModel, ToModel},
      {"kinematics", Of::kModule, false, false, false, outputs::kKinematicsImage, ToKinematics},
      {"xml", Of::kModule, false, false, false, outputs::kKeywords, ToXml},
      {"dot", Of::kRobot, false, false, false, outputs::kDot, ToDot},
      {"c", Of::kEither, false, false, false, outputs::kCode, ToC},
      {"urdf", Of::kEither, true, false, false, outputs::kUrdf, ToUrdf},
      {"sdf", Of::kEither, true, false, true, outputs::kSdf, ToSdf},
      {"mjcf", Of::kEither, false, false, true, outputs::kMjcf, ToMjcf},
      {"webots", Of::kEither, false, true, true, outputs::kWebots, ToWebots},
  };
  return formats;
}

}  // namespace morphbus::tools
