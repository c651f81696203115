#pragma once
// A run's messages, as they come from the bus or a log, turned into those for viewers and files
// (docs/monitor-protocol.md).

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <morphbus/actuator_t.hpp>
#include <morphbus/body_pose_t.hpp>
#include <morphbus/health_t.hpp>
#include <morphbus/pose_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>
#include <morphbus/world_t.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/outward/foxglove.pb.h"
#include "bridge/outward/link_places.h"
#include "bridge/outward/monitor.pb.h"
#include "bridge/outward/run_model.h"
#include "bridge/outward/topics.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/deployed_images.h"

namespace morphbus::bridge {

/// Who gets what the converter makes: the topic, the sim time in nanoseconds since the run's start,
/// and the serialized message, which is valid during the call only.
using OutwardSink =
    std::function<void(OutwardTopic topic, int64_t time_ns, const std::string& bytes)>;

/// The text of a program: by the hash of its image and the path of its source. Empty if the file is
/// not what the image was compiled from.
using ProgramText = std::function<std::string(uint64_t hash, const std::string& file)>;

/// Sets the time of a message for viewers: sim time since the run's start, microseconds.
void SetTime(int64_t time_us, google::protobuf::Timestamp* out);

/// Converts one run. Where a sink is empty, it only follows what the messages say.
/// It believes nothing of the bytes that it gets: what Decode refuses is counted
/// and left out, and so is what came already, belongs to a tick that is over, or is of another run.
/// Nothing is copied of a message that is not complete but what its tick needs. A copy goes on from
/// where the original was, so that a log can be played from a place in its middle.
class Converter {
 public:
  /// `source` begins all names of topics and frames. `text` may be null.
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
  [[nodiscard]] int64_t time_us() const { return time_us_; }
  /// Tick of the last CLOCK; -1 before the first.
  [[nodiscard]] int64_t tick() const { return tick_; }
  /// Whether CLOCK's commands hold the run, and its speed by the last of them (times real time; 0:
  /// as fast as possible).
  [[nodiscard]] bool paused() const { return paused_; }
  [[nodiscard]] double speed() const { return speed_; }
  /// Whether CLOCK has told of the end.
  [[nodiscard]] bool ended() const { return ended_; }
  [[nodiscard]] const RunModel& run() const { return *run_; }

 private:
  /// What is put together of several messages of one tick: SENSORS' or WORLD's parts, or a message
  /// of each module.
  struct Gathering {
    int64_t tick = -1;    ///< -1: nothing waits.
    int64_t time_us = 0;  ///< Sim time of that tick.
    std::set<int> have;   ///< Parts or modules.
  };

  // What each kind of message does; `module` is the index of the channel's module.
  void Use(const morphbus::sim_clock_t& clock, int module, const OutwardSink& sink);
  void Use(const morphbus::sensors_t& sensors, int module, const OutwardSink& sink);
  void Use(const morphbus::world_t& world, int module, const OutwardSink& sink);
  void Use(const morphbus::transform_t& transform, int module, const OutwardSink& sink);
  void Use(const morphbus::actuator_t& actuator, int module, const OutwardSink& sink);
  void Use(const morphbus::status_t& status, int module, const OutwardSink& sink);
  void Use(const morphbus::health_t& health, int module, const OutwardSink& sink);

  /// Decodes a message of type M and uses it, unless it came already.
  template <class M>
  bool Read(std::string_view channel, int module, const uint8_t* data, size_t size,
            const OutwardSink& sink);

  /// Makes room for a message of a tick in what is being gathered: sends what waits of an earlier
  /// one by `flush`. False if the tick is over.
  bool BeginGathering(const morphbus::header_t& header, Gathering* gathering,
                      void (Converter::*flush)(const OutwardSink&), const OutwardSink& sink);
  // Send what was gathered of a tick, whole or not.
  void SendJoints(const OutwardSink& sink);
  void SendWorld(const OutwardSink& sink);
  void SendPropagated(const OutwardSink& sink);
  void SendCommands(const OutwardSink& sink);
  // Send the state as a whole, if it has changed.
  void SendModules(const OutwardSink& sink);
  void SendConnections(int64_t time_us, const OutwardSink& sink);

