#include "logger/compare/matcher.h"

#include <algorithm>
#include <map>
#include <set>

#include "bridge/description/run_model.h"
#include "compiler/model/forward_kinematics.h"

namespace morphbus::logger {
namespace {

/// Joint axes that lie closer than this (m, and cosine of their angle) are the same axis; links and
/// connectors that lie closer are at the same place.
constexpr double kSamePlaceM = 1e-3;
constexpr double kSameAxisCos = 0.9998;
/// Distances that differ by less are equal; then the order of declaration decides.
constexpr double kTieM = 1e-6;

/// One log with what matching needs of it: the poses X_RL of all its links at rest.
struct Side {
  const RunLog& log;
  const RestPoses& X_RL = log.described->X_RL_start;
};

/// A module of one log, its type, and where its parts lie in the robot frame at rest (m).
struct Member {
  const ModuleSeries& module;
  const model::ModuleType& type;
  const std::vector<model::Pose>& X_RL;

  Member(const Side& side, int index)
      : module(side.log.modules[index]),
        type(side.log.model->TypeOf(*side.log.robot, module.model_index)),
        X_RL(side.X_RL[module.model_index]) {}
  [[nodiscard]] Eigen::Vector3d LinkPlace(int link) const {
    return X_RL[link] * LinkCentre(type.links[link]);
  }
  [[nodiscard]] Eigen::Vector3d ConnectorPlace(int connector) const {
    const model::Connector& c = type.connectors[connector];
    return X_RL[c.link] * c.p_MoCo_M;
  }
};

/// One module with the role it is matched by, when it took it (sim time in µs; -1 without one), and
/// where it then was: the mean of its links' centres in R (m).
struct Holder {
  int module = 0;
  std::string role;
  std::vector<RoleSpan> spans;
  int64_t taken_us = -1;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
};

/// Where a module is in the robot frame at `time_us`, by its own account; at rest if it has none.
Eigen::Vector3d PlaceAt(const Member& member, int64_t time_us) {
  const auto& transforms = member.module.transforms;
  auto sample = std::ranges::lower_bound(transforms, time_us, {}, &TransformSample::time_us);
  // A module that took its role before it knew its pose is placed by the first pose after that.
  while (sample != transforms.end() && !sample->has_pose) ++sample;
  const int num_links = static_cast<int>(member.type.links.size());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  // Links whose pose is not told are taken from the model at rest.
  for (int l = 0; l < num_links; ++l) {
    const bool told = sample != transforms.end() && l < static_cast<int>(sample->X_RL.size());
    sum += told ? ToPose(sample->X_RL[l]) * LinkCentre(member.type.links[l]) : member.LinkPlace(l);
  }
  return num_links == 0 ? sum : Eigen::Vector3d(sum / num_links);
}

/// Finds the role by which a module is matched, and where it was when it took it.
Holder HolderOf(const Side& side, int index, int64_t end_us) {
  const Member member(side, index);
  Holder holder;
  holder.module = index;
  holder.spans = RoleSpans(member.module, end_us);
  // How long it held each role, µs.
  std::map<std::string, int64_t> held;
  for (const RoleSpan& span : holder.spans) {
    // The last span may begin at the very end: it still counts more than never having had a role.
    if (!span.role.empty()) held[span.role] += span.end_us - span.begin_us + 1;
  }
  // The role that was held longest; of equals the first by name.
  int64_t longest = 0;
  for (const auto& [role, time] : held) {
    if (time <= longest) continue;
    longest = time;
    holder.role = role;
  }
  if (!holder.role.empty()) holder.taken_us = *FirstTaken(holder.spans, holder.role);
  holder.place = PlaceAt(member, std::max<int64_t>(holder.taken_us, 0));
  return holder;
}

using Holders = std::map<std::string, std::vector<Holder>>;  ///< By role.

/// All modules of a log by role.
Holders HoldersOf(const Side& side, int64_t end_us) {
  Holders holders;
  for (size_t i = 0; i < side.log.modules.size(); ++i) {
    if (side.log.modules[i].model_index < 0) continue;
    Holder holder = HolderOf(side, static_cast<int>(i), end_us);
    holders[holder.role].push_back(std::move(holder));
  }
  return holders;
}

/// The labels of the module's matched role, as it last resolved them; none if it never had it.
RoleSpan LabelsOf(const std::vector<RoleSpan>& spans, const std::string& role) {
  for (auto span = spans.rbegin(); span != spans.rend(); ++span) {
    if (!role.empty() && span->role == role) return *span;
  }
  return {};
}

/// The link of B whose centre lies nearest to that of A's link at rest; of equals the one of its
/// name.
int NearestLink(const Member& a, int link_a, const Member& b) {
  const Eigen::Vector3d centre = a.LinkPlace(link_a);
  // Only a clearly smaller distance wins, so that float noise does not decide.
  int best = 0;
  double best_distance = 0.0;
  for (int l = 0; l < static_cast<int>(b.type.links.size()); ++l) {
    const double distance = (b.LinkPlace(l) - centre).norm();
    const bool tie = l > 0 && std::abs(distance - best_distance) < kTieM;
    if (l == 0 || distance < best_distance - kTieM ||
        (tie && b.type.links[l].name == a.type.links[link_a].name)) {
      best = l;
      best_distance = distance;
    }
  }
  return best;
}

/// +1 or -1 if the two joints turn (slide) along one line, the sign that maps B's value onto A's;
/// 0 if they do not. A joint turns link_a against link_b, so it matters which of them lies where.
int AxisSign(const Member& a, int joint_a, const Member& b, int joint_b) {
  const model::Joint& ja = a.type.joints[joint_a];
  const model::Joint& jb = b.type.joints[joint_b];
  const bool slides = ja.type == model::JointType::kPrismatic;
  if (slides != (jb.type == model::JointType::kPrismatic)) return 0;
  // The two axes, in R at rest, must be parallel, and for turning joints one line.
  const model::Pose& X_RA = a.X_RL[ja.link_b];
  const model::Pose& X_RB = b.X_RL[jb.link_b];
  const Eigen::Vector3d axis = X_RA.linear() * ja.axis;
  const double cosine = axis.dot(X_RB.linear() * jb.axis);
  if (std::abs(cosine) < kSameAxisCos) return 0;
  const Eigen::Vector3d apart = X_RB * jb.p_MoJo_M - X_RA * ja.p_MoJo_M;
  if (!slides && apart.cross(axis).norm() > kSamePlaceM) return 0;
  // If A's first link lies where B's second does, the joint is measured the other way round.
  const auto distance = [&](int link_a, int link_b) {
    return (a.LinkPlace(link_a) - b.LinkPlace(link_b)).norm();
  };
  const double straight = distance(ja.link_a, jb.link_a) + distance(ja.link_b, jb.link_b);
  const double crossed = distance(ja.link_a, jb.link_b) + distance(ja.link_b, jb.link_a);
  const int sign = cosine > 0 ? 1 : -1;
  return crossed < straight - kTieM ? -sign : sign;
}

/// A pair of joints with all that is known of it.
JointPair MakeJointPair(const Member& a, const Member& b, const std::string& label, bool labelled,
                        int joint_a, int joint_b) {
  const bool slides = a.type.joints[joint_a].type == model::JointType::kPrismatic;
  const bool convention =
      JointSigns(a.module, joint_a).ever() && JointSigns(b.module, joint_b).ever();
  const int sign = AxisSign(a, joint_a, b, joint_b);
  return {label, labelled, joint_a, joint_b, slides, convention, sign == 0 ? 1 : sign};
}

/// Calls add(label, index_a, index_b) for what both resolved under one label; `count_a` and
/// `count_b` are how many joints or links the module types have.
template <class Add>
void PairLabels(const std::map<std::string, int>& in_a, size_t count_a,
                const std::map<std::string, int>& in_b, size_t count_b, ModulePair* pair,
                const Add& add) {
  // Both sides must know the label, and its index must be one of the module type's.
  for (const auto& [label, index_a] : in_a) {
    const auto found = in_b.find(label);
    if (found == in_b.end()) {
      pair->labels_missing_b.push_back(label);
    } else if (bridge::IsIndex(index_a, count_a) && bridge::IsIndex(found->second, count_b)) {
      add(label, index_a, found->second);
    } else {
      pair->unpaired.push_back("label '" + label + "'");
    }
  }
  for (const auto& [label, index_b] : in_b) {
    if (!in_a.contains(label)) pair->labels_missing_a.push_back(label);
  }
}

/// Pairs joints without a label whose axes coincide, those of one name first.
void PairOtherJoints(const Member& a, const Member& b, ModulePair* pair) {
  // What labels paired is not paired again.
  std::set<int> used_a, used_b;
  for (const JointPair& joint : pair->joints) {
    used_a.insert(joint.joint_a);
    used_b.insert(joint.joint_b);
  }
  const auto& joints_a = a.type.joints;
  const auto& joints_b = b.type.joints;
  // Each joint of A takes the free one of B on the same axis, by preference of the same name.
  for (int ja = 0; ja < static_cast<int>(joints_a.size()); ++ja) {
    if (used_a.contains(ja) || joints_a[ja].type == model::JointType::kFixed) continue;
    int best = -1;
    for (int jb = 0; jb < static_cast<int>(joints_b.size()); ++jb) {
      if (used_b.contains(jb) || joints_b[jb].type == model::JointType::kFixed ||
          AxisSign(a, ja, b, jb) == 0) {
        continue;
      }
      if (best < 0 || joints_b[jb].name == joints_a[ja].name) best = jb;
    }
    if (best < 0) {
      pair->unpaired.push_back("joint '" + joints_a[ja].name + "'");
      continue;
    }
    used_b.insert(best);
    pair->joints.push_back(MakeJointPair(a, b, joints_a[ja].name, false, ja, best));
  }
}

/// Pairs the links that neither are the root link nor have a label, by where they lie at rest.
void PairOtherLinks(const Member& a, const Member& b, ModulePair* pair) {
  std::set<int> used_a;
  for (const LinkPair& link : pair->links) used_a.insert(link.link_a);
  for (int la = 0; la < static_cast<int>(a.type.links.size()); ++la) {
    // A link that no label names has a counterpart only where both lie at one place.
    if (used_a.contains(la)) continue;
    const std::string& name = a.type.links[la].name;
    const int lb = b.type.links.empty() ? -1 : NearestLink(a, la, b);
    if (lb >= 0 && (a.LinkPlace(la) - b.LinkPlace(lb)).norm() < kSamePlaceM) {
      pair->links.push_back({name, false, la, lb});
    } else {
      pair->unpaired.push_back("link '" + name + "'");
    }
  }
}

/// Finds for each connector of B the one of A at the same place; of several the one of its name.
void PairConnectors(const Member& a, const Member& b, ModulePair* pair) {
  for (int cb = 0; cb < static_cast<int>(b.type.connectors.size()); ++cb) {
    int best = -1;
    for (int ca = 0; ca < static_cast<int>(a.type.connectors.size()); ++ca) {
      if ((a.ConnectorPlace(ca) - b.ConnectorPlace(cb)).norm() > kSamePlaceM) continue;
      if (best < 0 || a.type.connectors[ca].name == b.type.connectors[cb].name) best = ca;
    }
    pair->connector_a_of_b.push_back(best);
  }
}

/// All that answers to each other in two modules.
ModulePair MakePair(const Side& side_a, const Holder& ha, const Side& side_b, const Holder& hb) {
  ModulePair pair;
  pair.role = ha.role;
  pair.a = ha.module;
  pair.b = hb.module;
  pair.spans_a = ha.spans;
  pair.spans_b = hb.spans;
  pair.taken_a_us = ha.taken_us;
  pair.taken_b_us = hb.taken_us;
  pair.distance_m = (ha.place - hb.place).norm();
  // The root links come first, then what has labels, and last what is paired by its place.
  const Member a(side_a, pair.a);
  const Member b(side_b, pair.b);
  if (!a.type.links.empty() && !b.type.links.empty()) {
    pair.links.push_back({"", false, 0, NearestLink(a, 0, b)});
  }
  const RoleSpan labels_a = LabelsOf(pair.spans_a, pair.role);
  const RoleSpan labels_b = LabelsOf(pair.spans_b, pair.role);
  PairLabels(labels_a.joints, a.type.joints.size(), labels_b.joints, b.type.joints.size(), &pair,
             [&](const std::string& label, int joint_a, int joint_b) {
               pair.joints.push_back(MakeJointPair(a, b, label, true, joint_a, joint_b));
             });
  PairLabels(labels_a.links, a.type.links.size(), labels_b.links, b.type.links.size(), &pair,
             [&](const std::string& label, int link_a, int link_b) {
               pair.links.push_back({label, true, link_a, link_b});
             });
  PairOtherJoints(a, b, &pair);
  PairOtherLinks(a, b, &pair);
  PairConnectors(a, b, &pair);
  return pair;
}

/// Pairs the holders of one role, the nearest first; ties in order of the modules.
void PairHolders(const Side& sa, const std::vector<Holder>& as, const Side& sb,
                 const std::vector<Holder>& bs, Matching* matching) {
  struct Candidate {
    double distance;
    size_t a, b;
  };
  // All pairs by distance.
  std::vector<Candidate> candidates;
  for (size_t i = 0; i < as.size(); ++i) {
    for (size_t j = 0; j < bs.size(); ++j) {
      // Rounded, so that float noise does not decide between equals.
      const double distance = (as[i].place - bs[j].place).norm();
      candidates.push_back({std::round(distance / kTieM) * kTieM, i, j});
    }
  }
  std::ranges::stable_sort(candidates, {}, &Candidate::distance);
  // Each holder gets the nearest that is not taken yet.
  std::vector<int> mate_of(as.size(), -1);
  std::vector<bool> taken(bs.size(), false);
  for (const Candidate& c : candidates) {
    if (mate_of[c.a] >= 0 || taken[c.b]) continue;
    mate_of[c.a] = static_cast<int>(c.b);
    taken[c.b] = true;
  }
  for (size_t i = 0; i < as.size(); ++i) {
    if (mate_of[i] >= 0) {
      matching->pairs.push_back(MakePair(sa, as[i], sb, bs[mate_of[i]]));
    } else {
      matching->unmatched.push_back({true, as[i].module, as[i].role, as[i].taken_us});
    }
  }
  for (size_t j = 0; j < bs.size(); ++j) {
    if (!taken[j]) matching->unmatched.push_back({false, bs[j].module, bs[j].role, bs[j].taken_us});
  }
}

}  // namespace

Matching Match(const RunLog& a, const RunLog& b, int64_t end_us) {
  const Side side_a{a};
  const Side side_b{b};
  Holders in_a = HoldersOf(side_a, end_us);
  Holders in_b = HoldersOf(side_b, end_us);
  std::set<std::string> roles;
  for (const auto& [role, holders] : in_a) roles.insert(role);
  for (const auto& [role, holders] : in_b) roles.insert(role);
  Matching matching;
  for (const std::string& role : roles) {
    PairHolders(side_a, in_a[role], side_b, in_b[role], &matching);
  }
  return matching;
}

JointSigns SignsOfA(const ModuleSeries& module_a, const JointPair& joint) {
  return joint.convention ? JointSigns(module_a, joint.joint_a) : JointSigns(1);
}

JointSigns SignsOfB(const ModuleSeries& module_b, const JointPair& joint) {
  return joint.convention ? JointSigns(module_b, joint.joint_b) : JointSigns(joint.sign_b);
}

}  // namespace morphbus::logger
