#include "logger/log/run_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <morphbus/info_part_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/transform_t.hpp>
#include <morphbus/world_t.hpp>
#include <set>

#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/info_parts.h"
#include "bridge/wire/vm_codec.h"
#include "logger/log/channel_stream.h"
#include "logger/log/deployed_images.h"
#include "logger/log/description.h"
#include "logger/log/promised_messages.h"

namespace morphbus::logger {
namespace {

using bridge::Topic;

/// Only the first faults are kept, since a program may have one in every tick; all are counted.
constexpr size_t kMaxFaults = 1000;
/// No run is so long. The bound keeps sums and products of a damaged number within 64 bits.
constexpr int64_t kMaxSequence = int64_t{1} << 56;

/// Leaves one sample a time if `unique`, in order of sim time; a recording by other tools may have
/// them in any order.
template <class Sample>
void SortByTime(std::vector<Sample>* samples, bool unique) {
  const auto earlier = [](const Sample& a, const Sample& b) { return a.time_us < b.time_us; };
  if (!std::is_sorted(samples->begin(), samples->end(), earlier)) {
    std::stable_sort(samples->begin(), samples->end(), earlier);
  }
  if (!unique) return;
  const auto same = [](const Sample& a, const Sample& b) { return a.time_us == b.time_us; };
  samples->erase(std::unique(samples->begin(), samples->end(), same), samples->end());
}

/// Reads the events of one file, in its order, into one RunLog. LoadRunLog() makes it, gives it
/// every event, and calls Finish() once.
class Loader {
 public:
  Loader(std::string run, bool series, RunLog* log)
      : run_(std::move(run)), series_(series), log_(*log), facts_(log->facts) {}

