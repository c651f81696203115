#include "compiler/congruence/mapping_counter.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "compiler/congruence/mapping_builder.h"

namespace morphbus::congruence {
namespace {

/// The orbits of the places of one body under the symmetries found so far: a union-find in which
/// places are joined that a symmetry takes to each other.
class Orbits {
 public:
  explicit Orbits(std::vector<Place> places)
      : places_(std::move(places)), parent_(places_.size()), excluded_(places_.size(), false) {
    std::iota(parent_.begin(), parent_.end(), 0);
    for (size_t i = 0; i < places_.size(); ++i) {
      at_image_[places_[i].image].push_back(static_cast<int>(i));
    }
  }

  [[nodiscard]] int size() const { return static_cast<int>(places_.size()); }
  [[nodiscard]] const Place& at(int place) const { return places_[place]; }

  /// The number of the place that is the same as `place`; -1 if there is none.
  [[nodiscard]] int Find(const Place& place) const {
    // Looser than where places are made, as symmetries add their rounding.
    constexpr double kSame = 100.0 * kGeometryTolerance;
    const auto there = at_image_.find(place.image);
    if (there == at_image_.end()) return -1;
    for (const int i : there->second) {
      if (SamePlace(places_[i], place, kSame)) return i;
    }
    return -1;
  }

  [[nodiscard]] bool SameOrbit(int x, int y) { return Root(x) == Root(y); }
  /// The number of places in the orbit of one.
  [[nodiscard]] int64_t OrbitSize(int of) {
    int64_t count = 0;
    for (int i = 0; i < size(); ++i) count += SameOrbit(i, of) ? 1 : 0;
    return count;
  }

  /// No symmetry takes the body to this place, so none takes it to any in the orbit of it.
  void Exclude(int place) { excluded_[Root(place)] = true; }
  [[nodiscard]] bool Excluded(int place) { return excluded_[Root(place)]; }

  /// Makes one orbit of those of two places.
  void Join(int x, int y) {
    const int root_x = Root(x);
    const int root_y = Root(y);
    parent_[root_y] = root_x;
    excluded_[root_x] = excluded_[root_x] || excluded_[root_y];
  }

  /// Joins each place with that to which the finished symmetry takes it.
  void JoinBy(const Correspondence& symmetry) {
    for (int i = 0; i < size(); ++i) {
      const Place& from = places_[i];
      const Eigen::Matrix3d R = symmetry.R().Value(from.image);
      const int to = Find({symmetry.ImageOf(from.image), R * from.R, R * from.free_axis});
      if (to >= 0) Join(i, to);
    }
  }

 private:
  int Root(int place) {
    while (parent_[place] != place) place = parent_[place] = parent_[parent_[place]];
    return place;
  }

  std::vector<Place> places_;
  std::vector<int> parent_;                   ///< Of the union-find; a root is its own.
  std::vector<bool> excluded_;                ///< By root.
  std::map<int, std::vector<int>> at_image_;  ///< Places by image.
};

/// Counts the symmetries of an assembly.
class MappingCounter {
 public:
  MappingCounter(const ScrewGraph& a, Steps& steps)
      : steps_(steps), builder_(a, a, RefinedClasses(a, a), steps) {}

  MappingCount Count() {
    const Decomposition& pieces = builder_.pieces().a;
    const int seed = SeedBody(builder_.matched().classes(), pieces);
    int64_t count = CountOrbit(seed);
    if (count <= kMaxCounted) count *= CountInPlace(seed, kMaxCounted / count);
    // Where the steps ran out, kMaxCounted itself would say that there are more.
    if (steps_.gave_up()) return {std::clamp<int64_t>(count, 1, kMaxCounted - 1), false};
    return {std::min(count, kMaxCounted), count <= kMaxCounted};
  }

