#pragma once
// How a search goes on from what it has seen: CMA-ES and NSGA-II, by pagmo.

#include <cstdint>
#include <memory>
#include <vector>

namespace morphbus::tools {

/// CMA-ES (Hansen, "The CMA Evolution Strategy: A Comparing Review", 2006) for one goal, NSGA-II
/// (Deb, Pratap, Agarwal, Meyarivan, "A Fast and Elitist Multiobjective Genetic Algorithm:
/// NSGA-II", IEEE Transactions on Evolutionary Computation 6 (2002)) for several.
enum class SearchAlgorithm { kCmaEs, kNsga2 };

/// One search in the unit cube for the least value of each goal. It asks for the vectors of a
/// generation all at once, so that they can be evaluated side by side, and is told their values:
/// what it asks for next depends on the seed and on these alone.
class SearchMethod {
 public:
  /// `first` is the first generation, whose size all others have: 5 or more, for NSGA-II a multiple
  /// of 4.
  SearchMethod(SearchAlgorithm algorithm, int goals, uint64_t seed,
               std::vector<std::vector<double>> first);
  ~SearchMethod();
  SearchMethod(const SearchMethod&) = delete;
  SearchMethod& operator=(const SearchMethod&) = delete;

  /// The vectors of the next generation, coordinates 0…1.
  std::vector<std::vector<double>> Ask();
  /// Their values, one for each goal, in the order of Ask().
  void Tell(const std::vector<std::vector<double>>& values);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Of points with a value for each goal, of which less is better, those that no other one is better
/// than in one goal and as good in the others; of equal ones the first. In order.
std::vector<size_t> ParetoFront(const std::vector<std::vector<double>>& values);

}  // namespace morphbus::tools
