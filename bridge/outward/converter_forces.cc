// What pushes a robot from outside.

#include "bridge/outward/converter.h"

namespace morphbus::bridge {

void Converter::SendForces() {
  const bool some = !contacts_.empty() || !clock_.pushes().empty();
  if (!some && !sent_forces_) return;
  sent_forces_ = some;
  morphbus::Forces forces;
  SetTime(world_.time_us, forces.mutable_timestamp());
  forces.set_tick(world_.tick);
  const auto add = [&](int module, int link, const auto& force_W, morphbus::LinkForce* out) {
    out->set_module(run_->robot->modules[module].name);
    out->set_link(run_->TypeOf(module).links[link].name);
    out->set_north(force_W[0]);
    out->set_up(force_W[1]);
    out->set_east(force_W[2]);
  };
  for (const morphbus::contact_force_t& contact : contacts_) {
    const int module = contact.module_id;
    const int link = contact.link;
    // A damaged message may speak of links that there are not.
    if (!IsIndex(module, run_->robot->modules.size()) ||
        !IsIndex(link, run_->TypeOf(module).links.size())) {
      continue;
    }
    add(module, link, contact.force_n, forces.add_contacts());
  }
  for (const Push& push : clock_.pushes()) {
    // So may a command in a CLOCK.
    const std::optional<int> module = run_->robot->FindModule(push.module);
    if (!module) continue;
    // A module alone is pushed at its first link.
    const auto& links = run_->TypeOf(*module).links;
    int link = 0;
    while (!push.link.empty() && IsIndex(link, links.size()) && links[link].name != push.link) {
      ++link;
    }
    if (IsIndex(link, links.size())) add(*module, link, push.force_W, forces.add_pushes());
  }
  Send(OutwardTopic::kForces, world_.time_us, forces);
}

}  // namespace morphbus::bridge
