#include "compiler/world/sdf_world.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <pugixml.hpp>
#include <set>
#include <string_view>

namespace morphbus::world {
namespace {

using Eigen::Vector3d;
using model::Pose;

// Bounds on what a file may ask of the simulator, far above any real world. Nesting is bounded
// because models are read by recursion.
constexpr size_t kMaxObstacles = 10'000;
constexpr double kMaxLength_m = 1e5;
constexpr double kLeastLength_m = 1e-6;
constexpr int kMaxNesting = 100;
constexpr size_t kMaxTriangles = 400'000;

constexpr const char* kShapes = "shapes are box, cylinder, sphere, plane, mesh, heightmap";

/// SDFormat's world frame in W: x stays, z becomes y, y becomes -z.
Pose FromZUp() {
  Pose X_WS = Pose::Identity();
  X_WS.linear() << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return X_WS;
}

/// Walks the elements of one world. By hand and not by libsdformat, which lets much pass that this
/// must refuse, and says no place (docs/libraries.md).
class WorldReader {
 public:
  /// `surfaces` holds what is at hand already and takes up what is loaded.
  WorldReader(const source::SourceSet& sources, int file, const SurfaceLoader& load,
              Surfaces* surfaces, source::Diagnostics* diagnostics)
      : text_(sources.text(file)),
        file_(file),
        load_(load),
        surfaces_(*surfaces),
        diagnostics_(*diagnostics) {}

  std::vector<Obstacle> Read(const pugi::xml_document& document) {
    const pugi::xml_node root = document.document_element();
    if (std::string_view(root.name()) != "sdf") {
      Error(root, "this is no SDFormat: its element is not <sdf>").hint =
          "a world is written as <sdf version=\"1.9\"><world name=\"...\">...</world></sdf>";
      return {};
    }
    // The first <world> counts; a second one, and whatever else stands beside it, such as a model,
    // is an error and not a part of the world.
    pugi::xml_node world;
    for (const pugi::xml_node& child : root.children()) {
      const std::string_view name = child.name();
      if (name == "world" && world) Error(child, "there is a second <world>");
      if (name == "world" && !world) world = child;
      if (name != "world") Refuse(child, {});
    }
    if (!world) {
      Error(root, "there is no <world> in it").hint =
          "a single <model> is put into one: <world name=\"w\"><model ...>...</model></world>";
      return {};
    }
    // A world holds models; what is only seen, or says how others simulate it, is left out.
    for (const pugi::xml_node& child : world.children()) {
      // One obstacle too many is read, by which the error below knows that there were too many.
      if (diagnostics_.full() || obstacles_.size() > kMaxObstacles) break;
      if (std::string_view(child.name()) == "model") {
        ReadModel(child, FromZUp(), "", 0);
      } else {
        Refuse(child, {"light", "scene", "gui", "physics", "plugin", "gravity", "magnetic_field",
                       "atmosphere", "wind", "spherical_coordinates", "audio"});
      }
    }
    if (obstacles_.size() > kMaxObstacles) {
      Error(world, fmt::format("a world has at most {} obstacles", kMaxObstacles));
    }
    return std::move(obstacles_);
  }

  [[nodiscard]] std::optional<double> ground_friction() const { return ground_friction_; }

  source::Diagnostic& ErrorAt(ptrdiff_t offset, std::string message) {
    // pugixml gives -1 where it knows no place, and counts from the beginning of the text as we do.
    const size_t begin =
        std::min(static_cast<size_t>(std::max<ptrdiff_t>(offset, 0)), text_.size());
    // The name of an element, or whatever word stands there.
    size_t end = begin;
    while (end < text_.size() && (std::isalnum(static_cast<unsigned char>(text_[end])) != 0 ||
                                  text_[end] == '_' || text_[end] == ':')) {
      ++end;
    }
    return diagnostics_.Error({file_, begin, std::max(end, std::min(begin + 1, text_.size()))},
                              std::move(message));
  }

 private:
  source::Diagnostic& Error(const pugi::xml_node& node, std::string message) {
    return ErrorAt(node.offset_debug(), std::move(message));
  }

  /// Reports an element that means something that we cannot do; `harmless` ones are left out.
  void Refuse(const pugi::xml_node& node, const std::set<std::string_view>& harmless) {
    // Comments and texts between elements say nothing.
    const std::string_view name = node.name();
    if (node.type() != pugi::node_element || harmless.count(name) != 0) return;
    source::Diagnostic& error = Error(node, fmt::format("<{}> is not supported here", name));
    if (name == "include") error.hint = "write the models into this file";
    if (name == "joint" || name == "actor") error.hint = "obstacles are static models";
  }

