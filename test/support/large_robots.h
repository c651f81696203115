#pragma once
// Robots of thousands of M-TRANs, as M3L text.

#include <cstdint>
#include <string>

namespace morphbus::test {

enum class LargeShape {
  kChain,    ///< A straight row.
  kLattice,  ///< A wall of bricks, each joined to all its neighbours: about two loops a module.
  kTree,     ///< A random spanning tree of that wall.
};

/// A text that imports models/mtran.m3l and defines one robot `large` of `modules` modules.
std::string LargeRobotText(LargeShape shape, int modules, uint64_t seed = 1);

/// A ring of M-TRANs, robot `large`: as many mappings as it has modules, eight times over.
std::string LargeRingText(int modules);

/// A row of ATRON cars of seven modules each (a body, two axles, four wheels), robot `large`.
/// Nothing tells the wheels' ways of turning apart.
std::string LargeTrainText(int cars);

}  // namespace morphbus::test
