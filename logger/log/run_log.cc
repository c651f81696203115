#include "logger/log/run_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <tuple>
#include <utility>

#include "bridge/control/control_command.h"
#include "bridge/observe/run_clock.h"
#include "bridge/observe/run_message.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/deployed_images.h"
#include "bridge/wire/info_parts.h"
#include "bridge/wire/status_codec.h"
#include "compiler/base/text.h"
#include "compiler/base/version.h"
#include "logger/log/description.h"
#include "logger/log/find_run.h"
#include "logger/log/log_channels.h"
#include "logger/log/promised_messages.h"
#include "logger/log/series_collector.h"
#include "logger/log/tilt_track.h"

namespace morphbus::logger {
namespace {

using bridge::Topic;

/// Reads the events of one file, in its order, into one RunLog. LoadRunLog() makes it, gives it
/// every event, and calls Finish() once.
class Loader : private bridge::RunMessageHandler {
 public:
  Loader(std::string run, const RunLogOptions& options, RunLog* log)
      : run_(std::move(run)),
        options_(options),
        log_(*log),
        facts_(log->facts),
        channels_(run_, &log->facts) {}

  /// Counts an event under its channel, and reads it if it is of the run.
  void Take(const LogEvent& event) {
    ++facts_.events;
    if (facts_.events == 1) facts_.first_us = event.timestamp_us;
    facts_.last_us = event.timestamp_us;
    // Channels of other runs and programs are counted as well, and not read.
    LogChannels::Known& known = channels_.Of(event);
    ChannelFacts& channel = *known.facts;
    channel.last_us = event.timestamp_us;
    ++channel.events;
    channel.bytes += static_cast<int64_t>(event.data.size());
    if (known.ours && channel.ours) TakeOurs(event, known);
  }

  /// Dates what the reader found so far by the sim time that was reached.
  void TakeFindings(const EventLogReader& reader) {
    for (; findings_taken_ < reader.findings().size(); ++findings_taken_) {
      const LogFinding& finding = reader.findings()[findings_taken_];
      facts_.findings.push_back(finding);
      if (finding.is_damage()) facts_.AddDamage(finding.what, finding.begin, now_us_);
    }
  }

  /// Completes the facts once the whole file was read. The order matters: lost messages are known
  /// once the gaps are closed, and END is checked before promises add channels that are not there.
  Result<void> Finish() {
    // Gaps that are still open are losses now.
    std::vector<bridge::ChannelTotal> totals;
    for (auto& [name, stream] : channels_.streams()) {
      ChannelFacts& channel = facts_.channels[name];
      stream.Finish();
      channel.messages = stream.count();
      channel.duplicates = stream.duplicates();
      channel.lost = stream.lost();
      channel.first_lost = stream.first_lost();
      channel.hash = stream.hash();
      channel.sim_seconds = stream.sim_seconds();
      if (channel.hashed) {
        totals.push_back({name, channel.messages, static_cast<int64_t>(channel.hash), true});
      }
    }
    for (auto& [name, channel] : facts_.channels) {
      if (!channel.ours) channel.messages = channel.events;
    }
    // The run as a whole: hash, length, and whether END agrees.
    facts_.run_hash = bridge::RunHash(std::move(totals));
    facts_.other_runs.assign(channels_.other_runs().begin(), channels_.other_runs().end());
    // The facts that follow from others, and what the other messages promise.
    facts_.ticks = series_.num_ticks();
    // In real time a CLOCK that the logger missed is gone; its tick was one all the same.
    if (facts_.mode == "realtime") facts_.ticks = std::max(facts_.ticks, facts_.end_tick);
    facts_.seconds = static_cast<double>(facts_.ticks) * facts_.tick_us * 1e-6;
    log_.tick_us = facts_.tick_us;
    facts_.deployments = programs_.Deployments(facts_.tick_us);
    AddTilts(tilts_, facts_.tick_us, &facts_.deployments);
    facts_.VerifyEnd(end_seen_);
    // A recording that began too late has no description of its own.
    if (log_.description.empty() && !options_.description.empty() && found()) {
      Result<void> lent = BorrowDescription(options_.description, messages_model_, &log_);
      if (!lent) return lent;
    }
    facts_.ended = ended_.Facts(facts_.lost_modules);
    WordFaults(&log_);
    // What moves the robot is commanded by a program that the run is known to have.
    if (facts_.has_description) {
      facts_.foreign_program = commanding_.WhoseIsForeign(facts_.program_hash, facts_.deployments);
    }
    if (!facts_.foreign_program.empty()) facts_.problems.push_back(facts_.foreign_program);
    if (log_.description.empty()) {
      facts_.problems.push_back("the log does not hold the run's whole description (INFO)");
    }
    NoteOtherVersion();
    dockings_.Tell(log_.model.get(), log_.robot, &facts_);
    promised_.Judge(facts_.mode == "realtime", now_us_, &facts_);
    series_.Finish(&log_);
    return {};
  }

