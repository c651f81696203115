#pragma once
// A run's messages, as they come from the bus or a log, turned into those for viewers and files
// (docs/monitor-protocol.md).

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <morphbus/body_pose_t.hpp>
#include <morphbus/contact_force_t.hpp>
#include <morphbus/pose_t.hpp>
#include <morphbus/status_t.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/description/link_places.h"
#include "bridge/description/program_words.h"
#include "bridge/description/run_model.h"
#include "bridge/observe/run_clock.h"
#include "bridge/observe/run_listener.h"
#include "bridge/observe/run_message.h"
#include "bridge/outward/foxglove.pb.h"
#include "bridge/outward/monitor.pb.h"
#include "bridge/outward/topics.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/deployed_images.h"
#include "compiler/base/role_colors.h"

namespace morphbus::bridge {

/// Who gets what the converter makes: the topic, the sim time in nanoseconds since the run's start,
/// and the serialized message, which is valid during the call only.
using OutwardSink =
    std::function<void(OutwardTopic topic, int64_t time_ns, const std::string& bytes)>;

/// The texts of a program.
struct SourceTexts {
  std::string own;
  /// Of the files that it imports, by their paths as they lie from the folder of its own.
  std::map<std::string, std::string> imported;
};
/// Finds them by the hash of the program's image and the path of its own file. They are empty if
/// they are not what the image was compiled from.
using ProgramText = std::function<SourceTexts(uint64_t hash, const std::string& file)>;

/// Sets the time of a message for viewers: sim time since the run's start, microseconds.
void SetTime(int64_t time_us, google::protobuf::Timestamp* out);

/// Converts one run. Where a sink is empty, it only follows what the messages say.
/// It believes nothing of the bytes that it gets (RunListener); what belongs to a tick that is over
/// is left out.
/// Nothing is copied of a message that is not complete but what its tick needs. A copy goes on from
/// where the original was, so that a log can be played from a place in its middle.
class Converter : private RunMessageHandler {
 public:
  /// `run` has its robot. `source` begins all names of topics and frames. `text` may be null.
  Converter(std::shared_ptr<const RunModel> run, std::string source, ProgramText text);

  /// Sends what is known before the first message: description and scene.
  void Begin(const OutwardSink& sink);
  /// Sends the last word on everything that is only told when it changes (modules, connections),
  /// for who did not hear it.
  void Repeat(const OutwardSink& sink);
  /// Takes a message of the bus. False if it is one of the run's that could not be understood.
  bool Take(std::string_view channel, const uint8_t* data, size_t size, const OutwardSink& sink);
  /// Sends what waits for messages that will not come any more.
  void Finish(const OutwardSink& sink);

  /// The run's sim time as far as messages have told it, microseconds.
  [[nodiscard]] int64_t time_us() const { return clock_.time_us(); }
  /// Tick of the last CLOCK; -1 before the first.
  [[nodiscard]] int64_t tick() const { return clock_.tick(); }
  /// Whether the run holds still, and its speed by the last command (times real time; 0: as fast as
  /// possible).
  [[nodiscard]] bool paused() const { return clock_.paused(); }
  [[nodiscard]] double speed() const { return clock_.speed().value_or(run_->speed); }
  /// Whether CLOCK has told of the end.
  [[nodiscard]] bool ended() const { return clock_.ended(); }
  [[nodiscard]] const RunModel& run() const { return *run_; }
  /// What was heard last, by module: states, connections, and joint positions (rad or m; empty
  /// before the first).
  [[nodiscard]] const std::vector<morphbus::ModuleState>& states() const { return states_; }
  [[nodiscard]] const Dockings& dockings() const { return dockings_; }
  [[nodiscard]] const std::vector<std::vector<double>>& positions() const { return position_; }
  /// The image with this hash, as it was handed out during the run; empty if none was.
  [[nodiscard]] std::string DeployedImage(uint64_t hash) const;

 private:
  /// What is put together of several messages of one tick: SENSORS' or WORLD's parts, or a message
  /// of each module.
  struct Gathering {
    int64_t tick = -1;    ///< -1: nothing waits.
    int64_t time_us = 0;  ///< Sim time of that tick.
    std::set<int> have;   ///< Parts or modules.
  };