  /// Numbers separated by blanks; as many as `numbers` holds, each finite and not too large.
  template <size_t N>
  bool ReadNumbers(const pugi::xml_node& node, std::array<double, N>* numbers) {
    const std::string_view text = node.child_value();
    const char* at = text.data();
    const char* const end = text.data() + text.size();
    const auto skip = [&] {
      while (at != end && std::string_view(" \t\r\n").find(*at) != std::string_view::npos) ++at;
    };
    // from_chars depends on no locale, but takes no plus sign, which SDFormat allows.
    for (double& number : *numbers) {
      skip();
      if (at != end && *at == '+') ++at;
      const std::from_chars_result read = std::from_chars(at, end, number);
      // Put this way round the comparison refuses NaN as well.
      if (read.ec != std::errc() || !(std::abs(number) <= kMaxLength_m)) {
        Error(node, fmt::format("<{}> needs {} number{}, each at most {:g}", node.name(), N,
                                N == 1 ? "" : "s", kMaxLength_m));
        return false;
      }
      at = read.ptr;
    }
    skip();
    // All numbers were read; only blanks may follow them.
    if (at == end) return true;
    Error(node, fmt::format("<{}> has more than {} number{}", node.name(), N, N == 1 ? "" : "s"));
    return false;
  }

  /// The pose of an element in its parent: x y z roll pitch yaw, in radians unless it says degrees.
  /// `frame` is what SDFormat calls that parent, if it has a name for it.
  Pose ReadPose(const pugi::xml_node& parent, std::string_view frame = "") {
    const pugi::xml_node node = parent.child("pose");
    if (!node) return Pose::Identity();
    const std::string_view base = node.attribute("relative_to").value();
    // A model's pose is in the world and a link's in its model; with these names they say so.
    if (!base.empty() && base != frame) {
      Error(node, fmt::format("a pose relative to '{}' is not supported", base)).hint =
          "give the pose in its parent";
    }
    const std::string_view format = node.attribute("rotation_format").value();
    Pose X = Pose::Identity();
    // Written x y z qx qy qz qw; Eigen's constructor wants w first. It need not be of length 1, as
    // digits in a file seldom are.
    if (format == "quat_xyzw") {
      std::array<double, 7> n{};
      if (!ReadNumbers(node, &n)) return X;
      const Eigen::Quaterniond q(n[6], n[3], n[4], n[5]);
      if (!(q.norm() > 1e-6)) {
        Error(node, "a quaternion of length zero turns nothing");
        return X;
      }
      X.linear() = q.normalized().toRotationMatrix();
      X.translation() = Vector3d(n[0], n[1], n[2]);
      return X;
    }
    std::array<double, 6> n{};
    // An empty pose is one of zeros.
    if (std::string_view(node.child_value()).find_first_not_of(" \t\r\n") ==
        std::string_view::npos) {
      return X;
    }
    if (!ReadNumbers(node, &n)) return X;
    const std::string_view degrees = node.attribute("degrees").value();
    const double unit = degrees == "true" || degrees == "1" ? std::numbers::pi / 180.0 : 1.0;
    // Roll about the fixed x, then pitch about the fixed y, then yaw about the fixed z.
    X.linear() = (Eigen::AngleAxisd(unit * n[5], Vector3d::UnitZ()) *
                  Eigen::AngleAxisd(unit * n[4], Vector3d::UnitY()) *
                  Eigen::AngleAxisd(unit * n[3], Vector3d::UnitX()))
                     .toRotationMatrix();
    X.translation() = Vector3d(n[0], n[1], n[2]);
    return X;
  }

  static std::string NameIn(const std::string& parent, const pugi::xml_node& node) {
    const std::string name = node.attribute("name").value();
    return parent.empty() ? name : parent + "." + name;
  }