  /// Whoever opens a log of another version must not take it for damaged.
  void NoteOtherVersion() {
    if (num_other_types_ == 0 || facts_.build.empty() || facts_.build == Version()) return;
    facts_.problems.push_back(fmt::format(
        "{} of the log have other fields than those of this version: it was made by {}, "
        "this is {}; read it with that version, or as JSON by the definitions that it "
        "carries (morphbus convert --to json)",
        Counted(num_other_types_, "message"), facts_.build, Version()));
  }

  /// Was there any message of the run?
  [[nodiscard]] bool found() const { return channels_.found(); }

 private:
  /// Takes a message of the run: numbered ones once each, and damaged ones as damage.
  void TakeOurs(const LogEvent& event, const LogChannels::Known& known) {
    ChannelFacts* channel = known.facts;
    ChannelStream& stream = *known.stream;
    bridge::RunMessage message{known.name, {}, event.data.data(), event.data.size()};
    const morphbus::header_t& header = message.header;
    if (known.name.topic == Topic::kEnd) end_seen_ = true;
    // The header must be sound, and of the described model.
    Result<void> sound = bridge::ReadHeader(&message);
    const auto model_hash = static_cast<uint64_t>(header.model_hash);
    if (sound && channel->hashed && facts_.model_hash != 0 && model_hash != facts_.model_hash) {
      sound = Fail("it speaks of another model than the description");
    }
    if (sound && channel->hashed && messages_model_ == 0) messages_model_ = model_hash;
    // Of a numbered channel each message counts once, whatever order they stand in.
    if (sound && channel->hashed) {
      switch (stream.Take(header.sequence, event.data)) {
        case ChannelStream::Kind::kDuplicate:
          return;
        case ChannelStream::Kind::kConflict:
          facts_.AddDamage(fmt::format("{} has two different messages with number {} (byte {})",
                                       channel->channel, header.sequence, event.offset),
                           event.offset, now_us_);
          return;
        case ChannelStream::Kind::kNew:
          break;
      }
      stream.TakeTime(header.sim_time_us);
    } else if (sound) {
      stream.TakeUnnumbered(event.data);
    }
    if (sound) sound = bridge::ReadMessage(message, this);
    if (sound) return Note(message, known.raw);
    if (sound.error().message == bridge::kOtherType) ++num_other_types_;
    // Whatever was wrong with it, the message is listed as damage and has no sample.
    ++channel->bad;
    facts_.AddDamage(fmt::format("the message on {} at byte {} is damaged: {}", channel->channel,
                                 event.offset, sound.error().message),
                     event.offset, now_us_);
  }

  /// Notes what is common to all messages of the run's hash, and what TRANSFORM and ACTUATOR say
  /// beside their samples.
  void Note(const bridge::RunMessage& message, const std::string& channel) {
    const Topic topic = message.name.topic;
    if (!bridge::IsHashed(topic)) return;
    const morphbus::header_t& header = message.header;
    // The present is the latest sim time that was told.
    log_.disorder_us = std::max(log_.disorder_us, now_us_ - header.sim_time_us);
    now_us_ = std::max(now_us_, header.sim_time_us);
    const bridge::MessagePart place = bridge::PartOf(message);
    promised_.TakePlace(channel, header, place.count, place.part);
    const auto program_hash = static_cast<uint64_t>(header.program_hash);
    if (topic == Topic::kTransform) {
      programs_.Take(message.name.process, header.tick, program_hash);
      if (options_.series || options_.outline) series_.TakeTransform(message, !options_.series);
    }
    if (topic == Topic::kActuator) {
      promised_.TakeStatusCount(message.name.process, bridge::StatusCountOf(message));
      commanding_.Take(message.name.process, header.tick, program_hash);
    }
  }

  /// The messages that are most of a log are only checked where nothing else is wanted; of
  /// TRANSFORM single fields are read.
  bool Decodes(const bridge::RunMessage& message) override {
    const Topic topic = message.name.topic;
    if (topic == Topic::kWorld) return options_.series || tilts_.Wants(message.header.sim_time_us);
    if (topic == Topic::kActuator) return options_.series;
    return topic != Topic::kTransform;
  }

