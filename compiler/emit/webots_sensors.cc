#include "compiler/emit/webots_sensors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "compiler/model/link_mass.h"

namespace morphbus::emit {
namespace {

using Eigen::Vector3d;
using model::ConvexHull;

constexpr double kPadThickness = 1e-3;  // m
constexpr double kTokenBall = 1e-3;     // m
/// m/s²; more is cut off.
constexpr double kMostAcceleration = 100;

/// A frame whose x looks where the sensor does, at its place.
model::Pose FrameOf(const model::Sensor& sensor) {
  model::Pose X_LS = model::Pose::Identity();
  // How the frame is turned about its x does not matter to a ray, nor to a cube of the range.
  const Vector3d side = sensor.direction.unitOrthogonal();
  X_LS.linear() << sensor.direction, side, sensor.direction.cross(side);
  X_LS.translation() = sensor.p_MoSo_M;
  return X_LS;
}

/// What of a convex polygon lies on the inner side of a plane, where normal · p <= offset
/// (Sutherland and Hodgman 1974).
std::vector<Vector3d> Cut(const std::vector<Vector3d>& polygon, const Vector3d& normal,
                          double offset) {
  std::vector<Vector3d> kept;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vector3d& a = polygon[i];
    const Vector3d& b = polygon[(i + 1) % polygon.size()];
    const double out_a = normal.dot(a) - offset, out_b = normal.dot(b) - offset;
    if (out_a <= 0) kept.push_back(a);
    // The edge crosses the plane: the point that parts it in the ratio of both distances lies on
    // it.
    if ((out_a < 0) != (out_b < 0) && out_a != out_b) {
      kept.push_back(a + (b - a) * (out_a / (out_a - out_b)));
    }
  }
  return kept;
}

/// What of it lies within the sensor's range, in a cube.
std::vector<Vector3d> WithinRange(const model::Sensor& sensor, std::vector<Vector3d> polygon) {
  if (sensor.range_m <= 0) return polygon;
  const model::Pose X_LS = FrameOf(sensor);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      const Vector3d normal = sign * X_LS.linear().col(axis);
      // Six cuts, one for each side of the cube whose half side is the range.
      polygon = Cut(polygon, normal, normal.dot(sensor.p_MoSo_M) + sensor.range_m);
    }
  }
  return polygon;
}

/// A convex body as a geometry without a name.
std::string FaceSet(const ConvexHull& hull) {
  return fmt::format("IndexedFaceSet {{ {} }}", fmt::join(VrmlWriter::FacesOf(hull), " "));
}

void AppendTouchSensor(const model::Sensor& sensor, const std::vector<ConvexHull>& pads,
                       VrmlWriter* vrml) {
  vrml->Open("TouchSensor {");
  vrml->Line(fmt::format("name \"{}.sensor\"", sensor.name));
  vrml->Line("type \"bumper\"");
  // A sensor that looks at nothing of its link gets a small ball, since Webots demands a shape.
  if (pads.empty()) {
    vrml->Line("translation " + Triple(sensor.p_MoSo_M));
    vrml->Line(fmt::format("boundingObject Sphere {{ radius {} }}", Number(kTokenBall)));
  } else if (pads.size() == 1) {
    vrml->Line("boundingObject " + FaceSet(pads.front()));
  } else {
    std::vector<std::string> shapes = {"children ["};
    for (const ConvexHull& pad : pads) {
      shapes.push_back(fmt::format("  Shape {{ geometry {} }}", FaceSet(pad)));
    }
    shapes.emplace_back("]");
    vrml->Block("boundingObject Group", shapes);
  }
  vrml->Close("}");
}

}  // namespace

std::vector<ConvexHull> ContactPads(const model::Sensor& sensor,
                                    const std::vector<ConvexHull>& parts) {
  std::vector<ConvexHull> pads;
  for (const ConvexHull& part : parts) {
    if (part.dimension < 3) continue;
    // The corners of the faces that look there.
    std::vector<Vector3d> corners;
    for (const model::HullFace& face : part.faces) {
      // Within 45 degrees of where it looks, as in our own simulator.
      if (face.normal.dot(sensor.direction) < std::numbers::sqrt2 / 2 - 1e-9) continue;
      std::vector<Vector3d> polygon;
      for (const int corner : face.polygon) polygon.push_back(part.vertices[corner]);
      for (const Vector3d& p : WithinRange(sensor, std::move(polygon))) corners.push_back(p);
    }
    // The pad stands out, so that it touches before the link does.
    const size_t count = corners.size();
    for (size_t i = 0; i < count; ++i) {
      corners.emplace_back(corners[i] + kPadThickness * sensor.direction);
    }
    ConvexHull pad = model::ComputeHull(corners);
    if (pad.dimension == 3) pads.push_back(std::move(pad));
  }
  return pads;
}

std::string NoisyTable(double least, double most, double noise) {
  // From most downwards, then 0, and the same below it.
  constexpr double kRatio = 1.5;
  std::vector<double> positive;
  // Rows get closer towards 0, where the share of noise changes fastest; below a hundredth of the
  // range the nearest row counts.
  for (double x = most; x > 0.01 * most; x /= kRatio) positive.push_back(x);
  if (noise <= 0) positive = {most};
  std::vector<double> inputs = {0};
  for (const double x : positive) {
    inputs.push_back(x);
    if (least < 0) inputs.push_back(-x);
  }
  std::sort(inputs.begin(), inputs.end());
  // At 0 what the nearest row has; it is multiplied by the value.
  std::string rows;
  for (const double x : inputs) {
    // A row of Webots is value, reading and noise, the last one as a share of the reading.
    const double share = noise <= 0 ? 0 : noise / (x == 0 ? positive.back() : std::abs(x));
    rows +=
        fmt::format("{}{} {} {}", rows.empty() ? "" : ", ", Number(x), Number(x), Number(share));
  }
  return "lookupTable [ " + rows + " ]";
}

void AppendWebotsSensor(const model::Sensor& sensor, const std::vector<ConvexHull>& parts,
                        VrmlWriter* vrml) {
  switch (sensor.type) {
    case model::SensorType::kDistance:
      // What it measures is in metres.
      vrml->Open("DistanceSensor {");
      vrml->Place(FrameOf(sensor));
      vrml->Line(fmt::format("name \"{}.sensor\"", sensor.name));
      vrml->Line("type \"laser\"");
      vrml->Line(NoisyTable(0, sensor.range_m, sensor.noise));
      vrml->Close("}");
      break;
    case model::SensorType::kContact:
      AppendTouchSensor(sensor, ContactPads(sensor, parts), vrml);
      break;
    case model::SensorType::kTilt:
      // A turn by so much moves the reading by so much of gravity.
      vrml->Open("Accelerometer {");
      vrml->Line(fmt::format("name \"{}.sensor\"", sensor.name));
      if (sensor.noise > 0) {
        vrml->Line(
            NoisyTable(-kMostAcceleration, kMostAcceleration, model::kGravity * sensor.noise));
      }
      vrml->Close("}");
      break;
  }
}

}  // namespace morphbus::emit