  // What each kind of message does.
  void OnRepeat(const RunMessage& message) override;
  void OnClock(const RunMessage& message, morphbus::sim_clock_t&& clock) override;
  void OnSensors(const RunMessage& message, morphbus::sensors_t&& sensors) override;
  void OnWorld(const RunMessage& message, morphbus::world_t&& world) override;
  void OnTransform(const RunMessage& message, morphbus::transform_t&& transform) override;
  void OnActuator(const RunMessage& message, morphbus::actuator_t&& actuator) override;
  void OnStatus(const RunMessage& message, morphbus::status_t&& status) override;
  void OnHealth(const RunMessage& message, morphbus::health_t&& health) override;

  /// Makes room for a message of a tick in what is being gathered: sends what waits of an earlier
  /// one by `flush`. False if the tick is over.
  bool BeginGathering(const morphbus::header_t& header, Gathering* gathering,
                      void (Converter::*flush)());
  // Send what was gathered of a tick, whole or not.
  void SendJoints();
  void SendWorld();
  void SendPropagated();
  void SendForces();
  void SendCommands();
  /// Sends all that waits.
  void SendAll();
  // Send the state as a whole, if it has changed.
  void SendModules();
  void SendConnections(int64_t time_us);

  /// Sends a fault of a STATUS, and a line on it.
  void SendFault(const morphbus::status_t& status, const morphbus::fault_t& fault, int module);
  /// Sends what a program printed, and a line on it.
  void SendPrint(const morphbus::status_t& status, const morphbus::print_t& print, int module);
  /// A line of a program's source; nothing by default.
  struct SourcePlace {
    std::string file;
    uint32_t line = 0;
  };
  /// The fields that a STATUS tells the values of, if it does.
  void SendTraces(const morphbus::status_t& status, int module);
  /// Sends a line for people, with the place in a program's source that it speaks of.
  void SendLog(int64_t time_us, foxglove::Log::Level level, const std::string& who,
               const std::string& text, const SourcePlace& where);
  /// Adds the frames that hold the links' together: W in the viewers' world, and R in W.
  void AddBaseFrames(int64_t time_us, foxglove::FrameTransforms* out);
  void AddTransform(int64_t time_us, const std::string& parent, const std::string& child,
                    const LinkPose& X, foxglove::FrameTransforms* out);
  /// Serializes a message and hands it out.
  void Send(OutwardTopic topic, int64_t time_us, const google::protobuf::MessageLite& message);

  /// The line of a program's text; empty if that is not known.
  std::string SourceLine(uint64_t hash, const ReportWords& words);
  /// Modules that still answer.
  [[nodiscard]] int NumLiving() const;
  [[nodiscard]] int num_modules() const { return static_cast<int>(run_->robot->modules.size()); }

  // What does not change.
  std::shared_ptr<const RunModel> run_;
  std::string source_;
  ProgramText text_;
  RoleColors colors_;                                                 ///< Of the program's roles.
  std::vector<std::vector<std::string>> frames_, propagated_frames_;  ///< [module][link].

  RunListener listener_;
  RunClock clock_;  ///< Where the run is.
  /// Who gets what is made during a call.
  const OutwardSink* sink_ = nullptr;

  // What was heard last, by module.
  std::vector<std::vector<double>> position_, velocity_, effort_;
  std::vector<std::vector<std::optional<double>>> target_;
  std::vector<std::vector<int>> sign_;
  Dockings dockings_;
  bool sensed_ = false;  ///< Whether any dockings were sensed; else they are the declared ones.
  std::vector<morphbus::ModuleState> states_;
  int num_lost_ = 0;  ///< Of these modules.

  // What is being gathered.
  Gathering sensors_, world_, transforms_, actuators_;
  std::vector<morphbus::body_pose_t> bodies_;
  std::vector<morphbus::contact_force_t> contacts_;
  std::vector<std::vector<morphbus::pose_t>> X_RL_;  ///< By module; empty without a pose.
  morphbus::Commands commands_;

  // The structure of the bodies in WORLD, and for what it was made.
  std::vector<std::vector<LinkPlace>> places_;
  std::vector<std::pair<int, int>> placed_bodies_;
  bool places_outdated_ = true;
  LinkPose X_WR_;  ///< The robot frame in W.

  // What was sent last of what is told when it changes.
  bool sent_forces_ = false;  ///< Whether it had any.
  bool modules_changed_ = false;
  std::string sent_connections_;

  // Programs that came during the run.
  DeployedImages deployed_;
  ProgramWords words_;
  std::map<uint64_t, std::shared_ptr<const SourceTexts>> source_texts_;
  std::string buffer_;  ///< The message being sent.
};

}  // namespace morphbus::bridge