  /// CLOCK dates the ticks.
  void OnClock(const bridge::RunMessage& /*message*/, morphbus::sim_clock_t&& clock) override {
    facts_.tick_us = clock.tick_us;
    promised_.TakeClock(clock);
    const int64_t time_us = clock.header.sim_time_us;
    for (const bridge::ControlCommand& command : bridge::CommandsIn(clock)) {
      if (command.kind == bridge::ControlKind::kLose)
        facts_.lost_modules.emplace(command.part.module, time_us);
      // After a new program it counts how the robot stands.
      if (!bridge::BringsImage(command.kind)) continue;
      tilts_.KeepOn();
      programs_.TakeDeployment(clock.header.tick, command);
    }
    // As text all are kept, also those of a later version.
    for (std::string& command : clock.controls) {
      facts_.commands.emplace(clock.header.tick, std::move(command));
    }
    if (clock.phase != morphbus::sim_clock_t::PHASE_END) {
      series_.AddTick(time_us);
    } else {
      facts_.end_tick = clock.header.tick;
      facts_.end_reason = clock.end_reason;
    }
  }

  /// SENSORS names the modules and says what each senses.
  void OnSensors(const bridge::RunMessage& message, morphbus::sensors_t&& sensors) override {
    promised_.TakeSensors(sensors);
    deployed_.Take(sensors, &log_.deployed);
    for (const morphbus::module_sensors_t& reading : sensors.modules) {
      series_.Module(reading.name).id = reading.module_id;
      dockings_.Take(reading, sensors.header.sim_time_us);
    }
    if (options_.series) series_.OnSensors(message, std::move(sensors));
  }

  void OnWorld(const bridge::RunMessage& message, morphbus::world_t&& world) override {
    tilts_.Take(world);
    if (options_.series) series_.OnWorld(message, std::move(world));
  }

  void OnActuator(const bridge::RunMessage& message, morphbus::actuator_t&& actuator) override {
    series_.OnActuator(message, std::move(actuator));
  }

  /// STATUS says what a module is, and which faults its program had.
  void OnStatus(const bridge::RunMessage& message, morphbus::status_t&& status) override {
    const std::string_view module = message.name.process;
    const int64_t time_us = status.header.sim_time_us;
    const ProgramFact reported{.time_us = time_us,
                               .module = std::string(module),
                               .type_name = status.type_name,
                               .role = status.role_name,
                               .program_hash = static_cast<uint64_t>(status.header.program_hash),
                               .text = {},
                               .file = {}};
    // A broken program may repeat itself for hours: all are counted, and the first ones kept.
    for (const morphbus::fault_t& fault : status.faults) {
      ++facts_.num_faults;
      if (facts_.faults.size() >= options_.max_faults) continue;
      facts_.faults.push_back({reported, bridge::FromFault(fault), {}, {}});
    }
    ended_.Take(reported, status);
    facts_.num_faults += status.faults_dropped;
    for (const morphbus::print_t& print : status.prints) {
      if (bridge::IsTrace(print)) continue;
      ++facts_.num_prints;
      if (facts_.prints.size() >= options_.max_faults) continue;
      facts_.prints.push_back({reported, bridge::FromPrint(print)});
    }
    facts_.num_prints += status.prints_dropped;
    // A module that only reports has a series, too, so that it is not forgotten in comparisons.
    series_.Module(module);
    if (options_.traces) series_.TakeTraces(module, time_us, status);
    if (options_.series || options_.outline)
      series_.TakeStatus(module, time_us, std::move(status), false);
  }

  /// The last ledger that a process published counts, wherever it stands in the file.
  void OnHealth(const bridge::RunMessage& message, morphbus::health_t&& health) override {
    // Several messages may share the modules; what is said only grows.
    for (const morphbus::lateness_t& lateness : health.lateness) {
      if (!bridge::CheckModuleName(lateness.module_name)) continue;
      morphbus::lateness_t& known =
          facts_.lateness.try_emplace(lateness.module_name, lateness).first->second;
      if (std::tie(lateness.missed, lateness.late) >= std::tie(known.missed, known.late)) {
        known = lateness;
      }
    }
    const auto [known, is_first] = facts_.health.try_emplace(std::string(message.name.process));
    if (is_first || message.header.sequence >= known->second.header.sequence) {
      known->second = std::move(health);
    }
  }

  /// INFO comes in parts; the first description that is whole counts.
  void OnInfo(const bridge::RunMessage& /*message*/, morphbus::info_part_t&& part) override {
    if (!log_.description.empty()) return;
    if (std::optional<std::string> whole = info_.Take(part)) {
      log_.description = std::move(*whole);
      ApplyDescription(log_.description, &log_);
      if (log_.robot != nullptr) tilts_.Follow(Trunk(*log_.model, *log_.robot));
    }
  }

