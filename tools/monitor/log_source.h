#pragma once
// A log for the monitor: played for each client by itself.

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tools/machine/wall_clock.h"
#include "tools/monitor/log_player.h"
#include "tools/monitor/monitor_source.h"
#include "tools/monitor/program_text.h"
#include "tools/monitor/role_inquiry.h"

namespace morphbus::tools {

/// See docs/monitor-protocol.md: parameters, services, History.
class LogSource : public MonitorSource {
 public:
  /// Opens a log and takes the name of its run. Fails if it does not hold a run and its
  /// description.
  static Result<std::unique_ptr<LogSource>> Create(const std::string& path);

  /// Reads the whole log, once it has its final name. Fails if it cannot be read.
  Result<void> Index();

  // As in MonitorSource.
  [[nodiscard]] Json Info() const override;
  [[nodiscard]] std::vector<std::string> services() const override;
  [[nodiscard]] Result<logger::RunLog> Outline() override { return outline_; }
  [[nodiscard]] int64_t outline_version() const override { return 1; }
  int Step(int wait_ms) override;
  void Take(const bridge::ClientRequest& request, const std::string& what) override;

 private:
  LogSource(std::string path, std::shared_ptr<const bridge::RunModel> run, std::string description);
  /// Where the file is wrong first, for Info(); null if it is whole.
  [[nodiscard]] Json DamageInfo() const;
  /// Finds out why modules have no role at the time that a request names, for its client.
  void AskForRoles(const bridge::ClientRequest& request);
  /// A client's playback, and what it was told of it.
  struct Playback {
    std::unique_ptr<LogPlayer> player;
    double told_s = -1e9;  ///< When it was told the time.
    // What it was told of playing and speed.
    bool told_playing = false;
    double told_speed = -1;
  };
  /// Sends what the converter makes to one client.
  [[nodiscard]] bridge::OutwardSink SinkOf(uint64_t client);
  /// Does what a client's playback control asks for.
  void Control(const bridge::ClientRequest& request, Playback* playback);
  /// Tells a client how far its playback is, where this log's is the server's.
  void TellState(uint64_t client, const LogPlayer& player, bool did_seek,
                 const std::string& request);
  /// Tells a client where its playback is.
  void Tell(uint64_t client, Playback* playback, bool time_too);
  /// Does what a service's request says. Fails if it makes no sense.
  Result<void> Do(const std::string& service, const nlohmann::json& request, uint64_t client,
                  LogPlayer* player);
  /// What services answer.
  [[nodiscard]] Json StateOf(const LogPlayer& player) const;

  std::string path_;
  std::shared_ptr<const bridge::RunModel> run_;
  std::string description_;  ///< The run's, serialized.
  ProgramTexts texts_;
  std::shared_ptr<const LogIndex> index_;   ///< Null before Index().
  logger::RunLog outline_;                  ///< Empty before Index().
  std::map<uint64_t, Playback> playbacks_;  ///< By client.
  WallTimer timer_;                         ///< The clock by which all clients play.
  std::unique_ptr<RoleInquiry> inquiry_;    ///< Uses what stands above it.
};

}  // namespace morphbus::tools
