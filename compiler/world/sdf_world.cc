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

// Bounds on what a file may ask of the simulator, far above any real world.
constexpr size_t kMaxObstacles = 10'000;
constexpr double kMaxLength_m = 1e5;
constexpr int kMaxNesting = 100;

/// SDFormat's world frame in W: x stays, z becomes y, y becomes -z.
Pose FromZUp() {
  Pose X_WS = Pose::Identity();
  X_WS.linear() << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return X_WS;
}

/// Walks the elements of one world.
class WorldReader {
 public:
  WorldReader(const source::SourceSet& sources, int file, source::Diagnostics* diagnostics)
      : text_(sources.text(file)), file_(file), diagnostics_(*diagnostics) {}

  std::vector<Obstacle> Read(const pugi::xml_document& document) {
    const pugi::xml_node root = document.document_element();
    if (std::string_view(root.name()) != "sdf") {
      Error(root, "this is no SDFormat: its element is not <sdf>").hint =
          "a world is written as <sdf version=\"1.9\"><world name=\"...\">...</world></sdf>";
      return {};
    }
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
    for (double& number : *numbers) {
      skip();
      if (at != end && *at == '+') ++at;
      const std::from_chars_result read = std::from_chars(at, end, number);
      if (read.ec != std::errc() || !(std::abs(number) <= kMaxLength_m)) {
        Error(node, fmt::format("<{}> needs {} number{}, each at most {:g}", node.name(), N,
                                N == 1 ? "" : "s", kMaxLength_m));
        return false;
      }
      at = read.ptr;
    }
    skip();
    if (at == end) return true;
    Error(node, fmt::format("<{}> has more than {} number{}", node.name(), N, N == 1 ? "" : "s"));
    return false;
  }

  /// The pose of an element in its parent: x y z roll pitch yaw, in radians unless it says degrees.
  Pose ReadPose(const pugi::xml_node& parent) {
    const pugi::xml_node node = parent.child("pose");
    if (!node) return Pose::Identity();
    const std::string_view base = node.attribute("relative_to").value();
    if (!base.empty() && base != "world" && base != "__model__") {
      Error(node, fmt::format("a pose relative to '{}' is not supported", base)).hint =
          "give the pose in its parent";
    }
    const std::string_view format = node.attribute("rotation_format").value();
    Pose X = Pose::Identity();
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
    const Pose X_WM = X_WP * ReadPose(node);
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
    const Pose X_WL = X_WM * ReadPose(node);
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
    // Exactly one shape.
    pugi::xml_node shape;
    for (const pugi::xml_node& child : node.child("geometry").children()) {
      if (child.type() == pugi::node_element && !shape) shape = child;
    }
    if (!shape) {
      Error(node, "a <collision> without <geometry>").hint =
          "shapes are box, cylinder, sphere, plane";
      return;
    }
    if (!ReadShape(shape, &obstacle)) return;
    // The ground is there already.
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
    if (!mu || !ReadNumbers(mu, &number)) return std::nullopt;
    if (number[0] >= 0 && number[0] <= 10) return number[0];
    Error(mu, "friction is from 0 to 10");
    return std::nullopt;
  }

  /// A length above 0 in a child element; 1 after an error.
  double ReadLength(const pugi::xml_node& parent, const char* key) {
    const pugi::xml_node node = parent.child(key);
    std::array<double, 1> number{1.0};
    if (!node) {
      Error(parent, fmt::format("<{}> needs <{}>", parent.name(), key));
    } else if (ReadNumbers(node, &number) && !(number[0] > 1e-6)) {
      Error(node, fmt::format("<{}> is above 0", key));
    }
    return number[0];
  }

  bool ReadShape(const pugi::xml_node& node, Obstacle* obstacle) {
    const int errors = diagnostics_.error_count();
    const std::string_view shape = node.name();
    if (shape == "box") {
      obstacle->shape = Shape::kBox;
      std::array<double, 3> sides{1, 1, 1};
      const pugi::xml_node size = node.child("size");
      if (!size) {
        Error(node, "<box> needs <size>");
      } else if (ReadNumbers(size, &sides) && !(std::min({sides[0], sides[1], sides[2]}) > 1e-6)) {
        Error(size, "the sides of a box are above 0");
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
    } else {
      Error(node, fmt::format("a <{}> is not supported", shape)).hint =
          "shapes are box, cylinder, sphere, plane; terrain is made of those";
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
      obstacle->X_WO.linear() *= Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), direction)
                                     .normalized()
                                     .toRotationMatrix();
    }
    if (const pugi::xml_node size = node.child("size")) ReadNumbers(size, &sides);
    obstacle->size = Vector3d(std::abs(sides[0]), std::abs(sides[1]), 0);
  }

  std::string_view text_;
  int file_;
  source::Diagnostics& diagnostics_;
  std::vector<Obstacle> obstacles_;
  std::optional<double> ground_friction_;
};

}  // namespace

std::optional<std::vector<Obstacle>> ReadSdfWorld(const source::SourceSet& sources, int file,
                                                  std::optional<double>* ground_friction,
                                                  source::Diagnostics* diagnostics) {
  const int errors = diagnostics->error_count();
  source::CheckUtf8(sources, file, diagnostics);
  if (errors != diagnostics->error_count()) return std::nullopt;
  const std::string_view text = sources.text(file);
  WorldReader reader(sources, file, diagnostics);
  pugi::xml_document document;
  const pugi::xml_parse_result parsed =
      document.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!parsed) {
    reader.ErrorAt(parsed.offset, fmt::format("this is no XML: {}", parsed.description()));
    return std::nullopt;
  }
  std::vector<Obstacle> obstacles = reader.Read(document);
  if (errors != diagnostics->error_count()) return std::nullopt;
  if (ground_friction != nullptr) *ground_friction = reader.ground_friction();
  return obstacles;
}

Result<std::vector<Obstacle>> ReadSdfText(const std::string& text) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  std::optional<std::vector<Obstacle>> obstacles =
      ReadSdfWorld(sources, sources.AddText("world", text), nullptr, &diagnostics);
  if (obstacles) return std::move(*obstacles);
  const source::Diagnostic& first = diagnostics.all().front();
  return Fail(fmt::format("line {}: {}", sources.Locate(0, first.span.begin).line, first.message));
}

}  // namespace morphbus::world
