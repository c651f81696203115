#pragma once
// Robots on which the back ends are tried: the paper's two (with loops), random trees, and a module
// by hand that has what M-TRAN lacks.

#include <random>
#include <string>
#include <vector>

#include "compiler/emit/robot_tree.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/model/robot_model.h"

namespace morphbus::test {

struct ExportCase {
  std::string name;
  model::Model model;
  model::Robot robot;
};

/// A module with joints of all types about oblique axes, a link without hull, a flat hull, and a
/// loop of links inside it.
model::Model GadgetModel();

/// The quadrupeds of the paper, `num_trees` random trees of M-TRAN modules, a robot of two gadgets,
/// and every robot in models/.
std::vector<ExportCase> ExportCases(int num_trees);

/// A module type `world` whose links have names that other formats use or reserve: world, floor,
/// __b__ (with a joint __j__) and robot_frame.
extern const char* const kAwkwardNames;

/// A robot, or a module type alone, of a model given as text.
ExportCase CompiledCase(const std::string& m3l, const std::string& robot);
ExportCase CompiledModule(const std::string& m3l, const std::string& type);

/// A module with a joint, whose arm is a box and looks otherwise: a mesh of 6 triangles with a
/// dent, which is orange, and a sphere in its module's colour.
ExportCase LookingRobot();

/// Values within the joints' limits; fixed joints get 0.
model::JointValues RandomValues(const ExportCase& robot, std::mt19937& random);

/// "m1.active_block"
std::string LinkName(const ExportCase& robot, size_t module, size_t link);

}  // namespace morphbus::test