  void OnEnd(const bridge::RunMessage& /*message*/, morphbus::log_end_t&& end) override {
    // Of many channels there are several, which say the same of the run; another END takes the
    // place of what was said before.
    if (facts_.end && end.header.sequence > 0 && facts_.end->run == end.run &&
        facts_.end->run_hash == end.run_hash) {
      facts_.end->channels.insert(facts_.end->channels.end(), end.channels.begin(),
                                  end.channels.end());
      return;
    }
    facts_.end = std::move(end);
  }

  // What is asked for, and where it goes.
  std::string run_;
  const RunLogOptions& options_;
  RunLog& log_;
  LogFacts& facts_;
  // What is gathered until Finish(): by channel, module and sim time, since order in the file is
  // free.
  LogChannels channels_;
  SeriesCollector series_;
  bridge::InfoAssembler info_;
  bridge::DeployedImages deployed_;
  /// By TRANSFORM, and by ACTUATOR.
  ProgramChanges programs_, commanding_;
  DockingChanges dockings_;
  EndedTasks ended_;
  TiltTrack tilts_;
  PromisedMessages promised_;
  /// Hash of the model of which the first sound message speaks.
  uint64_t messages_model_ = 0;
  bool end_seen_ = false;
  /// The latest sim time read (µs). Damage is dated by it: up to then the log was whole.
  int64_t now_us_ = 0;
  size_t findings_taken_ = 0;
  /// Messages whose type has other fields than ours.
  int64_t num_other_types_ = 0;
};

}  // namespace

const ModuleSeries* RunLog::FindModule(const std::string& name) const {
  for (const ModuleSeries& module : modules) {
    if (module.name == name) return &module;
  }
  return nullptr;
}

std::map<int, int> ModelIndices(const RunLog& log) {
  std::map<int, int> indices;
  for (const ModuleSeries& module : log.modules) {
    if (module.id >= 0 && module.model_index >= 0) indices[module.id] = module.model_index;
  }
  return indices;
}

int IndexById(const std::map<int, int>& indices, int id) {
  const auto found = indices.find(id);
  return found == indices.end() ? -1 : found->second;
}

morphbus::docked_connector_t WithModelIndex(const std::map<int, int>& model_indices,
                                            morphbus::docked_connector_t docked) {
  docked.mate_module = static_cast<int16_t>(IndexById(model_indices, docked.mate_module));
  return docked;
}

bridge::Dockings DockingsAt(const RunLog& log, const std::map<int, int>& model_indices,
                            int64_t time_us) {
  bridge::Dockings dockings = bridge::DeclaredDockings(*log.model, *log.robot);
  for (const ModuleSeries& module : log.modules) {
    const auto next = std::ranges::upper_bound(module.sensors, time_us, {}, &SensorSample::time_us);
    if (module.model_index < 0 || next == module.sensors.begin()) continue;
    std::vector<morphbus::docked_connector_t>& sensed = dockings[module.model_index];
    sensed.clear();
    for (const morphbus::docked_connector_t& docked : std::prev(next)->docked) {
      sensed.push_back(WithModelIndex(model_indices, docked));
    }
  }
  return dockings;
}

Result<RunLog> LoadRunLog(const std::string& path, const RunLogOptions& options) {
  auto reader = EventLogReader::Open(path);
  if (!reader) return tl::unexpected(reader.error());
  // Without a name, the first run of the file is meant; finding it uses up the reader.
  std::string run = options.run;
  if (run.empty()) {
    const std::optional<std::string> found = FindRun(reader->get());
    if (!found) {
      return Fail(WhyNoRun(path, **reader));
    }
    run = *found;
    reader = EventLogReader::Open(path);
    if (!reader) return tl::unexpected(reader.error());
  }
  RunLog log;
  log.facts.path = path;
  log.facts.run = run;
  log.facts.file_bytes = (*reader)->file_size();
  // The file is read once, front to back, with one event in memory at a time.
  Loader loader(run, options, &log);
  LogEvent event;
  while ((*reader)->Next(&event)) {
    loader.TakeFindings(**reader);
    loader.Take(event);
  }
  loader.TakeFindings(**reader);
  log.facts.compressed = (*reader)->compressed();
  log.facts.log_bytes = (*reader)->log_size();
  if (!(*reader)->io_error().empty()) {
    log.facts.AddDamage("reading failed: " + (*reader)->io_error(), (*reader)->position(), 0);
  }
  if (Result<void> finished = loader.Finish(); !finished) {
    return Fail(path + ": " + finished.error().message);
  }
  // A file that was cut before its first event may have been of this run.
  if (!loader.found() && log.facts.events > 0) {
    return Fail(NoSuchRun(path, run, log.facts.other_runs));
  }
  return log;
}

}  // namespace morphbus::logger
