#include "test/support/toy_model.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "compiler/base/check.h"

namespace morphbus::test {

namespace {

constexpr double kInfinity = INFINITY;

model::Connector ConnectorOn(const std::string& name, int link) {
  model::Connector c;
  c.name = name;
  c.link = link;
  c.p_MoCo_M.setZero();
  return c;
}

model::Joint JointOf(const std::string& name, model::JointType type, int a, int b,
                     const Eigen::Vector3d& origin, const Eigen::Vector3d& axis, double lower,
                     double upper) {
  model::Joint joint;
  joint.name = name;
  joint.type = type;
  joint.link_a = a;
  joint.link_b = b;
  joint.p_MoJo_M = origin;
  joint.axis = axis.normalized();
  joint.lower = lower;
  joint.upper = upper;
  return joint;
}

model::ModuleType HingeType() {
  model::ModuleType type;
  type.name = "Hinge";
  for (const char* name : {"one", "two"}) {
    type.links.emplace_back();
    type.links.back().name = name;
  }
  type.joints.push_back(JointOf("turn", model::JointType::kRevolute, 0, 1, {0.02, 0, 0},
                                {0, 0.6, 0.8}, -M_PI / 2, M_PI / 2));
  for (int i = 0; i < 6; ++i) {
    type.connectors.push_back(ConnectorOn("c" + std::to_string(i), i / 3));
  }
  return type;
}

model::ModuleType RailType() {
  model::ModuleType type;
  type.name = "Rail";
  for (const char* name : {"base", "cover", "slider", "rotor"}) {
    type.links.emplace_back();
    type.links.back().name = name;
  }
  type.joints.push_back(
      JointOf("fixed", model::JointType::kFixed, 1, 0, {0, 0, 0}, {1, 0, 0}, 0, 0));
  type.joints.push_back(
      JointOf("slide", model::JointType::kPrismatic, 2, 1, {0, 0, 0}, {0, 0, 1}, -0.05, 0.05));
  type.joints.back().speed = 0.1;
  type.joints.push_back(JointOf("spin", model::JointType::kContinuous, 3, 2, {0, 0.03, 0},
                                {1, 0, 0}, -kInfinity, kInfinity));
  for (int i = 0; i < 4; ++i) {
    type.connectors.push_back(ConnectorOn("d" + std::to_string(i), i));
  }
  return type;
}

model::Pose RandomPose(std::mt19937_64* random) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  model::Pose X = model::Pose::Identity();
  X.translation() = 0.08 * Eigen::Vector3d(u(*random), u(*random), u(*random));
  X.linear() =
      Eigen::AngleAxisd(3.0 * u(*random),
                        Eigen::Vector3d(u(*random), u(*random), u(*random) + 2.0).normalized())
          .toRotationMatrix();
  return X;
}

model::ConnectionType HingeToHinge(std::mt19937_64* random) {
  model::ConnectionType type;
  type.name = "hinges";
  for (int a = 0; a < 6; ++a) {
    for (int b = a; b < 6; ++b) {
      for (int way = 0; way < 2; ++way) {
        model::ConnectionOption option;
        option.connector_a = a;
        option.connector_b = b;
        option.X_AB = RandomPose(random);
        type.options.push_back(option);
        std::swap(option.connector_a, option.connector_b);
        option.X_AB = option.X_AB.inverse();
        type.options.push_back(option);
      }
    }
  }
  return type;
}

struct Free {
  int module;
  int connector;
};

/// Numbers of options of either connection that mate these two connectors; `*type` names it.
std::vector<int> OptionsFor(const model::Model& model, int type_a, int a, int type_b, int b,
                            int* type) {
  std::vector<int> found;
  for (size_t t = 0; t < model.connection_types.size(); ++t) {
    const model::ConnectionType& connection = model.connection_types[t];
    if (connection.type_a != type_a || connection.type_b != type_b) continue;
    for (size_t o = 0; o < connection.options.size(); ++o) {
      if (connection.options[o].connector_a == a && connection.options[o].connector_b == b) {
        found.push_back(static_cast<int>(o));
        *type = static_cast<int>(t);
      }
    }
  }
  return found;
}

bool Dock(const model::Model& model, const Free& x, const Free& y, std::mt19937_64* random,
          model::Robot* robot) {
  for (const auto& [a, b] : {std::make_pair(x, y), std::make_pair(y, x)}) {
    int type = 0;
    const std::vector<int> options =
        OptionsFor(model, robot->modules[static_cast<size_t>(a.module)].type, a.connector,
                   robot->modules[static_cast<size_t>(b.module)].type, b.connector, &type);
    if (options.empty()) continue;
    const int option = options[(*random)() % options.size()];
    robot->dockings.push_back({a.module, a.connector, b.module, b.connector, type, option});
    return true;
  }
  return false;
}

/// Takes a random element out.
Free Take(std::vector<Free>* from, std::mt19937_64* random) {
  const size_t i = (*random)() % from->size();
  const Free taken = (*from)[i];
  from->erase(from->begin() + static_cast<std::ptrdiff_t>(i));
  return taken;
}

void AddModule(const model::Model& model, int type, std::mt19937_64* random, model::Robot* robot) {
  model::ModuleInstance module;
  module.name = "m" + std::to_string(robot->modules.size() + 1);
  module.type = type;
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  for (const model::Joint& joint : model.module_types[static_cast<size_t>(type)].joints) {
    const double range = std::isfinite(joint.upper) ? joint.upper : 3.0;
    module.start.push_back(joint.type == model::JointType::kFixed ? 0.0 : range * u(*random));
  }
  robot->modules.push_back(module);
}

}  // namespace