 private:
  /// The number of places to which symmetries take `body`, or more than kMaxCounted.
  int64_t CountOrbit(int body) {
    // At first the orbit is known to hold the place where the body is.
    Correspondence& matched = builder_.matched();
    Orbits orbits(PlacesOf(matched, builder_.pieces().a, body));
    const int home = orbits.Find(HomeOf(matched, builder_.pieces().a, body));
    // A body can always stay where it is, so only rounding could hide that place.
    if (home < 0) return 1;
    // For each further orbit of places one attempt tells whether symmetries take the body there.
    int64_t size = 1;
    for (int place = 0; place < orbits.size() && size <= kMaxCounted; ++place) {
      if (orbits.SameOrbit(place, home) || orbits.Excluded(place)) continue;
      if (builder_.Build(body, orbits.at(place))) {
        orbits.JoinBy(matched);
        orbits.Join(home, place);
        builder_.Clear();
        size = orbits.OrbitSize(home);
      } else if (steps_.gave_up()) {
        break;
      } else {
        orbits.Exclude(place);
      }
    }
    return size;
  }

  /// The number of symmetries that leave `seed` where it is and as it is turned, or some number
  /// above `most`.
  int64_t CountInPlace(int seed, int64_t most) {
    struct Reached {
      int body;
      int through;  ///< The piece that leads to it; -1 for the seed.
    };
    std::vector<Reached> todo = {{seed, -1}};
    int64_t count = 1;
    const Decomposition& pieces = builder_.pieces().a;
    while (!todo.empty() && count <= most && !steps_.gave_up()) {
      const auto [body, through] = todo.back();
      todo.pop_back();
      // The body by itself, unmoved: what lies on the other side of `through` has no part in this.
      builder_.PutAt(body, HomeOf(builder_.matched(), pieces, body));
      count *= builder_.MatchJointsWithin(body);
      const auto sets = builder_.PiecesAt(body, through, through);
      for (const InterchangeableSet& set : *sets) {
        if (count > most) break;
        count *= CountExchanges(set.pieces, body, most);
        for (const int piece : set.pieces) {
          if (count <= most) count *= CountWays(piece, body, most);
          for (const int other : pieces.bodies[piece]) {
            if (other != body) todo.push_back({other, piece});
          }
        }
      }
      builder_.Clear();
    }
    return count;
  }

  /// In how many ways the pieces at a body can change places: k! for each class of k pieces that
  /// can stand for each other. Stops above `most`.
  int64_t CountExchanges(const std::vector<int>& pieces, int body, int64_t most) {
    // Each piece is tried with one member of each class so far.
    struct Class {
      int member;
      int64_t size;
    };
    std::vector<Class> classes;
    int64_t count = 1;
    for (const int piece : pieces) {
      if (count > most) break;
      const auto same = std::find_if(classes.begin(), classes.end(), [&](const Class& c) {
        const Correspondence::Mark before = builder_.matched().mark();
        const bool fits = builder_.MatchPiece({piece, c.member, body});
        builder_.matched().Undo(before);
        return fits;
      });
      if (same == classes.end()) {
        classes.push_back({piece, 1});
      } else {
        count *= ++same->size;
      }
    }
    return count;
  }

  /// In how many ways `piece` can be matched with itself such that all that hangs on it can be
  /// matched too. Stops above `most`.
  int64_t CountWays(int piece, int body, int64_t most) {
    Backtracker search(builder_.matched(), builder_.pieces(), steps_, {piece, piece, body});
    const Correspondence::Mark before = builder_.matched().mark();
    int64_t ways = 0;
    while (ways <= most && search.Next()) {
      if (StayInPlace(search.NewBodies()) || builder_.MatchBeyond(search)) ++ways;
    }
    builder_.matched().Undo(before);
    return std::max<int64_t>(ways, 1);
  }

  /// Are the bodies matched with themselves, unmoved? Then all beyond them can stay too.
  bool StayInPlace(const std::vector<int>& bodies) {
    const Correspondence& matched = builder_.matched();
    return std::all_of(bodies.begin(), bodies.end(), [&](int body) {
      const Eigen::Matrix3d turned = matched.R().Value(body) - Eigen::Matrix3d::Identity();
      return matched.ImageOf(body) == body && turned.norm() <= kGeometryTolerance;
    });
  }

  Steps& steps_;
  MappingBuilder builder_;
};

}  // namespace

MappingCount CountSymmetries(const ScrewGraph& a, Steps& steps) {
  return MappingCounter(a, steps).Count();
}

}  // namespace morphbus::congruence