  /// A static model, and the models within it.
  void ReadModel(const pugi::xml_node& node, const Pose& X_WP, const std::string& parent,
                 int depth) {
    if (depth > kMaxNesting) {
      Error(node, "models are nested too deep");
      return;
    }
    const std::string_view is_static = node.child("static").text().get();
    // A model within a static one is static too.
    if (depth == 0 && is_static != "true" && is_static != "1") {
      Error(node, fmt::format("model '{}' is not static", node.attribute("name").value())).hint =
          "obstacles do not move: add <static>true</static>";
    }
    const std::string name = NameIn(parent, node);
    // Poses are given in the parent's frame: X_WP is that of the world or of the model around this
    // one.
    const Pose X_WM = X_WP * ReadPose(node, "world");
    for (const pugi::xml_node& child : node.children()) {
      if (diagnostics_.full() || obstacles_.size() > kMaxObstacles) return;
      const std::string_view element = child.name();
      if (element == "model") {
        ReadModel(child, X_WM, name, depth + 1);
      } else if (element == "link") {
        ReadLink(child, X_WM, name);
      } else {
        Refuse(child,
               {"static", "pose", "plugin", "self_collide", "allow_auto_disable", "enable_wind"});
      }
    }
  }

  void ReadLink(const pugi::xml_node& node, const Pose& X_WM, const std::string& parent) {
    const Pose X_WL = X_WM * ReadPose(node, "__model__");
    const std::string name = NameIn(parent, node);
    for (const pugi::xml_node& child : node.children()) {
      if (std::string_view(child.name()) == "collision") {
        ReadCollision(child, X_WL, NameIn(name, child));
      } else {
        Refuse(child, {"pose", "visual", "inertial", "light", "sensor", "gravity", "kinematic",
                       "self_collide", "enable_wind", "velocity_decay", "must_be_base_link",
                       "audio_source"});
      }
    }
  }

  void ReadCollision(const pugi::xml_node& node, const Pose& X_WL, const std::string& name) {
    Obstacle obstacle;
    obstacle.name = name;
    obstacle.X_WO = X_WL * ReadPose(node);
    obstacle.friction = ReadFriction(node);
    // SDFormat has one shape in a <geometry>; of several the first is taken.
    pugi::xml_node shape;
    for (const pugi::xml_node& child : node.child("geometry").children()) {
      if (child.type() == pugi::node_element && !shape) shape = child;
    }
    if (!shape) {
      Error(node, "a <collision> without <geometry>").hint = kShapes;
      return;
    }
    if (!ReadShape(shape, &obstacle)) return;
    // A level plane at height 0 is the ground, which every run has unless it wants none
    // (--ground false). Only its friction is kept.
    const Vector3d up = obstacle.X_WO.linear().col(2);
    if (obstacle.shape == Shape::kPlane && up.y() > 1 - 1e-9 &&
        std::abs(obstacle.X_WO.translation().y()) < 1e-9) {
      if (obstacle.friction) ground_friction_ = obstacle.friction;
      return;
    }
    obstacles_.push_back(std::move(obstacle));
  }

  /// Coulomb's coefficient of ODE's parameters, which most worlds have.
  std::optional<double> ReadFriction(const pugi::xml_node& node) {
    const pugi::xml_node mu = node.child("surface").child("friction").child("ode").child("mu");
    std::array<double, 1> number{};
    // Without the element the obstacle has the friction of the ground.
    if (!mu || !ReadNumbers(mu, &number)) return std::nullopt;
    if (number[0] >= 0 && number[0] <= 10) return number[0];
    Error(mu, "friction is from 0 to 10");
    return std::nullopt;
  }

  /// A length of at least kLeastLength_m in a child element; 1 after an error.
  double ReadLength(const pugi::xml_node& parent, const char* key) {
    const pugi::xml_node node = parent.child(key);
    std::array<double, 1> number{1.0};
    if (!node) {
      Error(parent, fmt::format("<{}> needs <{}>", parent.name(), key));
    } else if (ReadNumbers(node, &number) && !(number[0] >= kLeastLength_m)) {
      Error(node, fmt::format("<{}> is at least {:g} metres", key, kLeastLength_m));
    }
    return number[0];
  }

  bool ReadShape(const pugi::xml_node& node, Obstacle* obstacle) {
    // Errors in the shape's sizes do not end the reading at once, so that all of them are told; a
    // shape with any is not taken.
    const int errors = diagnostics_.error_count();
    const std::string_view shape = node.name();
    if (shape == "box") {
      obstacle->shape = Shape::kBox;
      std::array<double, 3> sides{1, 1, 1};
      const pugi::xml_node size = node.child("size");
      if (!size) {
        Error(node, "<box> needs <size>");
      } else if (ReadNumbers(size, &sides) &&
                 !(std::min({sides[0], sides[1], sides[2]}) >= kLeastLength_m)) {
        Error(size, fmt::format("the sides of a box are at least {:g} metres", kLeastLength_m));
      }
      obstacle->size = Vector3d(sides[0], sides[1], sides[2]);
    } else if (shape == "cylinder") {
      obstacle->shape = Shape::kCylinder;
      obstacle->size = Vector3d(ReadLength(node, "radius"), ReadLength(node, "length"), 0);
    } else if (shape == "sphere") {
      obstacle->shape = Shape::kSphere;
      obstacle->size = Vector3d(ReadLength(node, "radius"), 0, 0);
    } else if (shape == "plane") {
      ReadPlane(node, obstacle);
    } else if (shape == "mesh") {
      ReadMesh(node, obstacle);
    } else if (shape == "heightmap") {
      ReadHeightMap(node, obstacle);
    } else {
      Error(node, fmt::format("a <{}> is not supported", shape)).hint = kShapes;
    }
    return errors == diagnostics_.error_count();
  }

