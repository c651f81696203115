// The in-process bus: who gets what, in which order, and what becomes of messages under way.

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/bus/inproc_bus.h"
#include "bridge/bus/lcm_bus.h"

namespace morphbus::bridge {
namespace {

const std::vector<uint8_t> kThreeBytes = {1, 2, 3};

TEST(InprocBus, DeliversInOrderOfPublicationToEverybodyWhoListens) {
  InprocHub hub;
  const auto a = hub.Connect(), b = hub.Connect(), c = hub.Connect();
  std::vector<std::string> heard;
  const auto note = [&heard](const std::string& who) {
    return [&heard, who](std::string_view channel, const uint8_t*, size_t) {
      heard.push_back(who + ":" + std::string(channel));
    };
  };
  a->Subscribe("x", note("a"));
  b->SubscribePrefix("", note("b"));
  c->Publish("y", kThreeBytes.data(), kThreeBytes.size());
  a->Publish("x", kThreeBytes.data(), kThreeBytes.size());
  EXPECT_EQ(hub.HandleAll(), 3);
  EXPECT_EQ(heard, (std::vector<std::string>{"a:x", "b:y", "b:x"}));
  a->Unsubscribe("x");
  a->Publish("x", kThreeBytes.data(), kThreeBytes.size());
  EXPECT_EQ(hub.HandleAll(), 1);
}

TEST(InprocBus, NothingIsLostHoweverMuchWaits) {
  InprocHub hub;
  const auto a = hub.Connect();
  size_t heard = 0;
  a->Subscribe("x", [&heard](std::string_view, const uint8_t*, size_t) { ++heard; });
  constexpr size_t kCount = 40 * kBusQueueDepth;
  for (size_t i = 0; i < kCount; ++i) a->Publish("x", kThreeBytes.data(), kThreeBytes.size());
  hub.HandleAll();
  EXPECT_EQ(heard, kCount);
  EXPECT_EQ(a->losses().queue_overflows, 0);
}

TEST(InprocBus, WhoListensQuietlyHasTheFirstMessageOfAChannelOnceItIsNamed) {
  InprocHub hub;
  const auto sender = hub.Connect(), receiver = hub.Connect(), other = hub.Connect();
  std::vector<std::string> heard;
  const auto note = [&](std::string_view channel, const uint8_t* data, size_t) {
    heard.push_back(std::string(channel) + ":" + std::to_string(*data));
  };
  const auto never = [](std::string_view, const uint8_t*, size_t) { FAIL(); };
  const auto say = [&](const std::string& channel, uint8_t what) {
    sender->Publish(channel, &what, 1);
    hub.HandleAll();
  };
  say("r/a/T", 1);
  receiver->SubscribeQuietly("r/", "/T", never);
  say("r/a/T", 2);
  say("r/a/T", 3);
  say("r/b/T", 4);
  say("r/a/S", 5);
  // What was said before anybody listened is gone; of the rest the first message has waited.
  receiver->Subscribe("r/a/T", note);
  receiver->Subscribe("r/a/S", note);
  // Nobody else is given anything.
  other->Subscribe("r/a/T",
                   [&](std::string_view, const uint8_t*, size_t) { heard.emplace_back("other"); });
  hub.HandleAll();
  EXPECT_EQ(heard, (std::vector<std::string>{"r/a/T:2"}));
  say("r/a/T", 6);
  EXPECT_EQ(heard, (std::vector<std::string>{"r/a/T:2", "r/a/T:6", "other"}));
  // Nothing is kept for those who no longer listen.
  receiver->Unsubscribe("r/");
  receiver->Subscribe("r/b/T", note);
  hub.HandleAll();
  EXPECT_EQ(heard.size(), 3u);
}

TEST(InprocBus, WhatIsStillAwaitedKeepsItsBytesHoweverMuchElseIsSent) {
  InprocHub hub;
  const auto slow = hub.Connect(), quick = hub.Connect();
  std::vector<uint8_t> heard;
  size_t others = 0;
  slow->Subscribe("x",
                  [&](std::string_view, const uint8_t* data, size_t) { heard.push_back(*data); });
  quick->Subscribe("y", [&](std::string_view, const uint8_t*, size_t) { ++others; });
  // Memory of messages is used again; those that nobody has taken yet lie between others.
  std::vector<uint8_t> sent;
  const size_t count = 6 * kBusQueueDepth;
  for (size_t i = 0; i < count; ++i) {
    const auto byte = static_cast<uint8_t>(i % 251);
    const bool kept = i % 1000 == 0;
    if (kept) sent.push_back(byte);
    quick->Publish(kept ? "x" : "y", &byte, 1);
    quick->Handle(0);
  }
  slow->Handle(0);
  EXPECT_EQ(heard, sent);
  EXPECT_EQ(others + sent.size(), count);
}

TEST(InprocBus, HandlersMayUnsubscribeThemselves) {
  InprocHub hub;
  const auto a = hub.Connect();
  int heard = 0;
  a->Subscribe("x", [&](std::string_view, const uint8_t*, size_t) {
    a->Unsubscribe("x");
    ++heard;
  });
  for (int i = 0; i < 3; ++i) a->Publish("x", kThreeBytes.data(), kThreeBytes.size());
  hub.HandleAll();
  EXPECT_EQ(heard, 1);
}

TEST(InprocBus, WhoChangesWhatHeListensToIsHeededFromTheNextMessageOn) {
  InprocHub hub;
  const auto sender = hub.Connect(), a = hub.Connect();
  auto gone = hub.Connect();
  std::vector<std::string> heard;
  const auto note = [&heard](const std::string& who) {
    return [&heard, who](std::string_view channel, const uint8_t*, size_t) {
      heard.push_back(who + ":" + std::string(channel));
    };
  };
  // More channels than the sender's end of the bus keeps in mind, in changing order.
  std::vector<std::string> channels;
  for (int i = 0; i < 12; ++i) channels.push_back("c_" + std::to_string(i));
  const auto hear = [&](std::vector<std::string> wanted) {
    for (int round = 0; round < 3; ++round) {
      for (const std::string& channel : channels) {
        sender->Publish(channel, kThreeBytes.data(), kThreeBytes.size());
      }
      hub.HandleAll();
      EXPECT_EQ(heard, wanted) << "round " << round;
      heard.clear();
      std::ranges::reverse(channels);
      std::ranges::reverse(wanted);
    }
    std::ranges::reverse(channels);
  };
  hear({});
  a->Subscribe("c_3", note("a"));
  hear({"a:c_3"});
  gone->SubscribePrefix("c_1", note("prefix"));
  // In rounds of the hub, endpoint by endpoint.
  const auto prefixed = [&] {
    for (const char* channel : {"c_3", "c_1"}) {
      sender->Publish(channel, kThreeBytes.data(), kThreeBytes.size());
    }
    hub.HandleAll();
    return std::exchange(heard, {});
  };
  EXPECT_EQ(prefixed(), (std::vector<std::string>{"a:c_3", "prefix:c_1"}));
  a->Unsubscribe("c_3");
  EXPECT_EQ(prefixed(), (std::vector<std::string>{"prefix:c_1"}));
  gone->SubscribeQuietly("c", "3", note("pattern"));
  EXPECT_EQ(prefixed(), (std::vector<std::string>{"prefix:c_1"}));
  gone = nullptr;
  EXPECT_EQ(prefixed(), (std::vector<std::string>{}));
}

TEST(InprocBus, WhoIsGoneGetsNothingMore) {
  InprocHub hub;
  const auto sender = hub.Connect();
  int heard = 0;
  const auto count = [&](std::string_view, const uint8_t*, size_t) { ++heard; };
  auto gone = hub.Connect();
  gone->Subscribe("x", count);
  sender->Publish("x", kThreeBytes.data(), kThreeBytes.size());
  EXPECT_EQ(hub.HandleAll(), 1);
  gone = nullptr;
  // Whoever comes next may lie where the other one lay.
  const auto next = hub.Connect();
  next->Subscribe("y", count);
  sender->Publish("x", kThreeBytes.data(), kThreeBytes.size());
  EXPECT_EQ(hub.HandleAll(), 0);
  EXPECT_EQ(heard, 1);
}

TEST(InprocBus, OfAChannelInPartsAnotherPartMayBeWantedFromTheNextMessageOn) {
  InprocHub hub;
  const auto sender = hub.Connect(), a = hub.Connect();
  std::vector<int> heard;
  const auto want = [&](uint16_t part) {
    a->Subscribe("x",
                 [&](std::string_view, const uint8_t* data, size_t) { heard.push_back(data[0]); },
                 {true, 1, 0, part, false});
  };
  const auto publish_all = [&] {
    for (const uint8_t part : {uint8_t{1}, uint8_t{2}, uint8_t{3}}) sender->Publish("x", &part, 1);
    hub.HandleAll();
  };
  want(2);
  publish_all();
  want(3);
  publish_all();
  EXPECT_EQ(heard, (std::vector<int>{2, 3}));
}

TEST(InprocBus, AHandlerMayDropWhatWaitsBehindItsOwnMessage) {
  InprocHub hub;
  const auto sender = hub.Connect(), a = hub.Connect();
  std::vector<std::string> heard;
  a->Subscribe("x", [&](std::string_view, const uint8_t*, size_t) {
    heard.emplace_back("x");
    a->Unsubscribe("y");
    // What waits is gone on with here.
    a->Handle(0);
  });
  const auto note = [&](std::string_view channel, const uint8_t*, size_t) {
    heard.emplace_back(channel);
  };
  a->Subscribe("y", note);
  a->Subscribe("z", note);
  for (const char* channel : {"x", "y", "z"}) {
    sender->Publish(channel, kThreeBytes.data(), kThreeBytes.size());
  }
  hub.HandleAll();
  EXPECT_EQ(heard, (std::vector<std::string>{"x", "z"}));
  // Prefixes that come while messages wait do not make them come twice, or not at all.
  sender->Publish("z", kThreeBytes.data(), kThreeBytes.size());
  a->SubscribePrefix("other", note);
  hub.HandleAll();
  sender->Publish("z", kThreeBytes.data(), kThreeBytes.size());
  a->Unsubscribe("other");
  hub.HandleAll();
  EXPECT_EQ(heard, (std::vector<std::string>{"x", "z", "z", "z"}));
}

TEST(InprocBus, WhatWaitedForADroppedSubscriptionIsNotForALaterOne) {
  InprocHub hub;
  const auto a = hub.Connect();
  std::vector<std::string> heard;
  const auto note = [&](const char* what) {
    return [&heard, what](std::string_view, const uint8_t*, size_t) { heard.emplace_back(what); };
  };
  a->Subscribe("x", note("first"));
  a->Publish("x", kThreeBytes.data(), kThreeBytes.size());
  a->Unsubscribe("x");
  a->Subscribe("x", note("second"));
  EXPECT_EQ(hub.HandleAll(), 1);
  EXPECT_EQ(heard, (std::vector<std::string>{}));
  a->Publish("x", kThreeBytes.data(), kThreeBytes.size());
  hub.HandleAll();
  EXPECT_EQ(heard, (std::vector<std::string>{"second"}));
}

}  // namespace
}  // namespace morphbus::bridge
