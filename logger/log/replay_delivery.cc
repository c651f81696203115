#include "logger/log/replay_delivery.h"

#include <algorithm>

#include "bridge/wire/codec.h"

namespace morphbus::logger {

using bridge::Topic;

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

/// Publishes a message of a replay's, which is no party of a run and has no outbox.
template <class M>
void SendOutside(bridge::Bus* bus, const std::string& channel, M message) {
  message.header.protocol = morphbus::header_t::PROTOCOL;
  std::vector<uint8_t> payload;
  bridge::Encode(message, &payload);
  bus->Publish(channel, payload.data(), payload.size());
}

}  // namespace

bool IsReplayed(Topic topic) {
  return bridge::IsHashed(topic) || topic == Topic::kHealth || topic == Topic::kInfo;
}

bool IsFollowed(std::string_view run, std::string_view channel, size_t size) {
  const auto name = bridge::ParseChannel(channel);
  return name && name->run == run && channel.size() + size <= kMaxFollowedBytes &&
         IsReplayed(name->topic);
}

void BatchSum::Add(std::string_view channel, std::span<const uint8_t> data) {
  // Each digest is of one name or one payload, so that the two cannot run into one another. All
  // bytes count, those of CRC and auth as well: a replay is of what stands in the log.
  hash_.Add(bridge::DigestOf(reinterpret_cast<const uint8_t*>(channel.data()), channel.size()));
  hash_.Add(bridge::DigestOf(data.data(), data.size()));
  ++count_;
}

// ---- The replayer's side ----

void ReplayDelivery::Take(const morphbus::replay_follow_t& said) {
  if (said.batch < 0) {
    // Who joins within a batch is asked for the next one.
    if (followers_.size() < kMostFollowers) followers_.emplace(said.follower, true);
    return;
  }
  // Answers count only for the batch that is out.
  const auto follower = followers_.find(said.follower);
  if (follower == followers_.end() || said.batch != number_) return;
  if (said.whole) {
    follower->second = true;
  } else if (waiting_) {
    again_ = true;
    asking_.insert(said.follower);
  }
}

void ReplayDelivery::Mark(bool ended) {
  morphbus::replay_batch_t mark{};
  mark.header.sequence = marks_++;
  mark.batch = number_;
  mark.ended = ended;
  if (ended) {
    mark.message_count = sum_.count();
    mark.chained_hash = sum_.hash();
    mark.last = ending_;
  }
  SendOutside(bus_, bridge::Channel(run_, "", Topic::kBatch), std::move(mark));
}

void ReplayDelivery::Publish(const std::string& channel, std::span<const uint8_t> data) {
  // Without followers nothing is kept, and the messages go out without marks.
  const bool followed = !followers_.empty() && IsFollowed(run_, channel, data.size());
  if (followed && !open_) {
    // A new batch, for all who follow now.
    ++number_;
    batch_.clear();
    batch_bytes_ = 0;
    sum_ = BatchSum();
    for (auto& [name, acknowledged] : followers_) acknowledged = false;
    open_ = true;
    Mark(false);
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
  Mark(true);
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
  Mark(false);
  Close(now_us);
}

void ReplayDelivery::SendAgain(int64_t now_us) {
  again_ = false;
  sent_us_ = now_us;
  Mark(false);
  for (const auto& [channel, data] : batch_) bus_->Publish(channel, data.data(), data.size());
  Mark(true);
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
    Mark(true);
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
  Mark(true);
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

void ReplayFollower::Answer(int64_t batch, bool whole) {
  SendOutside(bus_, bridge::Channel(run_, "", Topic::kFollow),
              morphbus::replay_follow_t{{}, name_, batch, whole});
}

void ReplayFollower::Advance(int64_t now_us) {
  if (heard_) last_heard_us_ = now_us;
  joined_ = joined_ || heard_;
  heard_ = false;
  if (joined_) {
    abandoned_ = !finished_ && now_us - last_heard_us_ > kFollowPatienceUs;
  } else if (last_asked_us_ == 0 || now_us - last_asked_us_ >= kJoinUs) {
    last_asked_us_ = now_us;
    Answer(-1, false);
  }
}

void ReplayFollower::OnMessage(std::string_view channel, std::span<const uint8_t> data) {
  // Messages count within a batch only; outside of one they are of a replay that others follow.
  if (IsFollowed(run_, channel, data.size())) {
    if (gathering_ < 0 || batch_.size() >= kMostGathered) return;
    sum_.Add(channel, data);
    batch_.emplace_back(channel, std::vector<uint8_t>(data.begin(), data.end()));
    return;
  }
  const auto name = bridge::ParseChannel(channel);
  if (!name || name->topic != Topic::kBatch) return;
  morphbus::replay_batch_t mark;
  if (bridge::Decode(data.data(), data.size(), {}, &mark)) OnMark(mark);
}

void ReplayFollower::OnMark(const morphbus::replay_batch_t& mark) {
  heard_ = true;
  if (!mark.ended) {
    // A batch that was delivered already is somebody else's repetition.
    gathering_ = mark.batch > done_ ? mark.batch : -1;
    batch_.clear();
    sum_ = BatchSum();
    return;
  }
  // The answer to it may have been lost, so that it is given again.
  if (mark.batch <= done_) return Answer(mark.batch, true);
  // Count and hash tell whether the batch is all there.
  const bool whole = gathering_ == mark.batch && sum_.count() == mark.message_count &&
                     sum_.hash() == mark.chained_hash;
  gathering_ = -1;
  if (!whole) {
    ++asked_again_;
    return Answer(mark.batch, false);
  }
  // Only a whole batch is handed on, in order and once.
  done_ = mark.batch;
  for (const auto& [channel, data] : batch_) sink_(channel, data);
  delivered_ += static_cast<int64_t>(batch_.size());
  batch_.clear();
  finished_ = finished_ || mark.last;
  Answer(mark.batch, true);
}

}  // namespace morphbus::logger
