// Growth with size: checking and assembling a model from its text, forward kinematics of all links,
// the kinematic graph, congruence. Each shape at 1,000, 3,000 and 10,000 modules; the fitted
// complexity and its error (RMS) are printed.

#include <benchmark/benchmark.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "compiler/congruence/congruence.h"
#include "compiler/m3l/compile.h"
#include "compiler/model/kinematic_graph.h"
#include "compiler/model/kinematic_tree.h"
#include "test/support/large_robots.h"
#include "test/support/source_dir.h"

namespace morphbus {
namespace {

using test::LargeShape;

const model::Model& LargeModel(LargeShape shape, int modules) {
  static std::map<std::pair<LargeShape, int>, model::Model> models;
  const auto [it, fresh] = models.try_emplace({shape, modules});
  if (fresh) {
    it->second = *m3l::CompileText("large.m3l", test::LargeRobotText(shape, modules)).model;
  }
  return it->second;
}

void CheckAndAssemble(benchmark::State& state, LargeShape shape) {
  const int modules = static_cast<int>(state.range(0));
  const std::string text = test::LargeRobotText(shape, modules);
  for (auto _ : state) {
    benchmark::DoNotOptimize(m3l::CompileText("large.m3l", text).model->robots.size());
  }
  state.SetComplexityN(modules);
}

void ForwardKinematics(benchmark::State& state, LargeShape shape) {
  const int modules = static_cast<int>(state.range(0));
  const model::Model& model = LargeModel(shape, modules);
  const model::KinematicTree tree(model, *model.FindRobot("large"));
  const std::vector<double> q(static_cast<size_t>(tree.num_joints()), 0.1);
  std::vector<model::Pose> X_RL(static_cast<size_t>(tree.num_links()));
  for (auto _ : state) {
    tree.Evaluate(q.data(), X_RL.data());
    benchmark::ClobberMemory();
  }
  state.SetComplexityN(modules);
}

void Graph(benchmark::State& state, LargeShape shape) {
  const int modules = static_cast<int>(state.range(0));
  const model::Model& model = LargeModel(shape, modules);
  for (auto _ : state) {
    benchmark::DoNotOptimize(model::BuildKinematicGraph(model, *model.FindRobot("large")));
  }
  state.SetComplexityN(modules);
}

void Congruence(benchmark::State& state, LargeShape shape) {
  const model::Model& model = LargeModel(shape, static_cast<int>(state.range(0)));
  const model::Robot& robot = *model.FindRobot("large");
  int64_t mappings = 0;
  for (auto _ : state) mappings = congruence::Compare(model, robot, model, robot).count;
  state.counters["mappings"] = static_cast<double>(mappings);
}

/// Of a robot with itself where much looks alike.
void CongruenceOf(benchmark::State& state, const std::string& text) {
  const model::Model model = *m3l::CompileText("large.m3l", text).model;
  const model::Robot& robot = *model.FindRobot("large");
  int64_t mappings = 0;
  for (auto _ : state) mappings = congruence::Compare(model, robot, model, robot).count;
  state.counters["mappings"] = static_cast<double>(mappings);
}

void CongruenceOfQuadrupeds(benchmark::State& state) {
  const model::Model model = *m3l::CompileFiles({test::SourcePath("models/mtran.m3l")}).model;
  const model::Robot& a = *model.FindRobot("quadruped");
  const model::Robot& b = *model.FindRobot("equivalent_quadruped");
  for (auto _ : state) benchmark::DoNotOptimize(congruence::Compare(model, a, model, b).count);
}
BENCHMARK(CongruenceOfQuadrupeds)->Unit(benchmark::kMillisecond);

void Register(const std::string& name, void (*function)(benchmark::State&, LargeShape),
              bool grows) {
  const std::pair<const char*, LargeShape> shapes[] = {{"chain", LargeShape::kChain},
                                                       {"lattice", LargeShape::kLattice},
                                                       {"tree", LargeShape::kTree}};
  for (const auto& [shape_name, shape] : shapes) {
    auto* bench = benchmark::RegisterBenchmark((name + "/" + shape_name).c_str(), function, shape);
    bench->Unit(benchmark::kMillisecond)->Arg(1000);
    if (grows) bench->Arg(3000)->Arg(10000)->Complexity(benchmark::oN);
  }
}

}  // namespace
}  // namespace morphbus

int main(int argc, char** argv) {
  morphbus::Register("CheckAndAssemble", morphbus::CheckAndAssemble, true);
  morphbus::Register("ForwardKinematics", morphbus::ForwardKinematics, true);
  morphbus::Register("Graph", morphbus::Graph, true);
  morphbus::Register("Congruence", morphbus::Congruence, false);
  const std::pair<const char*, std::string> texts[] = {
      {"Congruence/ring/1000", morphbus::test::LargeRingText(1000)},
      {"Congruence/train/1001", morphbus::test::LargeTrainText(143)}};
  for (const auto& [name, text] : texts) {
    benchmark::RegisterBenchmark(name, morphbus::CongruenceOf, text)->Unit(benchmark::kMillisecond);
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
