#include "test/support/large_robots.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "test/support/source_dir.h"

namespace morphbus::test {
namespace {

struct Edge {
  int a;
  int b;
  const char* connectors[2];
};

/// Rows of `width` bricks, every other one moved by half a brick. Along x a brick's c2 meets the
/// next one's c5; upwards its c1 the c4 of the brick at the far half, its c6 the c3 of the other.
std::vector<Edge> WallEdges(int modules, int width) {
  std::vector<Edge> edges;
  const auto add = [&](int a, int b, const char* c_a, const char* c_b) {
    if (a >= 0 && b < modules) edges.push_back({a, b, {c_a, c_b}});
  };
  for (int m = 0; m < modules; ++m) {
    const int column = m % width;
    const bool odd = m / width % 2 == 1;
    if (column + 1 < width) add(m, m + 1, "c2", "c5");
    const int below = m - width;
    if (odd) {
      add(below, m, "c1", "c4");
      if (column + 1 < width) add(below + 1, m, "c6", "c3");
    } else {
      add(below, m, "c6", "c3");
      if (column > 0) add(below - 1, m, "c1", "c4");
    }
  }
  return edges;
}

std::vector<Edge> SpanningTree(std::vector<Edge> edges, int modules, uint64_t seed) {
  std::mt19937_64 random(seed);
  for (size_t i = edges.size(); i > 1; --i) std::swap(edges[i - 1], edges[random() % i]);
  std::vector<int> parent(static_cast<size_t>(modules));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int m) {
    while (parent[static_cast<size_t>(m)] != m) {
      m = parent[static_cast<size_t>(m)] =
          parent[static_cast<size_t>(parent[static_cast<size_t>(m)])];
    }
    return m;
  };
  std::erase_if(edges, [&](const Edge& edge) {
    const int a = root(edge.a);
    const int b = root(edge.b);
    parent[static_cast<size_t>(a)] = b;
    return a == b;
  });
  return edges;
}

}  // namespace

std::string LargeRobotText(LargeShape shape, int modules, uint64_t seed) {
  const int width = shape == LargeShape::kChain
                        ? modules
                        : static_cast<int>(std::ceil(std::sqrt(static_cast<double>(modules))));
  std::vector<Edge> edges = WallEdges(modules, width);
  if (shape == LargeShape::kTree) edges = SpanningTree(std::move(edges), modules, seed);
  std::string text = "import \"" + SourcePath("models/mtran.m3l") + "\"\nrobot large:\n  modules=(";
  for (int m = 0; m < modules; ++m) {
    text += (m == 0 ? "MTRAN m" : ",\n    MTRAN m") + std::to_string(m);
  }
  text += "),\n  connections=(";
  for (size_t i = 0; i < edges.size(); ++i) {
    // A half turn from the default: all bricks lie the same way up.
    text += (i == 0 ? "(m" : ",\n    (m") + std::to_string(edges[i].a) + "." +
            edges[i].connectors[0] + ",m" + std::to_string(edges[i].b) + "." +
            edges[i].connectors[1] + ",rot=180)";
  }
  return text + ")\n";
}

namespace {

/// Robot `large`; the lists in parentheses.
std::string RobotText(const std::string& file, const std::string& modules,
                      const std::string& connections, const std::string& joints = {}) {
  std::string text = "import \"" + SourcePath("models/") + file + "\"\nrobot large: modules=(" +
                     modules + "), connections=(" + connections + ")";
  if (!joints.empty()) text += ", joints=(" + joints + ")";
  return text + "\n";
}

}  // namespace

std::string LargeRingText(int modules) {
  std::string names;
  std::string connections;
  std::string joints;
  const std::string count = std::to_string(modules);
  for (int m = 0; m < modules; ++m) {
    const std::string comma = m == 0 ? "" : ", ";
    const std::string name = "m" + std::to_string(m);
    const std::string next = "m" + std::to_string((m + 1) % modules);
    names += comma + "MTRAN " + name;
    connections += comma + "(" + name + ".c2, " + next + ".c5, rot=180)";
    joints += comma + name + ".joint_1=-pi/" + count + ", " + name + ".joint_2=pi/" + count;
  }
  return RobotText("mtran.m3l", names, connections, joints);
}

std::string LargeTrainText(int cars) {
  std::string names;
  std::string connections;
  const auto join = [&](const std::string& a, const std::string& b) {
    connections += (connections.empty() ? "(" : ", (") + a + ", " + b + ")";
  };
  for (int car = 0; car < cars; ++car) {
    const std::string n = std::to_string(car);
    for (const char* part : {"body", "front", "rear", "fl", "fr", "rl", "rr"}) {
      names += (names.empty() ? "ATRON " : ", ATRON ") + std::string(part) + n;
    }
    join("body" + n + ".c3", "front" + n + ".c0");
    join("body" + n + ".c7", "rear" + n + ".c0");
    join("front" + n + ".c5", "fl" + n + ".c0");
    join("front" + n + ".c7", "fr" + n + ".c0");
    join("rear" + n + ".c5", "rl" + n + ".c0");
    join("rear" + n + ".c7", "rr" + n + ".c0");
    if (car > 0) join("body" + std::to_string(car - 1) + ".c1", "body" + n + ".c4");
  }
  return RobotText("atron.m3l", names, connections);
}

}  // namespace morphbus::test
