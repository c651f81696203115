#include "compiler/solver/motion_postures.h"

#include <algorithm>
#include <numbers>
#include <optional>
#include <utility>

#include "compiler/base/split_mix.h"

namespace morphbus::solver {
namespace {

using model::Joint;
using model::JointType;

/// Up to this many joints all corners of their ranges are tried: 64 of them.
constexpr int kMaxCornerJoints = 6;
/// Behind the start: all lower limits, then all upper ones; other corners follow.
constexpr int kLowerPosture = kStartPosture + 1;
constexpr int kUpperPosture = kStartPosture + 2;

/// The range in which a joint is tried (rad or m).
std::pair<double, double> RangeOf(const Joint& joint) {
  if (joint.type == JointType::kContinuous) return {-std::numbers::pi, std::numbers::pi};
  return {joint.lower, joint.upper};
}

/// The corner of the ranges of `count` joints that a posture is, if it is one: bit i says at which
/// end of its range joint i is. Of more joints than bits only the corners with all bits alike are
/// tried, and the last bit stands for all that have none.
std::optional<int> CornerOf(int posture, int count) {
  if (posture == kLowerPosture) return 0;
  if (posture == kUpperPosture) return (1 << (kMaxCornerJoints + 1)) - 1;
  if (count <= kMaxCornerJoints && posture <= 1 << count) return posture - kUpperPosture;
  return std::nullopt;
}

}  // namespace

std::vector<double> PostureValues(const std::vector<const Joint*>& joints, uint64_t seed,
                                  int posture) {
  const int count = static_cast<int>(joints.size());
  const std::optional<int> corner = CornerOf(posture, count);
  // The numbers depend on seed and posture alone, so that neither other dockings nor the number of
  // postures change them.
  SplitMix64 random(SplitMix64::Mix(seed) ^ static_cast<uint64_t>(posture));
  std::vector<double> values;
  values.reserve(joints.size());
  for (int i = 0; i < count; ++i) {
    const auto [lower, upper] = RangeOf(*joints[i]);
    double fraction = random.NextFraction();
    if (corner) {
      fraction = (*corner >> std::min(i, kMaxCornerJoints) & 1) != 0 ? 1.0 : 0.0;
    } else if (posture % 2 == 0 && joints[i]->type != JointType::kContinuous) {
      // The range is stretched to twice its length, and what lies beyond a limit stands for it.
      fraction = std::clamp(2.0 * fraction - 0.5, 0.0, 1.0);
    }
    // The upper limit itself, and not what rounding makes of it.
    values.push_back(fraction == 1.0 ? upper : lower + fraction * (upper - lower));
  }
  return values;
}

}  // namespace morphbus::solver
