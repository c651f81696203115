#include "compiler/congruence/symmetries.h"

#include <algorithm>
#include <map>

#include "compiler/congruence/counter.h"

namespace morphbus::congruence {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A congruence of an assembly with itself.
struct Symmetry {
  std::vector<int> body_to;
  std::vector<Matrix3d> R;
};

/// The places of one body, and which of them symmetries take it to.
class Orbit {
 public:
  explicit Orbit(std::vector<Place> places)
      : places_(std::move(places)), state_(places_.size(), State::kUnknown) {
    for (size_t i = 0; i < places_.size(); ++i) {
      at_image_[places_[i].image].push_back(i);
    }
  }

  [[nodiscard]] const std::vector<Place>& places() const { return places_; }
  [[nodiscard]] bool unknown(size_t place) const { return state_[place] == State::kUnknown; }
  [[nodiscard]] size_t num_reached() const {
    return static_cast<size_t>(std::count(state_.begin(), state_.end(), State::kReached));
  }
  /// The place where `body` is, unmoved; places_.size() if it is none.
  [[nodiscard]] size_t Home(int body) const {
    Place home{body, Matrix3d::Identity(), Vector3d::Zero()};
    const auto at = at_image_.find(body);
    if (at == at_image_.end()) return places_.size();
    for (const size_t place : at->second) {
      home.free_axis = places_[place].R.transpose() * places_[place].free_axis;
      if (Same(places_[place], home)) return place;
    }
    return places_.size();
  }

  void AddSymmetry(Symmetry symmetry) {
    symmetries_.push_back(std::move(symmetry));
    // All known places lead on by the new one, and further ones by all.
    for (const State state : {State::kReached, State::kNever}) {
      std::vector<size_t> todo;
      for (size_t i = 0; i < places_.size(); ++i) {
        if (state_[i] == state) todo.push_back(i);
      }
      Spread(std::move(todo), state);
    }
  }

  void Reach(size_t place) { Start(place, State::kReached); }
  /// No symmetry takes the body there, so none takes it anywhere that symmetries take that place.
  void Exclude(size_t place) { Start(place, State::kNever); }

 private:
  enum class State { kUnknown, kReached, kNever };

  static bool Same(const Place& x, const Place& y) {
    constexpr double kSame = 100.0 * kGeometryTolerance;
    return x.free_axis.isZero() ? (x.R - y.R).norm() <= kSame
                                : (x.free_axis - y.free_axis).norm() <= kSame;
  }

  void Start(size_t place, State state) {
    state_[place] = state;
    Spread({place}, state);
  }

  void Spread(std::vector<size_t> todo, State state) {
    while (!todo.empty()) {
      const Place& from = places_[todo.back()];
      todo.pop_back();
      for (const Symmetry& symmetry : symmetries_) {
        const Matrix3d& R = symmetry.R[from.image];
        const Place to{symmetry.body_to[from.image], R * from.R, R * from.free_axis};
        for (const size_t place : at_image_[to.image]) {
          if (state_[place] != State::kUnknown || !Same(places_[place], to)) continue;
          state_[place] = state;
          todo.push_back(place);
        }
      }
    }
  }

  std::vector<Place> places_;
  std::vector<State> state_;
  std::map<int, std::vector<size_t>> at_image_;
  std::vector<Symmetry> symmetries_;
};

Symmetry Made(const Correspondence& matched) {
  Symmetry symmetry;
  for (size_t b = 0; b < matched.a().bodies.size(); ++b) {
    symmetry.body_to.push_back(matched.ImageOf(static_cast<int>(b)));
    symmetry.R.push_back(matched.R().Value(static_cast<int>(b)));
  }
  return symmetry;
}

}  // namespace

int SeedBody(const Classes& classes, const Pieces& pieces) {
  std::map<uint64_t, std::pair<int, int>> members;
  for (const uint64_t c : classes.bodies[0]) ++members[c].first;
  for (const uint64_t c : classes.bodies[1]) ++members[c].second;
  int best = -1;
  std::pair<bool, int> least;
  for (size_t b = 0; b < classes.bodies[0].size(); ++b) {
    const auto& [in_a, in_b] = members[classes.bodies[0][b]];
    const std::pair<bool, int> score(pieces.loose[b], std::max(in_a, in_b));
    if (in_b == 0 || (best >= 0 && score >= least)) continue;
    best = static_cast<int>(b);
    least = score;
  }
  return best;
}

std::vector<Place> PlacesOf(const Correspondence& matched, const Pieces& pieces, int body) {
  std::vector<Place> places;
  const Classes& classes = matched.classes();
  for (size_t image = 0; image < matched.b().bodies.size(); ++image) {
    if (classes.bodies[1][image] != classes.bodies[0][body]) continue;
    for (Place& place : PlacesOn(matched, pieces, body, static_cast<int>(image))) {
      places.push_back(std::move(place));
    }
  }
  return places;
}

SymmetryCount CountSymmetries(const Assembly& a, Steps& steps) {
  Correspondence matched(a, a, RefinedClasses(a, a));
  const Pieces pieces = CutIntoPieces(a, matched.length_tolerance());
  const Cut cut{pieces, pieces};
  Counter counter(matched, cut, steps);
  const int seed = SeedBody(matched.classes(), pieces);
  Orbit orbit(PlacesOf(matched, pieces, seed));
  const size_t home = orbit.Home(seed);
  SymmetryCount result;
  if (home == orbit.places().size()) return {1, false};  // cannot be: the body is where it is
  const int64_t at_home = counter.Ways(seed, orbit.places()[home]);
  orbit.Reach(home);
  for (size_t place = 0; place < orbit.places().size() && !steps.gave_up(); ++place) {
    if (!orbit.unknown(place)) continue;
    if (counter.Make(seed, orbit.places()[place])) {
      orbit.AddSymmetry(Made(matched));
      counter.Clear();
      if (orbit.unknown(place)) orbit.Reach(place);
    } else if (!steps.gave_up()) {
      orbit.Exclude(place);
    }
  }
  result.count = Times(std::max<int64_t>(at_home, 1), static_cast<int64_t>(orbit.num_reached()));
  result.complete = !steps.gave_up() && result.count < kMostCounted;
  return result;
}

}  // namespace morphbus::congruence