  /// A plane's normal is brought to z of its own frame.
  void ReadPlane(const pugi::xml_node& node, Obstacle* obstacle) {
    obstacle->shape = Shape::kPlane;
    std::array<double, 3> n{0, 0, 1};
    std::array<double, 2> sides{1, 1};
    if (const pugi::xml_node normal = node.child("normal"); normal && ReadNumbers(normal, &n)) {
      const Vector3d direction(n[0], n[1], n[2]);
      if (!(direction.norm() > 1e-9)) {
        Error(normal, "a normal of length zero");
        return;
      }
      // Of all rotations that bring z to the normal the shortest is taken; how the plane is turned
      // about its normal only matters to the rectangle that is drawn.
      obstacle->X_WO.linear() *= Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), direction)
                                     .normalized()
                                     .toRotationMatrix();
    }
    if (const pugi::xml_node size = node.child("size")) ReadNumbers(size, &sides);
    obstacle->size = Vector3d(std::abs(sides[0]), std::abs(sides[1]), 0);
  }

  /// Three numbers in a child element; `absent` if there is none, and after an error.
  Vector3d ReadTriple(const pugi::xml_node& parent, const char* key, const Vector3d& absent) {
    std::array<double, 3> n{};
    const pugi::xml_node node = parent.child(key);
    if (!node || !ReadNumbers(node, &n)) return absent;
    return {n[0], n[1], n[2]};
  }

  /// The uri of a mesh or height map, once what it names is at hand; nothing after an error.
  std::optional<std::string> ReadSurface(const pugi::xml_node& parent, SurfaceKind kind) {
    const pugi::xml_node node = parent.child("uri");
    std::string uri = node.child_value();
    uri.erase(0, std::min(uri.find_first_not_of(" \t\r\n"), uri.size()));
    uri.erase(uri.find_last_not_of(" \t\r\n") + 1);
    if (uri.empty()) {
      Error(node ? node : parent, fmt::format("<{}> needs <uri>", parent.name()));
      return std::nullopt;
    }
    // Other schemes name packages or servers, which a reader would have to look for outside of the
    // world's folder.
    const size_t scheme = uri.find("://");
    if (scheme != std::string::npos && uri.compare(0, scheme, "file") != 0) {
      Error(node, fmt::format("a uri of '{}' is not supported", uri.substr(0, scheme + 3))).hint =
          "give a path relative to this file";
      return std::nullopt;
    }
    // A file that several elements name is loaded once.
    if (kind == SurfaceKind::kMesh ? surfaces_.meshes.count(uri) > 0
                                   : surfaces_.heights.count(uri) > 0) {
      return uri;
    }
    // Without a loader all surfaces must have come with the description.
    const Result<void> loaded =
        load_ ? load_(kind, uri, &surfaces_) : Fail(fmt::format("'{}' is not at hand", uri));
    if (loaded) return uri;
    Error(node, loaded.error().message);
    return std::nullopt;
  }

  /// Takes the triangles, unless they are too many or lie too far away.
  void Take(const pugi::xml_node& node, TriangleMesh mesh, Obstacle* obstacle) {
    // Counted per obstacle and not per file: the physics has each of them.
    triangles_ += mesh.triangles.size();
    if (triangles_ > kMaxTriangles) {
      Error(node, fmt::format("with this the world has more than {} triangles", kMaxTriangles));
      return;
    }
    for (const Vector3d& p : mesh.points) {
      if (p.cwiseAbs().maxCoeff() <= kMaxLength_m) continue;
      Error(node, fmt::format("it reaches more than {:g} m away", kMaxLength_m));
      return;
    }
    obstacle->shape = Shape::kMesh;
    obstacle->mesh = std::make_shared<const TriangleMesh>(std::move(mesh));
  }

