#include "compiler/model/mass_spread.h"

#include <algorithm>

#include "compiler/base/split_mix.h"
#include "compiler/elementary/gaussian.h"

namespace morphbus::model {
namespace {

/// Keeps these numbers apart from others that come of the same seed; its bytes are "mass".
constexpr uint64_t kMassStream = 0x6d617373;
/// Beyond so many standard deviations a draw is cut off, so that a link never weighs nothing.
constexpr double kMostDeviations = 3.0;

double DrawFactor(double spread, uint64_t seed, int module, int link) {
  if (spread <= 0.0) return 1.0;
  // Each link has a generator of its own, so that its number does not depend on other links.
  SplitMix64 random(
      SplitMix64::Mix(SplitMix64::Mix(seed ^ kMassStream) ^
                      (static_cast<uint64_t>(module) << 8 | static_cast<uint64_t>(link))));
  const double deviations = elementary::Gaussian(1.0, [&random] { return random.Next(); });
  return 1.0 + spread * std::clamp(deviations, -kMostDeviations, kMostDeviations);
}

}  // namespace

MassFactors DrawMassFactors(const Model& model, const Robot& robot, uint64_t seed) {
  MassFactors factors;
  bool any = false;
  for (int m = 0; m < std::ssize(robot.modules); ++m) {
    const std::vector<Link>& links = model.TypeOf(robot, m).links;
    std::vector<double>& row = factors.emplace_back();
    for (int l = 0; l < std::ssize(links); ++l) {
      row.push_back(DrawFactor(links[l].mass_spread, seed, m, l));
      any = any || links[l].mass_spread > 0.0;
    }
  }
  return any ? factors : MassFactors();
}

}  // namespace morphbus::model
