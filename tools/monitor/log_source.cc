#include "tools/monitor/log_source.h"

#include <cmath>
#include <filesystem>
#include <limits>

namespace morphbus::tools {
namespace {

/// Events that are sent between two looks at whether a client has room: each becomes a few messages
/// at most, and twice as many still fit.
constexpr int kEventsAtOnce = 16;
/// Such rounds for one client before it is the next one's turn.
constexpr int kRounds = 32;
/// How soon to look again while clients play in time with the wall, milliseconds.
constexpr int kSoonMs = 5, kIdleMs = 20;
constexpr double kTellTimeEvery = 0.2;
constexpr double kFastest = 1000.0;

/// A number of microseconds in a request; nothing if it is no such.
std::optional<int64_t> TimeIn(const nlohmann::json& request, const char* name) {
  const auto found = request.find(name);
  if (found == request.end() || !found->is_number()) return std::nullopt;
  const double value = found->get<double>();
  if (!std::isfinite(value) || std::abs(value) > 1e17) return std::nullopt;
  return static_cast<int64_t>(std::llround(value));
}

bool IsSpeed(const nlohmann::json& value) {
  return value.is_number() && value.get<double>() >= 0 && value.get<double>() <= kFastest;
}

}  // namespace

LogSource::LogSource(std::string path, std::shared_ptr<const bridge::RunModel> run,
                     std::string description)
    : path_(std::move(path)),
      run_(std::move(run)),
      description_(std::move(description)),
      texts_(run_->model, run_->program_file) {
  name_ = run_->run;
}

Result<std::unique_ptr<LogSource>> LogSource::Create(const std::string& path) {
  // Only as far as the description, so that a mistake in the command line is told at once.
  std::string description;
  auto run = ReadLogModel(path, &description);
  if (!run) return Fail(run.error().message);
  return std::unique_ptr<LogSource>(new LogSource(path, *run, std::move(description)));
}

Result<void> LogSource::Index() {
  // The whole log is read once: only then its length is known, and the places in its middle from
  // which a playback can begin.
  auto index = IndexLog(path_, run_, name_, [this](uint64_t hash, const std::string& file) {
    return texts_.Find(hash, file);
  });
  if (!index) return Fail(index.error().message);
  index_ = *index;
  // What is wrong with the file, and who played which role, is found as `info` and `compare` do.
  logger::RunLogOptions options;
  options.run = run_->run;
  options.series = false;
  options.outline = true;
  options.description = description_;
  auto outline = logger::LoadRunLog(path_, options);
  if (!outline) return Fail(outline.error().message);
  outline_ = std::move(*outline);
  return {};
}

Json LogSource::DamageInfo() const {
  const logger::LogFacts& facts = outline_.facts;
  // Without an END the log was cut, wherever else it may be wrong.
  const bool cut = facts.end_state == logger::EndState::kMissing;
  if (facts.damage.empty()) {
    if (!cut) return nullptr;
    return {{"cut", true}, {"time_us", index_->end_us}, {"what", "it has no END: it was cut"}};
  }
  const logger::LogDamage& first = facts.damage.front();
  return {{"cut", cut}, {"time_us", first.time_us}, {"what", first.what}};
}

Json LogSource::Info() const {
  return {{"name", name_},
          {"kind", "log"},
          {"robot", run_->robot->name},
          {"file", std::filesystem::path(path_).filename().string()},
          {"begin_us", index_->begin_us},
          {"end_us", index_->end_us},
          {"damage", past_of_.empty() ? DamageInfo() : Json(nullptr)},
          {"past_of", past_of_}};
}

std::vector<std::string> LogSource::services() const {
  return {"playback", "pause", "resume", "step", "speed", "missing_roles", "explain_role"};
}

void LogSource::AskForRoles(const bridge::ClientRequest& request) {
  const std::optional<int64_t> time_us = TimeIn(request.value, "time_us");
  if (!time_us) return server_->RefuseCall(request, "the request needs \"time_us\"");
  // Made at the first question: most people never ask.
  if (inquiry_ == nullptr) inquiry_ = std::make_unique<RoleInquiry>(description_);
  const auto standing = [this, time = *time_us]() -> Result<RobotStanding> {
    // The client's own playback goes on meanwhile.
    auto player = LogPlayer::Create(index_, 0);
    if (!player) return Fail(player.error().message);
    (*player)->Seek(time, 0, [](bridge::OutwardTopic, int64_t, const std::string&) {});
    return StandingOf((*player)->converter());
  };
  inquiry_->Ask(RoleQuestionIn(request.value), standing,
                [server = server_, request](const Result<Json>& answer) {
                  if (!answer) return server->RefuseCall(request, answer.error().message);
                  server->AnswerCall(request, *answer);
                });
}

bridge::OutwardSink LogSource::SinkOf(uint64_t client) {
  return [this, client](bridge::OutwardTopic topic, int64_t time_ns, const std::string& bytes) {
    // Each client is at a time of its own, so that nothing goes to all.
    server_->PublishTo(client, ChannelOf(topic), time_ns, bytes);
    if (tells_time_ && topic == bridge::OutwardTopic::kClock) {
      server_->PublishTimeTo(client, time_ns);
    }
  };
}

void LogSource::TellState(uint64_t client, const LogPlayer& player, bool did_seek,
                          const std::string& request) {
  // The protocol knows one playback, whose times are those of the server.
  if (!tells_time_) return;
  using Status = bridge::PlaybackState::Status;
  bridge::PlaybackState state;
  const bool at_end = player.time_us() >= index_->end_us;
  state.status = player.playing() ? Status::kPlaying : at_end ? Status::kEnded : Status::kPaused;
  state.time_ns = player.time_us() * 1000;
  state.speed = static_cast<float>(player.speed());
  state.did_seek = did_seek;
  state.request = request;
  server_->SendPlayback(client, state);
}

void LogSource::Control(const bridge::ClientRequest& request, Playback* playback) {
  LogPlayer* player = playback->player.get();
  const double now_s = timer_.seconds();
  player->SetSpeed(std::min(request.speed, kFastest), now_s);
  if (request.seek_ns) player->Seek(*request.seek_ns / 1000, now_s, SinkOf(request.client));
  player->PlayUntil(index_->end_us);
  player->Play(request.playing, now_s);
  playback->told_playing = player->playing();
  playback->told_speed = player->speed();
  TellState(request.client, *player, request.seek_ns.has_value(), request.playback_id);
  Tell(request.client, playback, true);
}

void LogSource::Tell(uint64_t client, Playback* playback, bool time_too) {
  // Other viewers than our page know parameters, and none of our services.
  server_->SetParameterOf(client, Parameter("speed"), playback->player->speed());
  server_->SetParameterOf(client, Parameter("paused"), !playback->player->playing());
  const bool playing = playback->player->playing();
  const double speed = playback->player->speed();
  if (playing != playback->told_playing || speed != playback->told_speed) {
    playback->told_playing = playing;
    playback->told_speed = speed;
    TellState(client, *playback->player, false, "");
  }
  if (!time_too) return;
  playback->told_s = timer_.seconds();
  server_->SetParameterOf(client, Parameter("time"),
                          static_cast<double>(playback->player->time_us()) * 1e-6);
}

int LogSource::Step(int /*wait_ms*/) {
  int next_ms = kIdleMs;
  for (auto& [client, playback] : playbacks_) {
    // A round is small enough for the client's room; whoever has none waits for the next step.
    const bool was_playing = playback.player->playing();
    const bridge::OutwardSink sink = SinkOf(client);
    bool more = true;
    for (int round = 0; more && round < kRounds && server_->HasRoom(client); ++round) {
      more = playback.player->Advance(timer_.seconds(), kEventsAtOnce, sink);
    }
    // Who has no room now may have some soon.
    if (playback.player->playing()) {
      next_ms = more && server_->HasRoom(client) ? 0 : std::min(next_ms, kSoonMs);
    }
    // A client hears where its playback is now and then, and at once when it stops.
    const bool stopped = was_playing && !playback.player->playing();
    if (stopped || (was_playing && timer_.seconds() - playback.told_s > kTellTimeEvery)) {
      Tell(client, &playback, true);
    }
  }
  return next_ms;
}

Json LogSource::StateOf(const LogPlayer& player) const {
  return {{"playing", player.playing()},
          {"speed", player.speed()},
          {"time_us", player.time_us()},
          {"begin_us", index_->begin_us},
          {"end_us", index_->end_us}};
}

Result<void> LogSource::Do(const std::string& service, const nlohmann::json& request,
                           uint64_t client, LogPlayer* player) {
  const double now_s = timer_.seconds();
  // The short services are what buttons call.
  if (service == "pause") player->Play(false, now_s);
  if (service == "resume") player->Play(true, now_s);
  if (service == "step") {
    const Json ticks = request.value("ticks", Json(1));
    if (!ticks.is_number_integer() || ticks < 1) {
      return Fail("\"ticks\" is a whole number, 1 or more");
    }
    player->Step(ticks.get<int64_t>(), now_s);
  }
  if (service == "speed") {
    if (!request.contains("speed") || !IsSpeed(request["speed"])) {
      return Fail("the request needs a \"speed\" from 0 to 1000");
    }
    player->SetSpeed(request["speed"].get<double>(), now_s);
  }
  if (service != "playback") return {};
  // All is looked at before anything is done.
  if (request.contains("speed") && !IsSpeed(request["speed"])) {
    return Fail("\"speed\" is a number from 0 to 1000");
  }
  if (request.contains("playing") && !request["playing"].is_boolean()) {
    return Fail("\"playing\" is true or false");
  }
  for (const char* name : {"from_us", "to_us"}) {
    if (request.contains(name) && !TimeIn(request, name)) {
      return Fail(std::string("\"") + name + "\" is a sim time in microseconds");
    }
  }
  // In this order a request can go somewhere and play from there.
  if (request.contains("speed")) player->SetSpeed(request["speed"].get<double>(), now_s);
  if (const auto from = TimeIn(request, "from_us")) player->Seek(*from, now_s, SinkOf(client));
  player->PlayUntil(std::min(TimeIn(request, "to_us").value_or(index_->end_us), index_->end_us));
  if (request.contains("playing")) player->Play(request["playing"].get<bool>(), now_s);
  return {};
}

void LogSource::Take(const bridge::ClientRequest& request, const std::string& what) {
  using Kind = bridge::ClientRequest::Kind;
  // A client has a player as long as it is there.
  if (request.kind == Kind::kConnected) {
    auto player = LogPlayer::Create(index_, timer_.seconds());
    if (!player) return server_->SendStatus(request.client, 2, player.error().message);
    Playback& playback = playbacks_[request.client];
    playback.player = std::move(*player);
    return Tell(request.client, &playback, true);
  }
  if (request.kind == Kind::kDisconnected) {
    playbacks_.erase(request.client);
    return;
  }
  // It has none if the file could not be opened for it.
  const auto found = playbacks_.find(request.client);
  if (request.kind == Kind::kPlayback) {
    if (found != playbacks_.end()) return Control(request, &found->second);
    if (tells_time_) server_->SendStatus(request.client, 2, "the log cannot be read");
    return;
  }
  if (request.kind == Kind::kCall && IsRoleService(what)) return AskForRoles(request);
  if (request.kind == Kind::kCall) {
    if (found == playbacks_.end()) return server_->RefuseCall(request, "the log cannot be read");
    const Result<void> done = Do(what, request.value, request.client, found->second.player.get());
    // A refusal changes nothing, and is told with the reason.
    if (!done) return server_->RefuseCall(request, done.error().message);
    Tell(request.client, &found->second, true);
    return server_->AnswerCall(request, StateOf(*found->second.player));
  }
  // A parameter is a service with one member, and answers what it is now, changed or not.
  Result<void> done = Fail(request.name + ": this is no value of it");
  if (found != playbacks_.end()) {
    // The words of the protocol are put into those of the services.
    LogPlayer* player = found->second.player.get();
    const nlohmann::json& value = request.value;
    if (what == "paused" && value.is_boolean()) {
      done = Do("playback", {{"playing", !value.get<bool>()}}, request.client, player);
    } else if (what == "speed") {
      done = Do("speed", {{"speed", value}}, request.client, player);
    } else if (what == "time" && value.is_number()) {
      done = Do("playback", {{"from_us", value.get<double>() * 1e6}}, request.client, player);
    }
    Tell(request.client, &found->second, true);
  }
  if (!done) server_->SendStatus(request.client, 2, done.error().message);
  server_->AnswerSet(request);
}

}  // namespace morphbus::tools
