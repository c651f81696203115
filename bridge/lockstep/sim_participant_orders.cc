// Orders for modules that come from outside and go out with SENSORS: invocations to issue, and
// programs to spread.

#include <algorithm>
#include <map>
#include <morphbus/sensors_t.hpp>
#include <morphbus/transform_t.hpp>

#include "bridge/lockstep/sim_participant.h"
#include "bridge/wire/vm_codec.h"
#include "vm/limits.h"

namespace morphbus::bridge {
namespace {

/// Times that a package is given to a module that does not say that it has it.
constexpr int kMostRounds = 100;

}  // namespace

void SimParticipant::Invoke(size_t module, const vm::InvokeRequest& request) {
  MORPHBUS_CHECK(module < options_.modules.size());
  requests_.emplace_back(module, request);
}

void SimParticipant::Deploy(size_t module, uint64_t id, const std::vector<uint8_t>& package,
                            int64_t from_tick) {
  MORPHBUS_CHECK(module < options_.modules.size());
  MORPHBUS_CHECK(!package.empty() && package.size() <= vm::kMaxPackageBytes);
  EndDeployment();
  deployment_ = {module, id, package, from_tick};
}

void SimParticipant::EndDeployment() {
  if (deployment_ && deployment_->watched) {
    bus_->Unsubscribe(ChannelOf(options_.modules[deployment_->module].name, Topic::kTransform));
  }
  deployment_.reset();
}

int SimParticipant::HopsFrom(size_t module) const {
  // Readings lie in order of modules; dockings name their mates by id.
  std::map<int16_t, size_t> place;
  for (size_t i = 0; i < sensed_.size(); ++i) place[sensed_[i].module_id] = i;
  // Breadth first, from the module outwards.
  std::vector<int> hops(sensed_.size(), -1);
  std::vector<size_t> row = {module};
  if (module < hops.size()) hops[module] = 0;
  int most = 0;
  for (size_t next = 0; next < row.size() && row[next] < sensed_.size(); ++next) {
    for (const morphbus::docked_connector_t& docked : sensed_[row[next]].docked) {
      const auto mate = place.find(docked.mate_module);
      if (mate == place.end() || hops[mate->second] >= 0) continue;
      most = hops[mate->second] = hops[row[next]] + 1;
      row.push_back(mate->second);
    }
  }
  return most;
}

void SimParticipant::AddOrders(size_t part, int64_t tick, morphbus::sensors_t* sensors) {
  const std::vector<size_t>& members = sensors_parts_[part];
  const auto here = [&members](size_t module) {
    return std::find(members.begin(), members.end(), module) != members.end();
  };
  // Requests leave in the order they came in; the first one that is for another part holds up the
  // rest.
  sensors->requests.clear();
  while (!requests_.empty() && here(requests_.front().first) &&
         sensors->requests.size() < static_cast<size_t>(vm::kMaxRequests)) {
    ToRequest(requests_.front().second, options_.modules[requests_.front().first].id,
              &sensors->requests.emplace_back());
    requests_.pop_front();
  }
  sensors->num_requests = static_cast<int8_t>(sensors->requests.size());
  // Who is inspected is asked with its own reading.
  sensors->inspected.clear();
  for (const size_t module : members) {
    if (inspected_.erase(module) == 0) continue;
    sensors->inspected.push_back(static_cast<int16_t>(options_.modules[module].id));
  }
  sensors->num_inspected = static_cast<int8_t>(sensors->inspected.size());
  // One piece a tick keeps SENSORS within a datagram.
  sensors->pieces.clear();
  AddPiece(members, tick, &sensors->pieces);
  sensors->num_pieces = static_cast<int8_t>(sensors->pieces.size());
}

void SimParticipant::AddPiece(const std::vector<size_t>& members, int64_t tick,
                              std::vector<morphbus::deploy_piece_t>* pieces) {
  if (!deployment_ || tick < deployment_->from_tick) return;
  Deployment& deployment = *deployment_;
  const ExpectedModule& module = options_.modules[deployment.module];
  if (std::find(members.begin(), members.end(), deployment.module) == members.end()) return;
  // In real time nobody asks for a piece that was lost: the module is listened to instead.
  if (options_.realtime && !deployment.watched) {
    Listen(ChannelOf(module.name, Topic::kTransform), &SimParticipant::OnTransform, deployment.id);
    deployment.watched = true;
  }
  // The next bytes, with all that a receiver needs to place them.
  const size_t size = std::min(kMaxDeployPiece, deployment.package.size() - deployment.sent);
  morphbus::deploy_piece_t& piece = pieces->emplace_back();
  piece.module_id = static_cast<int16_t>(module.id);
  piece.hash = static_cast<int64_t>(deployment.id);
  piece.image_size = static_cast<int32_t>(deployment.package.size());
  piece.offset = static_cast<int32_t>(deployment.sent);
  piece.size = static_cast<int16_t>(size);
  const uint8_t* from = deployment.package.data() + deployment.sent;
  piece.bytes.assign(from, from + size);
  deployment.sent += size;
  if (deployment.sent == deployment.package.size()) {
    deployment.sent = 0;
    ++deployment.rounds;
  }
  // Over once all have gone out, in real time once it has them; one that never says so has got a
  // newer program, or is dead.
  const bool again = options_.realtime && !deployment.arrived && deployment.rounds < kMostRounds;
  if (deployment.rounds > 0 && !again) EndDeployment();
}

void SimParticipant::OnTransform(uint64_t id, const uint8_t* data, size_t size) {
  morphbus::transform_t transform;
  if (!Accept(data, size, &transform) || !deployment_ || deployment_->id != id) return;
  deployment_->arrived |= static_cast<uint64_t>(transform.news.hash) == id;
}

}  // namespace morphbus::bridge