  /// Counts an event under its channel, and reads it if it is of the run.
  void Take(const LogEvent& event) {
    ++facts_.events;
    if (facts_.events == 1) facts_.first_us = event.timestamp_us;
    facts_.last_us = event.timestamp_us;
    // The channel's name tells whose event it is.
    const std::optional<bridge::ChannelName> name = bridge::ParseChannel(event.channel);
    const bool ours = name && name->run == run_;
    if (name && !ours) other_runs_.emplace(name->run);
    found_ = found_ || ours;
    // A damaged log can name a new channel with every event; beyond this they are counted as one.
    std::string key = EscapeControl(event.channel);
    if (facts_.channels.size() >= 10'000 && !facts_.channels.contains(key))
      key = "(further channels)";
    ChannelFacts& channel = facts_.channels[key];
    if (channel.events == 0) {
      channel.channel = key;
      channel.first_us = event.timestamp_us;
      channel.ours = ours;
      channel.hashed = ours && bridge::IsHashed(name->topic);
    }
    channel.last_us = event.timestamp_us;
    ++channel.events;
    channel.bytes += static_cast<int64_t>(event.data.size());
    if (ours && channel.ours) TakeOurs(event, *name, &channel);
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
  void Finish() {
    // Gaps that are still open are losses now.
    std::vector<bridge::ChannelTotal> totals;
    for (auto& [name, stream] : streams_) {
      ChannelFacts& channel = facts_.channels[name];
      stream.Finish();
      channel.messages = stream.count();
      channel.duplicates = stream.duplicates();
      channel.lost = stream.lost();
      channel.first_lost = stream.first_lost();
      channel.hash = stream.hash();
      channel.sim_seconds = stream.sim_seconds();
      if (channel.hashed) totals.push_back({name, channel.messages, channel.hash, true});
    }
    for (auto& [name, channel] : facts_.channels) {
      if (!channel.ours) channel.messages = channel.events;
    }
    // The run as a whole: hash, length, and whether END agrees.
    facts_.run_hash = bridge::RunHash(std::move(totals));
    facts_.other_runs.assign(other_runs_.begin(), other_runs_.end());
    // The facts that follow from others, and what the other messages promise.
    facts_.ticks = static_cast<int64_t>(ticks_.size());
    facts_.seconds = static_cast<double>(facts_.ticks) * facts_.tick_us * 1e-6;
    log_.tick_us = facts_.tick_us;
    VerifyEnd();
    WordFaults(log_.description, log_.deployed, &facts_);
    if (log_.description.empty()) {
      facts_.problems.push_back("the log does not hold the run's whole description (INFO)");
    }
    promised_.Judge(facts_.mode == "realtime", now_us_, &facts_);
    SortSeries();
  }

  /// Was there any message of the run?
  [[nodiscard]] bool found() const { return found_; }

 private:
  /// Takes a message of the run: numbered ones once each, and damaged ones as damage.
  void TakeOurs(const LogEvent& event, const bridge::ChannelName& name, ChannelFacts* channel) {
    ChannelStream& stream = streams_[channel->channel];
    morphbus::header_t header;
    // The header must be sound, of the described model, and carry a possible number.
    Result<void> sound = bridge::DecodeHeader(event.data.data(), event.data.size(), &header);
    const auto model_hash = static_cast<uint64_t>(header.model_hash);
    if (sound && channel->hashed && facts_.model_hash != 0 && model_hash != facts_.model_hash) {
      sound = Fail("it speaks of another model than the description");
    }
    if (sound && (header.sequence < 0 || header.sequence > kMaxSequence)) {
      sound = Fail("its sequence number is impossible");
    }
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
    if (sound) sound = Dispatch(event, name);
    if (sound) return;
    // Whatever was wrong with it, the message is listed as damage and has no sample.
    ++channel->bad;
    facts_.AddDamage(fmt::format("the message on {} at byte {} is damaged: {}", channel->channel,
                                 event.offset, sound.error().message),
                     event.offset, now_us_);
  }

  /// Reads a message by its topic; what is not looked into must still fit its CRC.
  Result<void> Dispatch(const LogEvent& event, const bridge::ChannelName& name) {
    static const std::map<Topic,
                          Result<void> (Loader::*)(const LogEvent&, const bridge::ChannelName&)>
        readers = {{Topic::kClock, &Loader::Read<morphbus::sim_clock_t>},
                   {Topic::kSensors, &Loader::Read<morphbus::sensors_t>},
                   {Topic::kWorld, &Loader::Read<morphbus::world_t>},
                   {Topic::kTransform, &Loader::Read<morphbus::transform_t>},
                   {Topic::kActuator, &Loader::Read<morphbus::actuator_t>},
                   {Topic::kStatus, &Loader::Read<morphbus::status_t>},
                   {Topic::kHealth, &Loader::Read<morphbus::health_t>},
                   {Topic::kInfo, &Loader::Read<morphbus::info_part_t>},
                   {Topic::kEnd, &Loader::Read<morphbus::log_end_t>}};
    end_seen_ = end_seen_ || name.topic == Topic::kEnd;
    const auto reader = readers.find(name.topic);
    if (reader != readers.end()) return (this->*reader->second)(event, name);
    morphbus::header_t header;
    return bridge::DecodeHeader(event.data.data(), event.data.size(), &header);
  }

  /// Decodes a message and uses it. One of the run's hash moves the loader's present on to its sim
  /// time.
  template <class M>
  Result<void> Read(const LogEvent& event, const bridge::ChannelName& name) {
    M message;
    Result<void> read = bridge::Decode(event.data.data(), event.data.size(), {}, &message);
    if (!read) return read;
    if (bridge::IsHashed(name.topic)) {
      now_us_ = std::max<int64_t>(now_us_, message.header.sim_time_us);
    }
    Use(std::string(event.channel), name.process, std::move(message));
    return read;
  }

  /// CLOCK dates the ticks.
  void Use(const std::string& channel, std::string_view, const morphbus::sim_clock_t& clock) {
    facts_.tick_us = clock.tick_us;
    promised_.TakeClock(clock);
    promised_.TakePlace(channel, clock.header, 1, 0);
    for (const std::string& command : clock.controls) {
      facts_.commands.emplace(clock.header.tick, command);
    }
    if (clock.phase != morphbus::sim_clock_t::PHASE_END) ticks_.insert(clock.header.sim_time_us);
  }

  /// SENSORS names the modules and says what each senses.
  void Use(const std::string& channel, std::string_view, morphbus::sensors_t sensors) {
    promised_.TakeSensors(sensors);
    deployed_.Take(sensors, &log_.deployed);
    promised_.TakePlace(channel, sensors.header, sensors.num_parts, sensors.part);
    for (morphbus::module_sensors_t& reading : sensors.modules) {
      ModuleSeries& module = Module(reading.name);
      module.id = reading.module_id;
      // Only facts are wanted, or the reading becomes a sample of its module.
      if (!series_) continue;
      const std::vector<float>& velocity = reading.joint_velocity_si;
      module.sensors.push_back({sensors.header.sim_time_us, std::move(reading.joint_position_si),
                                std::vector<double>(velocity.begin(), velocity.end()),
                                std::move(reading.docked)});
    }
  }

  /// WORLD comes in parts: those of one instant make one sample.
  void Use(const std::string& channel, std::string_view, const morphbus::world_t& world) {
    promised_.TakePlace(channel, world.header, world.num_parts, world.part);
    if (!series_) return;
    WorldSample& sample = world_[world.header.sim_time_us];
    sample.time_us = world.header.sim_time_us;
    sample.bodies.insert(sample.bodies.end(), world.bodies.begin(), world.bodies.end());
  }

  void Use(const std::string& channel, std::string_view module, morphbus::transform_t transform) {
    promised_.TakePlace(channel, transform.header, 1, 0);
    if (!series_) return;
    Module(module).transforms.push_back({transform.header.sim_time_us, transform.role,
                                         transform.has_pose != 0, transform.pose_stale != 0,
                                         std::move(transform.link_poses)});
  }

  void Use(const std::string& channel, std::string_view module, morphbus::actuator_t actuator) {
    promised_.TakePlace(channel, actuator.header, 1, 0);
    promised_.TakeStatusCount(module, actuator.status_count);
    if (!series_) return;
    Module(module).actuators.push_back(
        {actuator.header.sim_time_us, std::move(actuator.joints), std::move(actuator.connectors)});
  }

  /// STATUS says what a module is, and which faults its program had.
  void Use(const std::string& channel, std::string_view module, morphbus::status_t status) {
    promised_.TakePlace(channel, status.header, 0, 0);
    const int64_t time_us = status.header.sim_time_us;
    for (const morphbus::fault_t& fault : status.faults) {
      ++facts_.num_faults;
      if (facts_.faults.size() >= kMaxFaults) continue;
      FaultFact& fact = facts_.faults.emplace_back();
      fact.time_us = time_us;
      fact.module = module;
      fact.type_name = status.type_name;
      fact.role = status.role_name;
      fact.program_hash = static_cast<uint64_t>(status.header.program_hash);
      fact.fault = bridge::FromFault(fault);
    }
    facts_.num_faults += status.faults_dropped;
    // A module that only reports has a series, too, so that it is not forgotten in comparisons.
    ModuleSeries& series = Module(module);
    const int64_t tick = status.header.tick;
    if (series_) series.status.push_back({time_us, tick, std::move(status)});
  }

  /// The last ledger in the file counts.
  void Use(const std::string&, std::string_view process, const morphbus::health_t& health) {
    facts_.health[std::string(process)] = health;
  }

  /// INFO comes in parts; the first description that is whole counts.
  void Use(const std::string&, std::string_view, const morphbus::info_part_t& part) {
    if (!log_.description.empty()) return;
    if (std::optional<std::string> whole = info_.Take(part)) {
      log_.description = std::move(*whole);
      ApplyDescription(log_.description, &log_);
    }
  }

  void Use(const std::string&, std::string_view, morphbus::log_end_t end) {
    facts_.end = std::move(end);
  }

  /// The series of a module, empty when it is first heard of.
  ModuleSeries& Module(std::string_view name) {
    ModuleSeries& series = modules_[std::string(name)];
    if (series.name.empty()) series.name = name;
    return series;
  }

  /// Compares what END vouches for with what is there.
  void VerifyEnd() {
    if (!facts_.end) {
      facts_.end_state = end_seen_ ? EndState::kUnreadable : EndState::kMissing;
      return;
    }
    // END's run hash covers all hashed channels; each listed one must have the same count and hash.
    bool right = facts_.end->run_hash == facts_.run_hash && facts_.end->run == run_;
    std::set<std::string> listed;
    for (const morphbus::channel_total_t& total : facts_.end->channels) {
      listed.insert(total.channel);
      const auto found = facts_.channels.find(total.channel);
      const bool matches = found != facts_.channels.end() &&
                           found->second.messages == total.count &&
                           found->second.hash == static_cast<uint64_t>(total.hash);
      if (found != facts_.channels.end()) found->second.matches_end = matches;
      right = right && (matches || (total.count == 0 && found == facts_.channels.end()));
    }
    // A hashed channel that END does not list was added afterwards.
    for (auto& [key, channel] : facts_.channels) {
      if (!channel.hashed || listed.contains(key)) continue;
      channel.matches_end = false;
      right = false;
    }
    facts_.end_state = right ? EndState::kVerified : EndState::kMismatch;
  }

  /// Puts every series into order of time, and the modules into the robot's.
  void SortSeries() {
    // The modules' own series first, since recordings by other tools may have any order.
    std::vector<ModuleSeries> all;
    for (auto& [name, module] : modules_) {
      SortByTime(&module.sensors, true);
      SortByTime(&module.transforms, true);
      SortByTime(&module.actuators, true);
      SortByTime(&module.status, false);
      if (log_.robot != nullptr) module.model_index = log_.robot->FindModule(name).value_or(-1);
      all.push_back(std::move(module));
    }
    // Modules that the model lacks come last, in order of their number in SENSORS.
    std::stable_sort(all.begin(), all.end(), [](const ModuleSeries& a, const ModuleSeries& b) {
      const auto rank = [](const ModuleSeries& m) {
        return m.model_index >= 0 ? m.model_index : 1'000'000 + std::max(m.id, 0);
      };
      return rank(a) < rank(b);
    });
    log_.modules = std::move(all);
    log_.world.reserve(world_.size());
    for (auto& [time, sample] : world_) log_.world.push_back(std::move(sample));
    log_.ticks_us.assign(ticks_.begin(), ticks_.end());
  }

  // What is asked for, and where it goes.
  std::string run_;
  bool series_;
  RunLog& log_;
  LogFacts& facts_;
  // What is gathered until Finish(): by channel, module and sim time, since order in the file is
  // free.
  std::map<std::string, ChannelStream> streams_;
  std::map<std::string, ModuleSeries> modules_;
  std::map<int64_t, WorldSample> world_;
  std::set<int64_t> ticks_;
  std::set<std::string> other_runs_;
  bridge::InfoAssembler info_;
  DeployedImages deployed_;
  PromisedMessages promised_;
  bool found_ = false;
  bool end_seen_ = false;
  /// The latest sim time read (µs). Damage is dated by it: up to then the log was whole.
  int64_t now_us_ = 0;
  size_t findings_taken_ = 0;
};

/// Why a log is not read that has no message of `run`, but of `others`.
std::string NoSuchRun(const std::string& path, const std::string& run,
                      const std::vector<std::string>& others) {
  constexpr size_t kMaxNamed = 8;  // a damaged log can name any number of runs
  if (others.empty()) return fmt::format("{} holds no run of modules", path);
  const auto end = others.begin() + static_cast<ptrdiff_t>(std::min(others.size(), kMaxNamed));
  std::string names = EscapeControl(fmt::format("{}", fmt::join(others.begin(), end, ", ")));
  if (others.size() > kMaxNamed) names += fmt::format(" and {} more", others.size() - kMaxNamed);
  return fmt::format("no run '{}' in {}; it holds {}", run, path, names);
}

/// The first run that the file names in a CLOCK or INFO.
std::optional<std::string> FindRun(EventLogReader* reader) {
  LogEvent event;
  while (reader->Next(&event)) {
    const std::optional<bridge::ChannelName> name = bridge::ParseChannel(event.channel);
    if (name && (name->topic == Topic::kInfo || name->topic == Topic::kClock)) {
      return std::string(name->run);
    }
  }
  return std::nullopt;
}

}  // namespace

const ModuleSeries* RunLog::FindModule(const std::string& name) const {
  for (const ModuleSeries& module : modules) {
    if (module.name == name) return &module;
  }
  return nullptr;
}

Result<RunLog> LoadRunLog(const std::string& path, const RunLogOptions& options) {
  auto reader = EventLogReader::Open(path);
  if (!reader) return tl::unexpected(reader.error());
  // Without a name, the first run of the file is meant; finding it uses up the reader.
  std::string run = options.run;
  if (run.empty()) {
    const std::optional<std::string> found = FindRun(reader->get());
    if (!found) {
      return Fail(path +
                  (reader->get()->file_size() == 0 ? " is empty" : " holds no run of modules"));
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
  Loader loader(run, options.series, &log);
  LogEvent event;
  while ((*reader)->Next(&event)) {
    loader.TakeFindings(**reader);
    loader.Take(event);
  }
  loader.TakeFindings(**reader);
  if (!(*reader)->io_error().empty()) {
    log.facts.AddDamage("reading failed: " + (*reader)->io_error(), (*reader)->position(), 0);
  }
  loader.Finish();
  // A file that was cut before its first event may have been of this run.
  if (!loader.found() && log.facts.events > 0) {
    return Fail(NoSuchRun(path, run, log.facts.other_runs));
  }
  return log;
}

}  // namespace morphbus::logger
