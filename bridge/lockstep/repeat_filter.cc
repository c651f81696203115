#include "bridge/lockstep/repeat_filter.h"

#include <morphbus/control_t.hpp>
#include <morphbus/hello_t.hpp>
#include <morphbus/replay_follow_t.hpp>
#include <morphbus/resend_t.hpp>
#include <morphbus/totals_t.hpp>

#include "bridge/wire/codec.h"

namespace morphbus::bridge {
namespace {

/// Decodes a message and asks `tell` whose numbers it has; nothing if it is not sound.
template <class M, class Tell>
std::optional<std::string> Publisher(const uint8_t* data, size_t size, const Tell& tell) {
  M message;
  if (!Decode(data, size, {}, &message)) return std::nullopt;
  return tell(message);
}

/// Whose numbers a message has, among those who publish on its channel: empty where that is one.
std::optional<std::string> PublisherOf(Topic topic, const uint8_t* data, size_t size) {
  switch (topic) {
    // Two that claim to be one process are two publishers.
    case Topic::kHello:
      return Publisher<morphbus::hello_t>(data, size, [](const morphbus::hello_t& m) {
        return m.process + " " + std::to_string(m.claim);
      });
    case Topic::kResend:
      return Publisher<morphbus::resend_t>(data, size,
                                           [](const morphbus::resend_t& m) { return m.sender; });
    case Topic::kTotals:
      return Publisher<morphbus::totals_t>(data, size,
                                           [](const morphbus::totals_t& m) { return m.process; });
    // Who gives a command numbers it and its repetitions from 0.
    case Topic::kControl:
      return Publisher<morphbus::control_t>(
          data, size, [](const morphbus::control_t& m) { return std::to_string(m.counter); });
    case Topic::kFollow:
      return Publisher<morphbus::replay_follow_t>(
          data, size, [](const morphbus::replay_follow_t& m) { return m.follower; });
    default:
      return std::string();
  }
}

}  // namespace

bool NumberWindow::Take(int64_t number) {
  if (number > highest_) {
    // The window moves on with the highest number.
    const uint64_t step = static_cast<uint64_t>(number) - static_cast<uint64_t>(highest_);
    taken_ = step < kSize ? taken_ << step | 1 : 1;
    highest_ = number;
    return true;
  }
  // A number below the window may have come or not; to take it once too often would be worse.
  const auto age = static_cast<uint64_t>(highest_ - number);
  if (age >= kSize) return false;
  const uint64_t place = uint64_t{1} << age;
  const bool is_new = (taken_ & place) == 0;
  taken_ |= place;
  return is_new;
}

bool RepeatFilter::IsRepeat(const ChannelName& name, const uint8_t* data, size_t size) {
  morphbus::header_t header;
  if (!DecodeHeader(data, size, &header)) return false;
  const std::optional<std::string> publisher = PublisherOf(name.topic, data, size);
  if (!publisher) return false;
  // Neither a process nor a topic has a blank in its name.
  std::string key(name.process);
  key += ' ';
  key += TopicName(name.topic);
  key += ' ';
  key += *publisher;
  // Each publisher has a window of its own, so that one cannot push another's numbers out.
  const auto [entry, is_new] = windows_.try_emplace(key);
  if (is_new) publishers_.push_back(std::move(key));
  if (!entry->second.Take(header.sequence)) return true;
  if (publishers_.size() > kMostPublishers) {
    windows_.erase(publishers_.front());
    publishers_.pop_front();
  }
  return false;
}

}  // namespace morphbus::bridge