  /// Sends a fault of a STATUS, and a line on it.
  void SendFault(const morphbus::status_t& status, const morphbus::fault_t& fault, int module,
                 const OutwardSink& sink);
  /// Sends what a program printed, and a line on it.
  void SendPrint(const morphbus::status_t& status, const morphbus::print_t& print, int module,
                 const OutwardSink& sink);
  /// A line of a program's source; nothing by default.
  struct SourcePlace {
    std::string file;
    uint32_t line = 0;
  };
  /// Sends a line for people, with the place in a program's source that it speaks of.
  void SendLog(int64_t time_us, foxglove::Log::Level level, const std::string& who,
               const std::string& text, const SourcePlace& where, const OutwardSink& sink);
  /// Follows the commands that CLOCK names.
  void TakeControl(const std::string& control, int64_t time_us, const OutwardSink& sink);
  /// Adds the frames that hold the links' together: W in the viewers' world, and R in W.
  void AddBaseFrames(int64_t time_us, foxglove::FrameTransforms* out);
  void AddTransform(int64_t time_us, const std::string& parent, const std::string& child,
                    const LinkPose& X, foxglove::FrameTransforms* out);
  /// Serializes a message and hands it out.
  void Send(OutwardTopic topic, int64_t time_us, const google::protobuf::MessageLite& message,
            const OutwardSink& sink);

  /// The images of the program with this hash; null if it is not known.
  const vm::VerifiedProgram* FindProgram(uint64_t hash);
  /// The source file of a program, as a path or by its name in the image; empty if unknown.
  /// @param program  the one with this hash, if it is known.
  [[nodiscard]] std::string SourceFile(uint64_t hash, const vm::VerifiedProgram* program) const;
  /// The line of a program's text; empty if that is not known.
  std::string SourceLine(uint64_t hash, const std::string& file, int line);
  /// Modules that still answer.
  [[nodiscard]] int NumLiving() const;
  [[nodiscard]] int num_modules() const { return static_cast<int>(run_->robot->modules.size()); }

  // What does not change.
  std::shared_ptr<const RunModel> run_;
  std::string source_;
  ProgramText text_;
  std::vector<std::vector<std::string>> frames_, propagated_frames_;  ///< [module][link].

  // Where the run is.
  int64_t time_us_ = 0;
  int64_t tick_ = -1;
  bool paused_ = false;
  double speed_ = 0;
  bool ended_ = false;
  bool has_world_ = false;
  /// The highest number taken, by channel.
  std::map<std::string, int64_t, std::less<>> taken_;

  // What was heard last, by module.
  std::vector<std::vector<double>> position_, velocity_, effort_;
  std::vector<std::vector<std::optional<double>>> target_;
  std::vector<std::vector<int>> sign_;
  Dockings dockings_;
  bool sensed_ = false;  ///< Whether any dockings were sensed; else they are the declared ones.
  std::vector<morphbus::ModuleState> states_;
  std::set<int> lost_;

  // What is being gathered.
  Gathering sensors_, world_, transforms_, actuators_;
  std::vector<morphbus::body_pose_t> bodies_;
  std::vector<std::vector<morphbus::pose_t>> X_RL_;  ///< By module; empty without a pose.
  morphbus::Commands commands_;

  // The structure of the bodies in WORLD, and for what it was made.
  std::vector<std::vector<LinkPlace>> places_;
  std::vector<std::pair<int, int>> placed_bodies_;
  bool places_outdated_ = true;
  LinkPose X_WR_;  ///< The robot frame in W.

  // What was sent last of what is told when it changes.
  bool modules_changed_ = false;
  std::string sent_connections_;

  // Programs that came during the run.
  DeployedImages deployed_;
  std::map<uint64_t, std::string> deployed_bytes_;
  std::map<uint64_t, std::shared_ptr<ModuleImages>> programs_;
  std::map<uint64_t, std::shared_ptr<const std::vector<std::string>>> source_lines_;
  std::string buffer_;  ///< The message being sent.
};

}  // namespace morphbus::bridge
