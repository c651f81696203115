// How modules come to a SimParticipant's run while it goes on, and how they are lost to it: a
// process that takes the place of one that died, and a module that the run does without.

#include <algorithm>
#include <morphbus/admit_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <string>
#include <utility>
#include <vector>

#include "bridge/lockstep/sim_participant.h"

namespace morphbus::bridge {
namespace {

/// A module that was heard within so long, in microseconds, keeps its place: two processes of one
/// name must not take turns.
constexpr int64_t kAliveUs = 100'000;

}  // namespace

std::string SimParticipant::TakePlace(int process, const morphbus::hello_t& hello) {
  const std::string claims = "a process (pid " + std::to_string(hello.pid) +
                             ") claims to be incarnation " + std::to_string(hello.incarnation) +
                             " of " + hello.process + ", ";
  const bool module = static_cast<size_t>(process) < options_.modules.size();
  if (!module) return claims + "which cannot begin anew";
  if (machine_.lost(process)) return claims + "which the run goes on without";
  if (machine_.ending()) return claims + "but the run is over";
  // In real time nobody waits for answers, so only silence tells.
  const bool answered = machine_.answered(process) && !options_.realtime;
  if (answered || now_us() - heard_us_[process] < kAliveUs) return claims + "which answers";
  if (const std::string unfit = HelloError(process, hello); !unfit.empty()) return unfit;
  claims_[process] = hello.claim;
  incarnations_[process] = static_cast<uint32_t>(hello.incarnation);
  // The dead one can no longer say what it published.
  if (num_actuators_[process] > 0) unvouched_ = true;
  Admit(process);
  if (replaced_) replaced_(static_cast<size_t>(process), machine_.tick());
  return "";
}

void SimParticipant::Admit(int process) {
  if (static_cast<size_t>(process) >= options_.modules.size()) return;
  // The present tick is the first that the predecessor has not answered, or else the next one is.
  // In real time the newest sensors decide.
  const int64_t last = machine_.answered(process) ? machine_.tick() : machine_.tick() - 1;
  Say(kSimProcess, Topic::kAdmit,
      morphbus::admit_t{{},
                        names_[process],
                        claims_[process],
                        last,
                        num_actuators_[process],
                        num_status_[process]});
}

std::vector<std::string> SimParticipant::GoneModules() const {
  std::vector<std::string> gone;
  for (size_t i = 0; i < options_.modules.size(); ++i) {
    if (machine_.gone(static_cast<int>(i))) gone.push_back(options_.modules[i].name);
  }
  return gone;
}

void SimParticipant::HideLostModules() {
  const auto lost = [this](int id) {
    return static_cast<size_t>(id) < options_.modules.size() && machine_.lost(id);
  };
  // A connector tells of a mate what the mate's own electronics say: of a dead one, nothing.
  for (morphbus::module_sensors_t& reading : sensed_) {
    const bool gone = lost(reading.module_id);
    std::erase_if(reading.docked, [&](const morphbus::docked_connector_t& docked) {
      return gone || lost(docked.mate_module);
    });
    reading.num_docked = static_cast<int8_t>(reading.docked.size());
  }
}

}  // namespace morphbus::bridge