  void ReadMesh(const pugi::xml_node& node, Obstacle* obstacle) {
    for (const pugi::xml_node& child : node.children()) Refuse(child, {"uri", "scale"});
    const std::string_view optimization = node.attribute("optimization").value();
    if (!optimization.empty()) {
      Error(node, fmt::format("optimization '{}' is not supported", optimization)).hint =
          "a mesh is its triangles";
    }
    // Negative factors mirror the mesh, which Scaled bears; 0 would flatten it to a surface without
    // outside.
    const Vector3d scale = ReadTriple(node, "scale", Vector3d::Ones());
    if (!(scale.cwiseAbs().minCoeff() > 1e-9)) {
      Error(node.child("scale"), "a scale is not 0");
      return;
    }
    const std::optional<std::string> uri = ReadSurface(node, SurfaceKind::kMesh);
    if (uri) Take(node, Scaled(surfaces_.meshes.at(*uri), scale), obstacle);
  }

  /// Textures and blends are only seen, and how finely others sample is theirs.
  void ReadHeightMap(const pugi::xml_node& node, Obstacle* obstacle) {
    for (const pugi::xml_node& child : node.children()) {
      Refuse(child, {"uri", "size", "pos", "texture", "blend", "use_terrain_paging", "sampling"});
    }
    const Vector3d size = ReadTriple(node, "size", Vector3d::Ones());
    if (!(size.minCoeff() >= kLeastLength_m)) {
      Error(node.child("size"),
            fmt::format("the sides of a height map are at least {:g} metres", kLeastLength_m));
      return;
    }
    const Vector3d pos = ReadTriple(node, "pos", Vector3d::Zero());
    const std::optional<std::string> uri = ReadSurface(node, SurfaceKind::kHeights);
    if (uri) Take(node, MeshOf(surfaces_.heights.at(*uri), size, pos), obstacle);
  }

  std::string_view text_;
  int file_;
  const SurfaceLoader& load_;
  Surfaces& surfaces_;
  size_t triangles_ = 0;  ///< Of all meshes so far.
  source::Diagnostics& diagnostics_;
  std::vector<Obstacle> obstacles_;
  std::optional<double> ground_friction_;
};

/// Reads the world in file `file`; `world->surfaces` may hold surfaces already.
bool ReadWorld(const source::SourceSet& sources, int file, const SurfaceLoader& load,
               SdfWorld* world, source::Diagnostics* diagnostics) {
  const int errors = diagnostics->error_count();
  source::CheckUtf8(sources, file, diagnostics);
  // pugixml does not look whether what it reads is UTF-8, and names go into messages and JSON.
  if (errors != diagnostics->error_count()) return false;
  const std::string_view text = sources.text(file);
  WorldReader reader(sources, file, load, &world->surfaces, diagnostics);
  pugi::xml_document document;
  const pugi::xml_parse_result parsed =
      document.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!parsed) {
    reader.ErrorAt(parsed.offset, fmt::format("this is no XML: {}", parsed.description()));
    return false;
  }
  world->obstacles = reader.Read(document);
  world->ground_friction = reader.ground_friction();
  return errors == diagnostics->error_count();
}

}  // namespace

std::optional<SdfWorld> ReadSdfWorld(const source::SourceSet& sources, int file,
                                     const SurfaceLoader& load, source::Diagnostics* diagnostics) {
  SdfWorld world;
  if (!ReadWorld(sources, file, load, &world, diagnostics)) return std::nullopt;
  return world;
}

Result<std::vector<Obstacle>> ReadSdfText(const std::string& text, Surfaces surfaces) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  SdfWorld world;
  world.surfaces = std::move(surfaces);
  // FilesBeside checks what it loads; what a log's description holds may be damaged.
  for (const auto& [uri, mesh] : world.surfaces.meshes) {
    if (Result<void> good = Check(mesh); !good) return Fail(uri + " " + good.error().message);
  }
  for (const auto& [uri, heights] : world.surfaces.heights) {
    if (Result<void> good = Check(heights); !good) return Fail(uri + " " + good.error().message);
  }
  if (ReadWorld(sources, sources.AddText("world", text), {}, &world, &diagnostics)) {
    return std::move(world.obstacles);
  }
  const source::Diagnostic& first = diagnostics.all().front();
  return Fail(fmt::format("line {}: {}", sources.Locate(0, first.span.begin).line, first.message));
}

}  // namespace morphbus::world
