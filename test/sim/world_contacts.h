#pragma once
// What touches in a world.

#include <algorithm>
#include <vector>

#include "sim/world_engine.h"

namespace morphbus::sim {

/// Contacts between bodies (-1 stands for the ground) that touch now.
struct WorldContacts {
  struct Contact {
    int body_1 = 0;
    int body_2 = 0;
    double depth_m = 0.0;
  };
  static std::vector<Contact> Of(const World& world) {
    std::vector<Contact> contacts;
    // A manifold holds the contact points of one pair; distances below 0 are depths.
    const btCollisionDispatcher& dispatcher = world.engine_->dispatcher;
    for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
      const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
      double depth = -1.0;
      for (int k = 0; k < manifold.getNumContacts(); ++k) {
        depth = std::max(depth, -static_cast<double>(manifold.getContactPoint(k).getDistance()));
      }
      if (depth < 0.0) continue;
      const int a = manifold.getBody0()->getUserIndex();
      const int b = manifold.getBody1()->getUserIndex();
      contacts.push_back({std::min(a, b), std::max(a, b), depth});
    }
    return contacts;
  }
};

}  // namespace morphbus::sim
