#pragma once
// How much memory Bullet sets aside for contacts.

#include <btBulletCollisionCommon.h>

#include <algorithm>

namespace morphbus::sim {

/// Pools for the contacts of so many bodies. Bullet's default is room for 4096 pairs that touch:
/// 7 MB, which are cleared for every world and take a third of the time of a run of half a second.
/// A body mostly touches the ground and a neighbour or two; beyond its pools Bullet takes from the
/// heap.
inline btDefaultCollisionConstructionInfo ContactPools(size_t bodies) {
  btDefaultCollisionConstructionInfo pools;
  const int pairs = static_cast<int>(std::min<size_t>(16 + 4 * bodies, 4096));
  pools.m_defaultMaxPersistentManifoldPoolSize = pairs;
  pools.m_defaultMaxCollisionAlgorithmPoolSize = pairs;
  return pools;
}

}  // namespace morphbus::sim
