#include "compiler/congruence/first_mapping.h"

#include <algorithm>

#include "compiler/congruence/mapping_builder.h"

namespace morphbus::congruence {
namespace {

/// So many mappings are made at most to find the first by name.
constexpr int kMaxMade = 64;

std::optional<Mapping> BuildFrom(MappingBuilder& builder, int body, const Place& place) {
  if (!builder.Build(body, place)) return std::nullopt;
  Mapping mapping = builder.matched().ToMapping();
  builder.Clear();
  return mapping;
}

/// The mapping that leaves the root link's body where it is, as seen from the robot frame.
std::optional<Mapping> BuildInFrame(MappingBuilder& builder) {
  const Correspondence& matched = builder.matched();
  const int root = matched.a().RootBody();
  const int root_b = matched.b().RootBody();
  const Eigen::Vector3d moved = matched.a().bodies[root].p_RoTo - matched.b().bodies[root_b].p_RoTo;
  if (moved.norm() > matched.length_tolerance()) return std::nullopt;
  return BuildFrom(builder, root, {root_b, Eigen::Matrix3d::Identity()});
}

/// Any mapping.
std::optional<Mapping> BuildAny(MappingBuilder& builder) {
  const int seed = SeedBody(builder.matched().classes(), builder.pieces().a);
  if (seed < 0) return std::nullopt;
  for (const Place& place : PlacesOf(builder.matched(), builder.pieces().a, seed)) {
    if (std::optional<Mapping> mapping = BuildFrom(builder, seed, place)) return mapping;
  }
  return std::nullopt;
}

/// A body with a joint of the first module, the place of which is one of a few; -1 if there is
/// none.
int BodyOfFirstModule(const ScrewGraph& a, const Decomposition& pieces) {
  for (const ScrewJoint& j : a.joints) {
    if (j.module != 0) continue;
    for (const int body : {j.body_b, j.body_a}) {
      if (!pieces.coaxial[body]) return body;
    }
  }
  return -1;
}

/// The name of the module that the first module goes to if `body` goes to `place`: that which has
/// a joint where the first module's joint at the body comes to lie.
std::string NameAt(const Correspondence& matched, int body, const Place& place) {
  const ScrewGraph& a = matched.a();
  const ScrewGraph& b = matched.b();
  const std::vector<int>& joints = a.bodies[body].joints;
  const int joint =
      *std::find_if(joints.begin(), joints.end(), [&](int j) { return a.joints[j].module == 0; });
  const Eigen::Vector3d foot = place.R * a.FootFrom(body, joint);
  const Eigen::Vector3d axis = place.R * a.joints[joint].axis;
  std::string name;
  for (const int to : b.bodies[place.image].joints) {
    if (!matched.MayCorrespond(joint, to)) continue;
    const bool there = (b.FootFrom(place.image, to) - foot).norm() <= matched.length_tolerance() &&
                       axis.cross(b.joints[to].axis).norm() <= kGeometryTolerance;
    const std::string& other = b.robot->modules[b.joints[to].module].name;
    if ((there || a.joints[joint].slide) && (name.empty() || other < name)) name = other;
  }
  return name;
}

/// The first by ComesBefore of the mappings that take the first module to the first name that it
/// can go to. Nothing if there is no mapping, or no body of the first module to begin with.
std::optional<Mapping> BuildByName(MappingBuilder& builder) {
  const Correspondence& matched = builder.matched();
  const int body = BodyOfFirstModule(matched.a(), builder.pieces().a);
  if (body < 0) return std::nullopt;
  std::vector<std::pair<std::string, Place>> places;
  for (const Place& place : PlacesOf(matched, builder.pieces().a, body)) {
    places.emplace_back(NameAt(matched, body, place), place);
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const auto& x, const auto& y) { return x.first < y.first; });

  std::optional<Mapping> best;
  std::string name;
  int made = 0;
  for (const auto& [name_here, place] : places) {
    // Places of one name are tried against each other; the next name only if all take the module
    // apart.
    if (best && best->module_to[0] >= 0 && name_here != name) break;
    std::optional<Mapping> mapping = BuildFrom(builder, body, place);
    if (!mapping) continue;
    name = name_here;
    if (!best || ComesBefore(*matched.b().robot, *mapping, *best)) best = std::move(mapping);
    if (++made == kMaxMade) break;
  }
  return best;
}

}  // namespace

bool ComesBefore(const model::Robot& b, const Mapping& x, const Mapping& y) {
  if (x.keeps_frame != y.keeps_frame) return x.keeps_frame;
  for (size_t m = 0; m < x.module_to.size(); ++m) {
    const int to_x = x.module_to[m];
    const int to_y = y.module_to[m];
    if (to_x == to_y) continue;
    if (to_x < 0 || to_y < 0) return to_x >= 0;
    return b.modules[to_x].name < b.modules[to_y].name;
  }
  // The same modules: some order, always the same one.
  for (size_t j = 0; j < x.joints.size(); ++j) {
    if (x.joints[j].to != y.joints[j].to) return x.joints[j].to < y.joints[j].to;
    if (x.joints[j].sign != y.joints[j].sign) return x.joints[j].sign > y.joints[j].sign;
  }
  return false;
}

std::optional<Mapping> MappingInFrame(const ScrewGraph& a, const ScrewGraph& b,
                                      const Classes& classes, Steps& steps) {
  MappingBuilder builder(a, b, classes, steps);
  return BuildInFrame(builder);
}

std::optional<Mapping> FirstMapping(const ScrewGraph& a, const ScrewGraph& b,
                                    const Classes& classes, Steps& steps) {
  MappingBuilder builder(a, b, classes, steps);
  if (std::optional<Mapping> in_frame = BuildInFrame(builder)) return in_frame;
  // Whether there is any is decided from the body that has the fewest places.
  std::optional<Mapping> any = BuildAny(builder);
  if (!any) return std::nullopt;
  std::optional<Mapping> by_name = BuildByName(builder);
  return by_name ? by_name : any;
}

}  // namespace morphbus::congruence
