// How long the connection solver takes: real modules, connectors with many sub-points, and modules
// with many connectors. Each run is one whole list: candidates, hulls, numbering.

#include <benchmark/benchmark.h>

#include <cmath>

#include "compiler/solver/connection_problem.h"
#include "test/compiler/solver/known_modules.h"

namespace morphbus::solver {
namespace {

using Eigen::Vector3d;
using model::ModuleType;

void Solve(benchmark::State& state, const ModuleType& type, Condition condition, size_t expected) {
  const ConnectionProblem problem = test::SelfConnection(std::move(condition));
  const std::vector<ModuleType> types = {type};
  for (auto _ : state) {
    source::Diagnostics diagnostics;
    const model::ConnectionType result = SolveConnection(problem, types, &diagnostics);
    if (result.options.size() != expected) state.SkipWithError("wrong number of connections");
    benchmark::DoNotOptimize(result.options.data());
  }
}

void BM_Mtran(benchmark::State& state) {
  Solve(state, test::Mtran(0.0325),
        test::And({test::AllPointsCoincide(4), test::OppositeGenders(true)}), 72);
}
BENCHMARK(BM_Mtran)->Unit(benchmark::kMillisecond);

void BM_Molecube(benchmark::State& state) {
  Solve(state, test::Molecube(), test::AllPointsCoincide(4), 144);
}
BENCHMARK(BM_Molecube)->Unit(benchmark::kMillisecond);

void BM_Atron(benchmark::State& state) {
  Solve(state, test::Atron(false),
        test::And({test::AllPointsCoincide(3), test::OppositeGenders(false)}), 32);
}
BENCHMARK(BM_Atron)->Unit(benchmark::kMillisecond);

/// A cube of side 4 with `n` x `n` connectors on each face, each a cross of `points` sub-points.
ModuleType Cube(int n, int points) {
  ModuleType type;
  type.name = "CUBE";
  for (int face = 0; face < 6; ++face) {
    const Vector3d normal = (face < 3 ? 1.0 : -1.0) * Vector3d::Unit(face % 3);
    const Vector3d u = Vector3d::Unit((face + 1) % 3);
    const Vector3d v = normal.cross(u);
    for (int i = 0; i < n * n; ++i) {
      model::Connector c;
      c.name = "c" + std::to_string(type.connectors.size());
      const double x = 4.0 * (i % n + 0.5) / n - 2.0;
      const double y = 4.0 * (i / n + 0.5) / n - 2.0;
      c.p_MoCo_M = 2.0 * normal + x * u + y * v;
      for (int k = 0; k < points; ++k) {
        const double turn = 2.0 * M_PI * k / points;
        c.subpoint_names.push_back("_" + std::to_string(k + 1));
        c.subpoints.push_back(c.p_MoCo_M + 0.4 * std::cos(turn) * u + 0.4 * std::sin(turn) * v);
      }
      type.connectors.push_back(std::move(c));
    }
  }
  model::Link body;
  body.name = "body";
  for (int corner = 0; corner < 8; ++corner) {
    body.hull.emplace_back(corner & 1 ? 2.0 : -2.0, corner & 2 ? 2.0 : -2.0,
                           corner & 4 ? 2.0 : -2.0);
  }
  type.links = {body};
  return type;
}

/// One pair of connectors with 12 sub-points each.
void BM_TwelveSubpoints(benchmark::State& state) {
  ModuleType type = Cube(1, 12);
  type.connectors.resize(1);
  Solve(state, type, test::AllPointsCoincide(12), 12);
}
BENCHMARK(BM_TwelveSubpoints)->Unit(benchmark::kMillisecond);

/// 24 connectors of 4 sub-points: 576 pairs, each with four turns outside and four inside.
void BM_TwentyFourConnectors(benchmark::State& state) {
  Solve(state, Cube(2, 4), test::AllPointsCoincide(4), 24 * 24 * 4);
}
BENCHMARK(BM_TwentyFourConnectors)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace morphbus::solver

BENCHMARK_MAIN();
