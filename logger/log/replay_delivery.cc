#include "logger/log/replay_delivery.h"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"

namespace morphbus::logger {

using bridge::Topic;
using morphbus::ask_t;

namespace {

/// A batch fits the smallest receive buffer that Linux gives a socket by default (208 kB).
constexpr size_t kBatchMessages = 64;
constexpr size_t kBatchBytes = 64'000;
/// Nobody who sends more can be a follower of ours; it bounds what a flood of names costs.
constexpr size_t kMostFollowers = 64;
/// What is not answered is repeated after this time, then after twice as long, up to the longest.
constexpr int64_t kFirstPauseUs = 5'000;
constexpr int64_t kLongestPauseUs = 100'000;
/// Requests for one batch within this time are one request.
constexpr int64_t kHastyUs = 2'000;
/// How often a paused replay says that it lives, and a follower that it would like to join.
constexpr int64_t kBeatUs = 1'000'000;
constexpr int64_t kJoinUs = 100'000;
/// What a follower gathers at most; a batch that is larger is none of ours.
constexpr size_t kMostGathered = 1'000;

/// A message of this protocol, with all that it does not use empty.
ask_t MakeMark(int8_t kind, std::string_view sender, int64_t number) {
  ask_t ask{};
  ask.header.protocol = morphbus::header_t::PROTOCOL;
  ask.sender = sender;
  ask.kind = kind;
  ask.first_sequence = std::max<int64_t>(number, 0);
  ask.acknowledged_tick = -1;
  return ask;
}

/// As a message of the replay's, outside the outbox: these have no numbers.
void SendAsk(bridge::Bus* bus, const std::string& channel, const ask_t& ask) {
  std::vector<uint8_t> payload;
  bridge::Encode(ask, &payload);
  bus->Publish(channel, payload.data(), payload.size());
}

}  // namespace

bool IsFollowed(std::string_view run, std::string_view channel, size_t size) {
  const auto name = bridge::ParseChannel(channel);
  if (!name || name->run != run || channel.size() + size > kMaxFollowedBytes) return false;
  return name->topic != Topic::kAsk && name->topic != Topic::kHello &&
         name->topic != Topic::kControl && name->topic != Topic::kEnd;
}

void BatchSum::Add(std::string_view channel, std::span<const uint8_t> data) {
  // Name and data are told apart by their sizes.
  const uint64_t sizes[2] = {channel.size(), data.size()};
  hash_.Update(reinterpret_cast<const uint8_t*>(sizes), sizeof sizes);
  hash_.Update(reinterpret_cast<const uint8_t*>(channel.data()), channel.size());
  hash_.Update(data.data(), data.size());
  ++count_;
}

std::string BatchSum::hash() const { return fmt::format("{:016x}", hash_.Digest()); }

// ---- The replayer's side ----

void ReplayDelivery::Take(const ask_t& ask) {
  if (ask.kind == ask_t::KIND_FOLLOW && followers_.size() < kMostFollowers) {
    // Who joins within a batch is asked for the next one.
    followers_.emplace(ask.sender, true);
    return;
  }
  // Answers count only for the batch that is out.
  const auto follower = followers_.find(ask.sender);
  if (follower == followers_.end() || ask.first_sequence != number_) return;
  if (ask.kind == ask_t::KIND_BATCH_ACK) {
    follower->second = true;
  } else if (ask.kind == ask_t::KIND_BATCH_AGAIN && waiting_) {
    again_ = true;
    asking_.insert(ask.sender);
  }
}

void ReplayDelivery::Mark(int8_t kind) {
  ask_t mark = MakeMark(kind, "LOG", number_);
  if (kind == ask_t::KIND_BATCH_END) {
    mark.last_sequence = sum_.count();
    mark.run_hash = sum_.hash();
    mark.verdict = ending_ ? "end" : "";
  }
  SendAsk(bus_, bridge::Channel(run_, kFollowProcess, Topic::kAsk), mark);
}

void ReplayDelivery::Publish(const std::string& channel, std::span<const uint8_t> data) {
  const bool followed = !followers_.empty() && IsFollowed(run_, channel, data.size());
  if (followed && !open_) {
    // A new batch, for all who follow now.
    ++number_;
    batch_.clear();
    batch_bytes_ = 0;
    sum_ = BatchSum();
    for (auto& [name, acknowledged] : followers_) acknowledged = false;
    open_ = true;
    Mark(ask_t::KIND_BATCH);
  }
  // It goes out now, and is kept until all have it.
  if (followed) {
    sum_.Add(channel, data);
    batch_bytes_ += channel.size() + data.size();
    batch_.emplace_back(channel, std::vector<uint8_t>(data.begin(), data.end()));
  }
  bus_->Publish(channel, data.data(), data.size());
}

bool ReplayDelivery::full() const {
  return batch_.size() >= kBatchMessages || batch_bytes_ >= kBatchBytes;
}

void ReplayDelivery::Close(int64_t now_us) {
  if (!open_) return;
  open_ = false;
  waiting_ = true;
  Mark(ask_t::KIND_BATCH_END);
  closed_us_ = sent_us_ = now_us;
  pause_us_ = kFirstPauseUs;
}

void ReplayDelivery::End(int64_t now_us) {
  if (followers_.empty() || ending_) return;
  // A batch of nothing, whose end says that it is the last one.
  ++number_;
  batch_.clear();
  sum_ = BatchSum();
  for (auto& [name, acknowledged] : followers_) acknowledged = false;
  ending_ = open_ = true;
  Mark(ask_t::KIND_BATCH);
  Close(now_us);
}

void ReplayDelivery::SendAgain(int64_t now_us) {
  again_ = false;
  sent_us_ = now_us;
  Mark(ask_t::KIND_BATCH);
  for (const auto& [channel, data] : batch_) bus_->Publish(channel, data.data(), data.size());
  Mark(ask_t::KIND_BATCH_END);
}

bool ReplayDelivery::Waiting(int64_t now_us) {
  if (!waiting_) return false;
  waiting_ =
      !std::all_of(followers_.begin(), followers_.end(), [](const auto& f) { return f.second; });
  if (!waiting_) {
    batch_.clear();
    batch_bytes_ = 0;
    return false;
  }
  // What somebody lacks goes out again as a whole; without an answer the end of the batch is
  // repeated, which asks for one.
  if (again_ && now_us - sent_us_ >= kHastyUs) {
    SendAgain(now_us);
  } else if (now_us - sent_us_ >= pause_us_) {
    pause_us_ = std::min(2 * pause_us_, kLongestPauseUs);
    sent_us_ = now_us;
    Mark(ask_t::KIND_BATCH_END);
  }
  // Who is silent for long is given up, and nobody waits for it any more; who asks again lives.
  if (now_us - closed_us_ > kFollowPatienceUs) {
    lost_ += static_cast<int>(std::erase_if(
        followers_, [&](const auto& f) { return !f.second && !asking_.contains(f.first); }));
    asking_.clear();
    closed_us_ = now_us;
  }
  return true;
}

void ReplayDelivery::Beat(int64_t now_us) {
  if (followers_.empty() || waiting_ || open_ || number_ < 0 || now_us - sent_us_ < kBeatUs) return;
  // The end of the last batch once more. Whoever has it acknowledges it again; nobody waits for it.
  sent_us_ = now_us;
  Mark(ask_t::KIND_BATCH_END);
}

// ---- The follower's side ----

ReplayFollower::ReplayFollower(bridge::Bus* bus, std::string run, std::string name, Sink sink)
    : bus_(bus), run_(std::move(run)), name_(std::move(name)), sink_(std::move(sink)) {
  bus_->SubscribePrefix(run_ + "/",
                        [this](std::string_view channel, const uint8_t* data, size_t size) {
                          OnMessage(channel, {data, size});
                        });
}

ReplayFollower::~ReplayFollower() { bus_->Unsubscribe(run_ + "/"); }

void ReplayFollower::Answer(int8_t kind, int64_t number) {
  SendAsk(bus_, bridge::Channel(run_, bridge::kLogProcess, Topic::kAsk),
          MakeMark(kind, name_, number));
}

void ReplayFollower::Advance(int64_t now_us) {
  if (heard_) last_heard_us_ = now_us;
  joined_ = joined_ || heard_;
  heard_ = false;
  if (joined_) {
    abandoned_ = !finished_ && now_us - last_heard_us_ > kFollowPatienceUs;
  } else if (last_asked_us_ == 0 || now_us - last_asked_us_ >= kJoinUs) {
    last_asked_us_ = now_us;
    Answer(ask_t::KIND_FOLLOW, 0);
  }
}

void ReplayFollower::OnMessage(std::string_view channel, std::span<const uint8_t> data) {
  if (IsFollowed(run_, channel, data.size())) {
    if (gathering_ < 0 || batch_.size() >= kMostGathered) return;
    sum_.Add(channel, data);
    batch_.emplace_back(channel, std::vector<uint8_t>(data.begin(), data.end()));
    return;
  }
  const auto name = bridge::ParseChannel(channel);
  if (!name || name->topic != Topic::kAsk || name->process != kFollowProcess) return;
  ask_t mark;
  if (bridge::Decode(data.data(), data.size(), {}, &mark)) OnMark(mark);
}

void ReplayFollower::OnMark(const ask_t& mark) {
  heard_ = true;
  const int64_t number = mark.first_sequence;
  if (mark.kind == ask_t::KIND_BATCH) {
    // A batch that was delivered already is somebody else's repetition.
    gathering_ = number > done_ ? number : -1;
    batch_.clear();
    sum_ = BatchSum();
    return;
  }
  if (mark.kind != ask_t::KIND_BATCH_END) return;
  if (number <= done_) return Answer(ask_t::KIND_BATCH_ACK, number);
  // Count and hash tell whether the batch is all there.
  const bool whole =
      gathering_ == number && sum_.count() == mark.last_sequence && sum_.hash() == mark.run_hash;
  gathering_ = -1;
  if (!whole) {
    ++asked_again_;
    return Answer(ask_t::KIND_BATCH_AGAIN, number);
  }
  // Only a whole batch is handed on, in order and once.
  done_ = number;
  for (const auto& [channel, data] : batch_) sink_(channel, data);
  delivered_ += static_cast<int64_t>(batch_.size());
  batch_.clear();
  finished_ = finished_ || mark.verdict == "end";
  Answer(ask_t::KIND_BATCH_ACK, number);
}

}  // namespace morphbus::logger
