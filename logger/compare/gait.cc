#include "logger/compare/gait.h"

#include <algorithm>
#include <cctype>
#include <set>

namespace morphbus::logger {

std::vector<std::pair<const ModulePair*, const LinkPair*>> FootPairs(const Matching& matching) {
  // Labels are the program's choice, so "foot" is found in any case of letters. Every link may be
  // a candidate of three kinds; the most telling kind that there is, is chosen.
  std::vector<std::pair<const ModulePair*, const LinkPair*>> feet, labelled, roots;
  for (const ModulePair& pair : matching.pairs) {
    for (const LinkPair& link : pair.links) {
      std::string name = link.label;
      std::transform(name.begin(), name.end(), name.begin(),
                     [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      if (name.find("foot") != std::string::npos) feet.emplace_back(&pair, &link);
      if (link.labelled) labelled.emplace_back(&pair, &link);
      if (link.label.empty()) roots.emplace_back(&pair, &link);
    }
  }
  return !feet.empty() ? feet : !labelled.empty() ? labelled : roots;
}

std::vector<FigurePair> DutyPairs(const Matching& matching, const RunLog& a, const RunLog& b,
                                  const Gait& gait_a, const Gait& gait_b) {
  std::vector<FigurePair> duties;
  for (const ModulePair& pair : matching.pairs) {
    const int module_a = a.modules[pair.a].model_index, module_b = b.modules[pair.b].model_index;
    // Labels come before the root link, which may have one, too.
    std::set<std::pair<int, int>> known;
    for (const bool labelled : {true, false}) {
      for (const LinkPair& link : pair.links) {
        if (link.labelled != labelled || !known.emplace(link.link_a, link.link_b).second) continue;
        const double duty_a = gait_a.DutyOf(module_a, link.link_a);
        const double duty_b = gait_b.DutyOf(module_b, link.link_b);
        // Links that never touch the ground have no duty to compare.
        if (duty_a == 0.0 && duty_b == 0.0) continue;
        duties.push_back({&pair, link.label, false, duty_a, duty_b});
      }
    }
  }
  return duties;
}

std::vector<FigurePair> RangePairs(const Matching& matching, const RunLog& a, const RunLog& b,
                                   const Gait& gait_a, const Gait& gait_b) {
  std::vector<FigurePair> ranges;
  for (const ModulePair& pair : matching.pairs) {
    for (const JointPair& joint : pair.joints) {
      ranges.push_back({&pair, joint.label, joint.prismatic,
                        gait_a.RangeOf(a.modules[pair.a].model_index, joint.joint_a),
                        gait_b.RangeOf(b.modules[pair.b].model_index, joint.joint_b)});
    }
  }
  return ranges;
}

}  // namespace morphbus::logger
