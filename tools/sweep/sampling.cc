#include "tools/sweep/sampling.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "compiler/base/split_mix.h"

namespace morphbus::tools {
namespace {

/// Where in each axis that is drawn, 0 up to 1, its samples lie.
std::vector<double> FractionsOf(const SweepFile& sweep, const SweepAxis& axis) {
  // Each axis has numbers of its own, so that another axis more changes none of them.
  uint64_t state = sweep.sample_seed;
  for (const char c : axis.name) state = SplitMix64::Mix(state ^ static_cast<unsigned char>(c)) + 1;
  SplitMix64 random(state);
  std::vector<double> fractions(sweep.samples);
  for (double& fraction : fractions) fraction = random.NextFraction();
  if (sweep.method != SweepMethod::kLatin) return fractions;
  // A random order of the parts (Fisher and Yates), and in each part a random place.
  std::vector<int> parts(fractions.size());
  std::iota(parts.begin(), parts.end(), 0);
  for (size_t left = parts.size(); left > 1; --left)
    std::swap(parts[left - 1], parts[random.Next() % left]);
  const auto count = static_cast<double>(fractions.size());
  for (size_t i = 0; i < fractions.size(); ++i) fractions[i] = (parts[i] + fractions[i]) / count;
  return fractions;
}

/// The points of one [[run]].
class RunPoints {
 public:
  RunPoints(const SweepFile& sweep, const RunPoint& run, std::vector<RunPoint>* points)
      : sweep_(sweep), run_(run), points_(*points) {
    for (const SweepAxis& axis : sweep.axes) {
      // What the run says itself is not gone through.
      if (run.contains(axis.name)) continue;
      (axis.kind == SweepAxis::Kind::kEach ? each_ : drawn_).push_back(&axis);
    }
    for (const SweepAxis* axis : drawn_) fractions_.push_back(FractionsOf(sweep, *axis));
  }

  /// How many there are; as a double, which does not overflow.
  [[nodiscard]] double count() const {
    double product = (drawn_.empty() ? 1.0 : sweep_.samples) * (1.0 + sweep_.variants);
    for (const SweepAxis* axis : each_) product *= static_cast<double>(axis->values.size());
    return product;
  }

  void Add() {
    const int samples = drawn_.empty() ? 1 : sweep_.samples;
    for (int sample = 0; sample < samples; ++sample) {
      sample_ = sample;
      AddFrom(0, Json::object());
    }
  }

 private:
  /// Goes through the axes from this one on; values before it are in `chosen`.
  void AddFrom(size_t axis, const RunPoint& chosen) {
    if (axis < each_.size()) {
      for (const Json& value : each_[axis]->values) {
        RunPoint next = chosen;
        next[each_[axis]->name] = value;
        AddFrom(axis + 1, next);
      }
      return;
    }
    for (int variant = 0; variant <= sweep_.variants; ++variant)
      points_.push_back(PointOf(chosen, variant));
  }

  /// The point, in the order of the axes in the file: what all points share has the same order.
  [[nodiscard]] RunPoint PointOf(const RunPoint& chosen, int variant) const {
    RunPoint point = Json::object();
    for (const SweepAxis& axis : sweep_.axes) {
      if (run_.contains(axis.name)) {
        point[axis.name] = run_[axis.name];
      } else if (chosen.contains(axis.name)) {
        point[axis.name] = chosen[axis.name];
      } else {
        const size_t drawn = std::ranges::find(drawn_, &axis) - drawn_.begin();
        point[axis.name] = ValueAt(axis, fractions_[drawn][sample_]);
      }
    }
    for (const auto& [name, value] : run_.items()) point[name] = value;
    if (sweep_.variants > 0) {
      point[kVariants] = sweep_.variants;
      point[kVariant] = variant;
    }
    return point;
  }

  const SweepFile& sweep_;
  const RunPoint& run_;
  std::vector<RunPoint>& points_;
  std::vector<const SweepAxis*> each_, drawn_;
  /// Of each axis that is drawn, by sample.
  std::vector<std::vector<double>> fractions_;
  int sample_ = 0;
};

}  // namespace

Json ValueAt(const SweepAxis& axis, double fraction) {
  if (axis.kind == SweepAxis::Kind::kAmong) {
    const auto index = static_cast<size_t>(fraction * static_cast<double>(axis.values.size()));
    return axis.values[std::min(index, axis.values.size() - 1)];
  }
  if (axis.whole) {
    // Each whole number has as large a share.
    const double first = std::ceil(axis.from), last = std::floor(axis.to);
    return static_cast<int64_t>(std::min(last, first + std::floor(fraction * (last - first + 1))));
  }
  if (axis.logarithmic) {
    const double logarithm = std::log(axis.from) * (1 - fraction) + std::log(axis.to) * fraction;
    return std::clamp(std::exp(logarithm), axis.from, axis.to);
  }
  return axis.from * (1 - fraction) + axis.to * fraction;
}

Result<std::vector<RunPoint>> PointsOf(const SweepFile& sweep) {
  std::vector<RunPoint> points;
  double count = 0;
  for (const RunPoint& run : sweep.runs) count += RunPoints(sweep, run, &points).count();
  if (count > kMostRows) {
    return Fail(fmt::format("the sweep has {:.3g} rows; the most is {}", count, kMostRows));
  }
  for (const RunPoint& run : sweep.runs) RunPoints(sweep, run, &points).Add();
  return points;
}

}  // namespace morphbus::tools
