#include "compiler/model/looks_proto.h"

#include <fmt/format.h>

#include <cmath>

#include "compiler/model/visual_limits.h"

namespace morphbus::model {
namespace {

/// Eight bits of each color, the red ones highest.
uint32_t BitsOf(const Color& color) {
  uint32_t bits = 0;
  for (const double c : color) bits = bits << 8u | static_cast<uint32_t>(std::lround(c * 255.0));
  return bits;
}

Color ColorOf(uint32_t bits) {
  return {(bits >> 16u & 255u) / 255.0, (bits >> 8u & 255u) / 255.0, (bits & 255u) / 255.0};
}

void Write(const VisualPart& part, proto::VisualPart* out) {
  for (const Eigen::Vector3d& p : part.points) {
    for (int k = 0; k < 3; ++k) out->add_points(static_cast<float>(p[k]));
  }
  for (const std::array<int, 3>& triangle : part.triangles) {
    for (const int corner : triangle) out->add_corners(static_cast<uint32_t>(corner));
  }
  if (part.color) out->set_color(BitsOf(*part.color));
}

/// Reads one part; what is wrong with it, or nothing.
std::string Read(const proto::VisualPart& message, VisualPart* part) {
  if (message.points_size() == 0 || message.points_size() % 3 != 0) return "points";
  for (int i = 0; i < message.points_size(); i += 3) {
    part->points.emplace_back(message.points(i), message.points(i + 1), message.points(i + 2));
    const Eigen::Vector3d& p = part->points.back();
    // The greatest of numbers of which one is none may be any of the others.
    if (!p.allFinite() || p.cwiseAbs().maxCoeff() > kMaxVisualReach_m) return "points far away";
  }
  if (message.corners_size() % 3 != 0) return "corners";
  for (int i = 0; i < message.corners_size(); i += 3) {
    std::array<int, 3>& triangle = part->triangles.emplace_back();
    for (int k = 0; k < 3; ++k) {
      const uint32_t corner = message.corners(i + k);
      if (corner >= part->points.size()) return fmt::format("corner {}", corner);
      triangle[k] = static_cast<int>(corner);
    }
  }
  if (message.has_color()) {
    if (message.color() > 0xffffffu) return fmt::format("color {:#x}", message.color());
    part->color = ColorOf(message.color());
  }
  return {};
}

}  // namespace

void WriteLooks(const Model& model, proto::Model* message) {
  for (size_t t = 0; t < model.module_types.size(); ++t) {
    const std::vector<Link>& links = model.module_types[t].links;
    for (size_t l = 0; l < links.size(); ++l) {
      if (links[l].visual.empty()) continue;
      proto::LinkLooks* looks = message->add_looks();
      looks->set_type(static_cast<uint32_t>(t));
      looks->set_link(static_cast<uint32_t>(l));
      for (const VisualPart& part : links[l].visual) Write(part, looks->add_parts());
    }
  }
}

std::string ReadLooks(const proto::Model& message, Model* model) {
  size_t size_of_model = 0;
  for (int i = 0; i < message.looks_size(); ++i) {
    const proto::LinkLooks& looks = message.looks(i);
    const auto bad = [&](const std::string& what) { return fmt::format("looks {}: {}", i, what); };
    // The message says which link it is about, once each.
    if (looks.type() >= model->module_types.size()) {
      return bad(fmt::format("module type {} of {}", looks.type(), model->module_types.size()));
    }
    std::vector<Link>& links = model->module_types[looks.type()].links;
    if (looks.link() >= links.size()) {
      return bad(fmt::format("link {} of {}", looks.link(), links.size()));
    }
    Link& link = links[looks.link()];
    if (!link.visual.empty()) return bad("a link for the second time");
    if (looks.parts_size() == 0 || looks.parts_size() > static_cast<int>(kMaxVisualParts)) {
      return bad(fmt::format("{} parts", looks.parts_size()));
    }
    // Counted before anything is made of it.
    size_t size = 0;
    for (const proto::VisualPart& part : looks.parts()) {
      size += static_cast<size_t>(part.points_size() / 3 + part.corners_size() / 3);
    }
    size_of_model += size;
    if (size > kMaxVisualSize || size_of_model > kMaxVisualSizeOfModel) {
      return bad(fmt::format("{} points and triangles", size));
    }
    for (const proto::VisualPart& part : looks.parts()) {
      if (const std::string wrong = Read(part, &link.visual.emplace_back()); !wrong.empty()) {
        return bad(wrong);
      }
    }
  }
  return {};
}

}  // namespace morphbus::model