model::Model ToyModel() {
  std::mt19937_64 random(7);
  model::Model model;
  model.module_types = {HingeType(), RailType()};
  model.connection_types.push_back(HingeToHinge(&random));
  model::ConnectionType to_rail;
  to_rail.name = "hinge_to_rail";
  to_rail.type_b = 1;
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b < 4; ++b) {
      model::ConnectionOption option;
      option.connector_a = a;
      option.connector_b = b;
      option.X_AB = RandomPose(&random);
      to_rail.options.push_back(option);
    }
  }
  model.connection_types.push_back(to_rail);
  for (model::ConnectionType& type : model.connection_types) {
    for (size_t i = 0; i < type.options.size(); ++i) {
      type.options[i].number = static_cast<int>(i) + 1;
    }
  }
  return model;
}

model::Robot RandomRobot(const model::Model& model, int modules, int loops, uint64_t seed) {
  std::mt19937_64 random(seed);
  model::Robot robot;
  robot.name = "random";
  std::vector<Free> free;
  while (static_cast<int>(robot.modules.size()) < modules) {
    // The first is a Hinge, since Rails do not mate with each other.
    const int type = robot.modules.empty() ? 0 : static_cast<int>(random() % 3 == 0);
    AddModule(model, type, &random, &robot);
    const int module = static_cast<int>(robot.modules.size()) - 1;
    std::vector<Free> own;
    const auto& connectors = model.module_types[static_cast<size_t>(type)].connectors;
    for (size_t c = 0; c < connectors.size(); ++c) own.push_back({module, static_cast<int>(c)});
    while (module > 0) {
      const Free mine = own[random() % own.size()];
      const Free mate = free[random() % free.size()];
      if (!Dock(model, mate, mine, &random, &robot)) continue;
      std::erase_if(own, [&](const Free& f) { return f.connector == mine.connector; });
      std::erase_if(free, [&](const Free& f) {
        return f.module == mate.module && f.connector == mate.connector;
      });
      break;
    }
    free.insert(free.end(), own.begin(), own.end());
  }
  for (int i = 0; i < loops && free.size() > 1; ++i) {
    const Free a = Take(&free, &random);
    const Free b = Take(&free, &random);
    if (a.module != b.module) Dock(model, a, b, &random, &robot);
  }
  return robot;
}

model::Robot ChainRobot(const model::Model& model, int modules) {
  std::mt19937_64 random(3);
  model::Robot robot;
  robot.name = "chain";
  for (int i = 0; i < modules; ++i) {
    AddModule(model, 0, &random, &robot);
    if (i > 0) MORPHBUS_CHECK(Dock(model, {i - 1, 5}, {i, 0}, &random, &robot));
  }
  return robot;
}

namespace {

/// Longest finite shortest path, all edges of length one: breadth first from every node.
int LongestPath(size_t n, const std::vector<std::pair<size_t, size_t>>& edges) {
  std::vector<std::vector<size_t>> next(n);
  for (const auto& [a, b] : edges) {
    next[a].push_back(b);
    next[b].push_back(a);
  }
  int longest = 0;
  for (size_t from = 0; from < n; ++from) {
    std::vector<int> distance(n, -1);
    std::vector<size_t> queue = {from};
    distance[from] = 0;
    for (size_t i = 0; i < queue.size(); ++i) {
      const size_t at = queue[i];
      longest = std::max(longest, distance[at]);
      for (const size_t to : next[at]) {
        if (distance[to] >= 0) continue;
        distance[to] = distance[at] + 1;
        queue.push_back(to);
      }
    }
  }
  return longest;
}

}  // namespace

int DiameterOf(const model::Robot& robot) {
  std::vector<std::pair<size_t, size_t>> edges;
  for (const model::Docking& docking : robot.dockings) {
    edges.emplace_back(docking.module_a, docking.module_b);
  }
  return LongestPath(robot.modules.size(), edges);
}

int BodyDiameterOf(const model::Model& model, const model::Robot& robot) {
  // Nodes are (module, link); links joined by a fixed joint are one.
  constexpr size_t kStride = 16;
  const auto node = [&](int module, int connector) {
    const model::ModuleType& type = model.TypeOf(robot, module);
    int link = type.connectors[static_cast<size_t>(connector)].link;
    for (const model::Joint& joint : type.joints) {
      if (joint.type == model::JointType::kFixed && joint.link_a == link) link = joint.link_b;
    }
    return static_cast<size_t>(module) * kStride + static_cast<size_t>(link);
  };
  std::vector<std::pair<size_t, size_t>> edges;
  for (const model::Docking& docking : robot.dockings) {
    edges.emplace_back(node(docking.module_a, docking.connector_a),
                       node(docking.module_b, docking.connector_b));
  }
  return LongestPath(robot.modules.size() * kStride, edges);
}

}  // namespace morphbus::test
