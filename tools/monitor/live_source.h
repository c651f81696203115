#pragma once
// A run that goes on, for the monitor: what is on its bus, and commands to it.

#include <memory>
#include <string>
#include <vector>

#include "bridge/bus/bus.h"
#include "bridge/outward/converter.h"
#include "bridge/wire/sealed_bus.h"
#include "tools/control/commander.h"
#include "tools/machine/run_choice.h"
#include "tools/machine/wall_clock.h"
#include "tools/monitor/channel_rates.h"
#include "tools/monitor/monitor_source.h"
#include "tools/monitor/present_tick.h"
#include "tools/monitor/program_text.h"
#include "tools/monitor/role_inquiry.h"
#include "tools/monitor/run_outline.h"

namespace morphbus::tools {

/// Listens to one run. It is no party of it: nobody waits for it, and what it misses is only
/// missing in what viewers see.
class LiveSource : public MonitorSource {
 public:
  /// Finds the run, enters its private network if it has one, and gets its description, from its
  /// folder or from the bus (for which it waits some seconds). Fails if there is no such run, or if
  /// it has no bus. Call before any thread is started. A run of this machine that this user owns
  /// can be controlled.
  static Result<std::unique_ptr<LiveSource>> Create(const RunChoice& choice);
  ~LiveSource() override;

  // As in MonitorSource.
  [[nodiscard]] Json Info() const override;
  [[nodiscard]] std::vector<std::string> services() const override;
  [[nodiscard]] Result<logger::RunLog> Outline() override { return outline_.Log(); }
  [[nodiscard]] int64_t outline_version() const override { return outline_.version(); }
  void Open(bridge::SessionHub* server, size_t first_channel, bool tells_time) override;
  int Step(int wait_ms) override;
  void Take(const bridge::ClientRequest& request, const std::string& what) override;

 private:
  /// With the run's key (null: it is not at hand) only what is authentic is shown.
  LiveSource(std::shared_ptr<const bridge::RunModel> run, std::string description,
             std::unique_ptr<bridge::Bus> bus, const bridge::RunKey* key);
  /// A message of the bus: counts it, and sends what it means to all clients.
  void OnMessage(std::string_view channel, const uint8_t* data, size_t size);
  /// Finds out why modules have no role now, for a client.
  void AskForRoles(const bridge::ClientRequest& request);
  /// Gives a command for a client and tells it what became of it.
  void Command(const bridge::ClientRequest& request, const std::string& text,
               const std::string& program);

  std::shared_ptr<const bridge::RunModel> run_;
  std::string description_;  ///< The run's, serialized.
  // The network's bus, what lets through what is authentic (null without a key), and which of the
  // two is listened to.
  std::unique_ptr<bridge::Bus> lcm_;
  std::unique_ptr<bridge::SealedBus> sealed_;
  bridge::Bus* bus_;
  ProgramTexts texts_;
  std::unique_ptr<Commander> commander_;  ///< Null for a run that cannot be controlled.
  std::unique_ptr<bridge::Converter> converter_;
  PresentTick present_;
  RunOutline outline_;
  bridge::OutwardSink sink_;  ///< To all clients; empty before Open().
  ChannelRates rates_;
  WallTimer timer_;
  double next_counts_s_ = 1.0;  ///< When the channels' rates are told next, on `timer_`.
  double counted_s_ = -1.0;     ///< Sim time up to which they were told; below 0 before CLOCK.
  std::unique_ptr<RoleInquiry> inquiry_;  ///< Null until somebody asks.
};

}  // namespace morphbus::tools
