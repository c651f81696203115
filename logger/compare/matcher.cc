#include "logger/compare/matcher.h"

#include <algorithm>
#include <map>
#include <set>

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
  RestPoses X_RL;

  explicit Side(const RunLog& l) : log(l), X_RL(RestPosesOf(l)) {}
  [[nodiscard]] const model::ModuleType& TypeOf(const ModuleSeries& module) const {
    return log.model->TypeOf(*log.robot, module.model_index);
  }
  [[nodiscard]] Eigen::Vector3d RestCentre(const ModuleSeries& module, int link) const {
    return X_RL[module.model_index][link] * LinkCentre(TypeOf(module).links[link]);
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
Eigen::Vector3d PlaceAt(const Side& side, const ModuleSeries& module, int64_t time_us) {
  const auto earlier = [](const TransformSample& s, int64_t time) { return s.time_us < time; };
  auto sample =
      std::lower_bound(module.transforms.begin(), module.transforms.end(), time_us, earlier);
  // A module that took its role before it knew its pose is placed by the first pose after that.
  while (sample != module.transforms.end() && !sample->has_pose) ++sample;
  const model::ModuleType& type = side.TypeOf(module);
  const int num_links = static_cast<int>(type.links.size());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  // Links whose pose is not told are taken from the model at rest.
  for (int l = 0; l < num_links; ++l) {
    if (sample == module.transforms.end() || l >= static_cast<int>(sample->X_RL.size())) {
      sum += side.RestCentre(module, l);
      continue;
    }
    const morphbus::pose_t& pose = sample->X_RL[l];
    const float* w = pose.orientation_wxyz;
    const Eigen::Quaterniond q(w[0], w[1], w[2], w[3]);
    sum += q.normalized() * LinkCentre(type.links[l]) +
           Eigen::Vector3d(pose.position_m[0], pose.position_m[1], pose.position_m[2]);
  }
  return num_links == 0 ? sum : Eigen::Vector3d(sum / num_links);
}

/// Finds the role by which a module is matched, and where it was when it took it.
Holder HolderOf(const Side& side, int index, int64_t end_us) {
  const ModuleSeries& module = side.log.modules[index];
  Holder holder;
  holder.module = index;
  holder.spans = RoleSpans(module, end_us);
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
  for (const RoleSpan& span : holder.spans) {
    if (!holder.role.empty() && span.role == holder.role) {
      holder.taken_us = span.begin_us;
      break;
    }
  }
  holder.place = PlaceAt(side, module, std::max<int64_t>(holder.taken_us, 0));
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

/// The labels of the module's matched role, as it last resolved them.
const RoleSpan* LabelsOf(const std::vector<RoleSpan>& spans, const std::string& role) {
  for (auto span = spans.rbegin(); span != spans.rend(); ++span) {
    if (!role.empty() && span->role == role) return &*span;
  }
  return nullptr;
}

/// The link of B whose centre lies nearest to that of A's link at rest; of equals the one of its
/// name.
int NearestLink(const Side& sa, const ModuleSeries& ma, int link_a, const Side& sb,
                const ModuleSeries& mb) {
  const Eigen::Vector3d centre = sa.RestCentre(ma, link_a);
  const std::string& name = sa.TypeOf(ma).links[link_a].name;
  // Only a clearly smaller distance wins, so that float noise does not decide.
  int best = 0;
  double best_distance = 0.0;
  for (int l = 0; l < static_cast<int>(sb.TypeOf(mb).links.size()); ++l) {
    const double distance = (sb.RestCentre(mb, l) - centre).norm();
    const bool tie = l > 0 && std::abs(distance - best_distance) < kTieM;
    if (l == 0 || distance < best_distance - kTieM ||
        (tie && sb.TypeOf(mb).links[l].name == name)) {
      best = l;
      best_distance = distance;
    }
  }
  return best;
}

/// A joint's axis as a line in the robot frame at rest.
struct RestAxis {
  Eigen::Vector3d point;  ///< In R at rest, m.
  /// Unit direction of the axis in R.
  Eigen::Vector3d axis;
};

/// The line about (along) which a joint moves, at rest in the robot frame.
RestAxis AxisOf(const Side& side, const ModuleSeries& module, int joint) {
  const model::Joint& j = side.TypeOf(module).joints[joint];
  const model::Pose& X_RB = side.X_RL[module.model_index][j.link_b];
  return {X_RB * j.p_MoJo_M, X_RB.linear() * j.axis};
}

/// +1 or -1 if the two joints turn (slide) along one line, the sign that maps B's value onto A's;
/// 0 if they do not. A joint turns link_a against link_b, so it matters which of them lies where.
int AxisSign(const Side& sa, const ModuleSeries& ma, int joint_a, const Side& sb,
             const ModuleSeries& mb, int joint_b) {
  // The two axes must be parallel, and for turning joints one line.
  const model::Joint& ja = sa.TypeOf(ma).joints[joint_a];
  const model::Joint& jb = sb.TypeOf(mb).joints[joint_b];
  const bool slides_a = ja.type == model::JointType::kPrismatic;
  if (slides_a != (jb.type == model::JointType::kPrismatic)) return 0;
  const RestAxis a = AxisOf(sa, ma, joint_a);
  const RestAxis b = AxisOf(sb, mb, joint_b);
  const double cosine = a.axis.dot(b.axis);
  if (std::abs(cosine) < kSameAxisCos) return 0;
  if (!slides_a && (b.point - a.point).cross(a.axis).norm() > kSamePlaceM) return 0;
  // If A's first link lies where B's second does, the joint is measured the other way round.
  const auto apart = [&](int link_a, int link_b) {
    return (sa.RestCentre(ma, link_a) - sb.RestCentre(mb, link_b)).norm();
  };
  const double straight = apart(ja.link_a, jb.link_a) + apart(ja.link_b, jb.link_b);
  const double crossed = apart(ja.link_a, jb.link_b) + apart(ja.link_b, jb.link_a);
  const int sign = cosine > 0 ? 1 : -1;
  return crossed < straight - kTieM ? -sign : sign;
}

/// Completes what is known of a pair of joints.
JointPair MakeJointPair(const Side& sa, const ModuleSeries& ma, const Side& sb,
                        const ModuleSeries& mb, JointPair pair) {
  pair.prismatic = sa.TypeOf(ma).joints[pair.joint_a].type == model::JointType::kPrismatic;
  pair.convention = JointSigns(ma, pair.joint_a).ever() && JointSigns(mb, pair.joint_b).ever();
  const int sign = AxisSign(sa, ma, pair.joint_a, sb, mb, pair.joint_b);
  pair.sign_b = sign == 0 ? 1 : sign;
  return pair;
}

bool ValidIndex(int index, size_t size) { return index >= 0 && index < static_cast<int>(size); }

/// Pairs the joints and links to which both resolved a label.
void PairLabels(const Side& sa, const ModuleSeries& ma, const Side& sb, const ModuleSeries& mb,
                ModulePair* pair) {
  // Labels count as they were last resolved; a module that never had the role has none.
  const RoleSpan* la = LabelsOf(pair->spans_a, pair->role);
  const RoleSpan* lb = LabelsOf(pair->spans_b, pair->role);
  const RoleSpan none;
  if (la == nullptr) la = &none;
  if (lb == nullptr) lb = &none;
  // Joints first: both sides must know the label, and its index must be one of the module type's.
  for (const auto& [label, joint_a] : la->joints) {
    const auto found = lb->joints.find(label);
    if (found == lb->joints.end()) {
      pair->labels_missing_b.push_back(label);
    } else if (ValidIndex(joint_a, sa.TypeOf(ma).joints.size()) &&
               ValidIndex(found->second, sb.TypeOf(mb).joints.size())) {
      JointPair joint{label, true, joint_a, found->second, false, false, 1};
      pair->joints.push_back(MakeJointPair(sa, ma, sb, mb, joint));
    } else {
      pair->unpaired.push_back("label '" + label + "'");
    }
  }
  // The same for links.
  for (const auto& [label, link_a] : la->links) {
    const auto found = lb->links.find(label);
    if (found == lb->links.end()) {
      pair->labels_missing_b.push_back(label);
    } else if (ValidIndex(link_a, sa.TypeOf(ma).links.size()) &&
               ValidIndex(found->second, sb.TypeOf(mb).links.size())) {
      pair->links.push_back({label, true, link_a, found->second});
    } else {
      pair->unpaired.push_back("label '" + label + "'");
    }
  }
  // Labels that only B resolved.
  for (const auto& [label, joint] : lb->joints) {
    if (!la->joints.contains(label)) pair->labels_missing_a.push_back(label);
  }
  for (const auto& [label, link] : lb->links) {
    if (!la->links.contains(label)) pair->labels_missing_a.push_back(label);
  }
}

/// Pairs joints without a label whose axes coincide, those of one name first.
void PairOtherJoints(const Side& sa, const ModuleSeries& ma, const Side& sb, const ModuleSeries& mb,
                     ModulePair* pair) {
  // What labels paired is not paired again.
  std::set<int> used_a, used_b;
  for (const JointPair& joint : pair->joints) {
    used_a.insert(joint.joint_a);
    used_b.insert(joint.joint_b);
  }
  const auto& joints_a = sa.TypeOf(ma).joints;
  const auto& joints_b = sb.TypeOf(mb).joints;
  // Each joint of A takes the free one of B on the same axis, by preference of the same name.
  for (int ja = 0; ja < static_cast<int>(joints_a.size()); ++ja) {
    if (used_a.contains(ja) || joints_a[ja].type == model::JointType::kFixed) continue;
    int best = -1;
    for (int jb = 0; jb < static_cast<int>(joints_b.size()); ++jb) {
      if (used_b.contains(jb) || joints_b[jb].type == model::JointType::kFixed ||
          AxisSign(sa, ma, ja, sb, mb, jb) == 0) {
        continue;
      }
      if (best < 0 || joints_b[jb].name == joints_a[ja].name) best = jb;
    }
    if (best < 0) {
      pair->unpaired.push_back("joint '" + joints_a[ja].name + "'");
      continue;
    }
    used_b.insert(best);
    JointPair joint{joints_a[ja].name, false, ja, best, false, false, 1};
    pair->joints.push_back(MakeJointPair(sa, ma, sb, mb, joint));
  }
}

/// Pairs the links that neither are the root link nor have a label, by where they lie at rest.
void PairOtherLinks(const Side& sa, const ModuleSeries& ma, const Side& sb, const ModuleSeries& mb,
                    ModulePair* pair) {
  std::set<int> used_a;
  for (const LinkPair& link : pair->links) used_a.insert(link.link_a);
  const auto& links_a = sa.TypeOf(ma).links;
  for (int la = 0; la < static_cast<int>(links_a.size()); ++la) {
    // A link that no label names has a counterpart only where both lie at one place.
    if (used_a.contains(la)) continue;
    const int lb = sb.TypeOf(mb).links.empty() ? -1 : NearestLink(sa, ma, la, sb, mb);
    if (lb >= 0 && (sa.RestCentre(ma, la) - sb.RestCentre(mb, lb)).norm() < kSamePlaceM) {
      pair->links.push_back({links_a[la].name, false, la, lb});
    } else {
      pair->unpaired.push_back("link '" + links_a[la].name + "'");
    }
  }
}

/// Where a connector is in the robot frame at rest (m).
Eigen::Vector3d RestPlace(const Side& side, const ModuleSeries& module, int connector) {
  const model::Connector& c = side.TypeOf(module).connectors[connector];
  return side.X_RL[module.model_index][c.link] * c.p_MoCo_M;
}

/// Finds for each connector of B the one of A at the same place; of several the one of its name.
void PairConnectors(const Side& sa, const ModuleSeries& ma, const Side& sb, const ModuleSeries& mb,
                    ModulePair* pair) {
  const auto& connectors_a = sa.TypeOf(ma).connectors;
  const auto& connectors_b = sb.TypeOf(mb).connectors;
  for (int cb = 0; cb < static_cast<int>(connectors_b.size()); ++cb) {
    int best = -1;
    for (int ca = 0; ca < static_cast<int>(connectors_a.size()); ++ca) {
      if ((RestPlace(sa, ma, ca) - RestPlace(sb, mb, cb)).norm() > kSamePlaceM) continue;
      if (best < 0 || connectors_a[ca].name == connectors_b[cb].name) best = ca;
    }
    pair->connector_a_of_b.push_back(best);
  }
}

/// All that answers to each other in two modules.
ModulePair MakePair(const Side& sa, const Holder& ha, const Side& sb, const Holder& hb) {
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
  const ModuleSeries& ma = sa.log.modules[pair.a];
  const ModuleSeries& mb = sb.log.modules[pair.b];
  if (!sa.TypeOf(ma).links.empty() && !sb.TypeOf(mb).links.empty()) {
    pair.links.push_back({"", false, 0, NearestLink(sa, ma, 0, sb, mb)});
  }
  PairLabels(sa, ma, sb, mb, &pair);
  PairOtherJoints(sa, ma, sb, mb, &pair);
  PairOtherLinks(sa, ma, sb, mb, &pair);
  PairConnectors(sa, ma, sb, mb, &pair);
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
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& x, const Candidate& y) { return x.distance < y.distance; });
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
  const Side side_a(a);
  const Side side_b(b);
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
