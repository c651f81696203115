#include "tools/sweep/search_method.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <optional>
#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/algorithms/nsga2.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>
#include <utility>

/// For pagmo, with which this file is linked (tools/CMakeLists.txt): it counts combinations by
/// libm's function, whose last bits differ from machine to machine. No search of ours asks it to.
extern "C" double lgamma(double /*x*/) noexcept { std::abort(); }

namespace morphbus::tools {
namespace {

using Vector = pagmo::vector_double;

/// What stands between pagmo, which evaluates one vector after the other, and a caller who knows
/// many at once.
struct Evaluations {
  size_t goals = 1;
  /// Whether values are known, or vectors only gathered.
  bool known = false;
  std::vector<Vector> asked;
  std::map<Vector, Vector> values;
};

/// The problem as pagmo sees it.
struct UnitCube {
  std::shared_ptr<Evaluations> evaluations;
  size_t dimensions = 1;

  [[nodiscard]] Vector fitness(const Vector& x) const {
    if (evaluations->known) return evaluations->values.at(x);
    evaluations->asked.push_back(x);
    return Vector(evaluations->goals, 0.0);
  }
  [[nodiscard]] std::pair<Vector, Vector> get_bounds() const {
    return {Vector(dimensions, 0.0), Vector(dimensions, 1.0)};
  }
  [[nodiscard]] size_t get_nobj() const { return evaluations->goals; }
};

/// One generation at a time.
pagmo::algorithm AlgorithmOf(SearchAlgorithm algorithm, unsigned seed) {
  if (algorithm == SearchAlgorithm::kNsga2) {
    return pagmo::algorithm(pagmo::nsga2(1, 0.95, 10.0, 1.0 / 6, 50.0, seed));
  }
  // A third of each range at first; it never stops by itself, and remembers what it has learned.
  constexpr double kAuto = -1;
  constexpr double kStep = 0.3;
  return pagmo::algorithm(
      pagmo::cmaes(1, kAuto, kAuto, kAuto, kAuto, kStep, 0.0, 0.0, true, true, seed));
}

}  // namespace

struct SearchMethod::State {
  std::vector<Vector> first;
  unsigned seed = 0;
  std::shared_ptr<Evaluations> evaluations;
  pagmo::algorithm algorithm;
  pagmo::problem problem;
  /// Once the first generation is known.
  std::optional<pagmo::population> population;
};

SearchMethod::SearchMethod(SearchAlgorithm algorithm, int goals, uint64_t seed,
                           std::vector<std::vector<double>> first)
    : state_(std::make_unique<State>()) {
  state_->seed = static_cast<unsigned>(seed);
  state_->evaluations = std::make_shared<Evaluations>();
  state_->evaluations->goals = static_cast<size_t>(goals);
  state_->algorithm = AlgorithmOf(algorithm, state_->seed);
  state_->problem = pagmo::problem(UnitCube{state_->evaluations, first.front().size()});
  state_->first = std::move(first);
}
SearchMethod::~SearchMethod() = default;

std::vector<std::vector<double>> SearchMethod::Ask() {
  if (!state_->population) return state_->first;
  // No vector of a generation depends on the values of that generation: a copy of the algorithm
  // asks for the same ones as the algorithm itself will, whatever it is told.
  state_->evaluations->known = false;
  state_->evaluations->asked.clear();
  const pagmo::algorithm copy = state_->algorithm;
  copy.evolve(*state_->population);
  return state_->evaluations->asked;
}

void SearchMethod::Tell(const std::vector<std::vector<double>>& values) {
  if (!state_->population) {
    state_->population.emplace(state_->problem, 0u, state_->seed);
    for (size_t i = 0; i < values.size(); ++i) {
      state_->population->push_back(state_->first[i], values[i]);
    }
    return;
  }
  state_->evaluations->known = true;
  state_->evaluations->values.clear();
  for (size_t i = 0; i < values.size(); ++i) {
    state_->evaluations->values[state_->evaluations->asked[i]] = values[i];
  }
  state_->population = state_->algorithm.evolve(*state_->population);
}

std::vector<size_t> ParetoFront(const std::vector<std::vector<double>>& values) {
  // Whether a is as good as b in all goals, and either better in one or the earlier one of equals.
  const auto beats = [&values](size_t a, size_t b) {
    bool better = a < b;
    for (size_t goal = 0; goal < values[a].size(); ++goal) {
      if (values[a][goal] > values[b][goal]) return false;
    }
    return better || values[a] != values[b];
  };
  std::vector<size_t> front;
  for (size_t i = 0; i < values.size(); ++i) {
    bool beaten = false;
    for (size_t other = 0; other < values.size() && !beaten; ++other) {
      beaten = other != i && beats(other, i);
    }
    if (!beaten) front.push_back(i);
  }
  return front;
}

}  // namespace morphbus::tools
