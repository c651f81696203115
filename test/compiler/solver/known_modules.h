#pragma once
// Module types whose connections the literature counts, built by hand, in metres with unit 1:
// M-TRAN as in the paper's Fig. 8, Molecube and ATRON from their published geometry.

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "compiler/solver/connection_problem.h"

namespace morphbus::test {

using Eigen::Vector3d;

/// Figure 8: two blocks, a bar, six connectors of four sub-points. `unit` metres a model unit.
model::ModuleType Mtran(double unit = 1.0);
/// A cube cut by the plane normal to its long diagonal; six genderless faces.
model::ModuleType Molecube();
/// Two half shells turning about z; `square`: four sub-points a connector, else three, scalene.
model::ModuleType Atron(bool square);

/// p_a and p_b coincide, and so do p_a's sub-points `_1` to `_num_subpoints` with some of p_b's.
solver::Condition AllPointsCoincide(int num_subpoints);
/// The paper's condition on genders; `hooks` adds that the male hooks are extended.
solver::Condition OppositeGenders(bool hooks);
solver::Condition And(std::vector<solver::Condition> parts);
solver::Condition Or(std::vector<solver::Condition> parts);
solver::Condition Not(solver::Condition part);
solver::Condition Coincident(const std::string& subpoint_of_a);  ///< "" for the centres.
solver::Condition Compare(solver::Side side, const std::string& attribute,
                          model::AttributeValue value,
                          solver::CompareOp op = solver::CompareOp::kEq);

/// Problem of a type with itself, at index 0.
solver::ConnectionProblem SelfConnection(solver::Condition condition);

/// The M-TRAN model with its solved connection and no robots.
model::Model MtranModel(double unit = 1.0);

/// One entry of a robot's connections; number absent for the default.
struct Mating {
  std::string a;
  std::string connector_a;
  std::string b;
  std::string connector_b;
  std::optional<int> number;
};
/// Modules m1 … m`count` of type 0 joined by `matings`; root is m`root`'s link, R is X_LR there.
model::Robot Assemble(const model::Model& model, const std::string& name, int count,
                      const std::vector<Mating>& matings, int root_module, int root_link,
                      const model::Pose& X_LR);
/// The robots of the paper's Fig. 9, frame in m5's passive block at (1, 0, 0).
model::Robot Quadruped(const model::Model& model, double unit = 1.0);
model::Robot EquivalentQuadruped(const model::Model& model, double unit = 1.0);

}  // namespace morphbus::test
