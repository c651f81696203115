#include <gtest/gtest.h>

#include <morphbus/control_t.hpp>
#include <vector>

#include "bridge/bus/inproc_bus.h"
#include "bridge/control/control_service.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/sealed_bus.h"

namespace morphbus::bridge {
namespace {

using Kind = CommandFilter::Kind;

constexpr uint64_t kModel = 42;
const Sender kSim = {"walk", "SIM", kModel, 0};
const Sender kTool = {"walk", "TOOL", kModel, 0};

/// A key of which each byte is `byte`.
RunKey KeyOf(uint8_t byte) {
  RunKey::Bytes key;
  key.fill(byte);
  return RunKey(key);
}

/// The error of a command that cannot be read; empty if it can.
std::string ErrorOf(const std::string& text) {
  const Result<ControlCommand> command = ParseControl(text);
  return command ? "" : command.error().message;
}

TEST(ControlCommandTest, TextsAreReadBackAsTheyWere) {
  for (const char* text : {"pause",
                           "resume",
                           "step 5",
                           "speed 0.5",
                           "speed 0",
                           "stop",
                           "push m5 EAST 2",
                           "push m5.active_block 0.1,-2,3e-05 2.5 0.3",
                           "kill m2",
                           "restart m2",
                           "restart m2 --cold",
                           "restart m2 --cold --from 411",
                           "lose m3",
                           "inspect",
                           "inspect m5",
                           "connect m1.c2 m2.c5",
                           "disconnect m2.c3",
                           "deploy models/x.dyn",
                           "deploy x.dyn 0123456789abcdef --to m5",
                           "deploy x.dyn --at 12.5",
                           "deploy x.dyn 0123456789abcdef --to m5 --at 11.2",
                           "invoke Leg.turn 3 -0.5 $NORTH true --to m5"}) {
    const Result<ControlCommand> command = ParseControl(text);
    ASSERT_TRUE(command) << text << ": " << command.error().message;
    EXPECT_EQ(ControlText(*command), text);
  }
}

TEST(ControlCommandTest, WhoCountsMessagesReadsWhichModuleIsLost) {
  EXPECT_EQ(LostModule(ControlText(*ParseControl("lose  m3"))), "m3");
  EXPECT_EQ(LostModule("kill m3"), "");
  EXPECT_EQ(LostModule(""), "");
}

TEST(ControlCommandTest, OneCommandHasOneText) {
  EXPECT_EQ(ControlText(*ParseControl("  push   m5 0,0,1 2.50  ")), "push m5 EAST 2.5");
  EXPECT_EQ(ControlText(*ParseControl("push m5 east 2 300ms")), "push m5 EAST 2 0.3");
  EXPECT_EQ(ControlText(*ParseControl("deploy x.dyn --at 12.5s")), "deploy x.dyn --at 12.5");
  EXPECT_EQ(ControlText(*ParseControl("step")), "step 1");
  EXPECT_EQ(ControlText(*ParseControl("deploy --to m5 x.dyn")), "deploy x.dyn --to m5");
}

TEST(ControlCommandTest, ErrorsSayWhatWasExpected) {
  EXPECT_EQ(ErrorOf("puase"), "no command 'puase' (did you mean 'pause'?)");
  EXPECT_EQ(ErrorOf(""), "expected a command");
  EXPECT_EQ(ErrorOf("pause now"), "expected: pause");
  EXPECT_EQ(ErrorOf("push m5 EAST"), "expected: push BODY DIRECTION NEWTON [SECONDS]");
  EXPECT_EQ(ErrorOf("inspect m5.c1"), "expected MODULE, not m5.c1");
  EXPECT_EQ(ErrorOf("inspect m5 m6"), "expected: inspect [m5]");
  EXPECT_EQ(ErrorOf("step 0"), "step: expected a number, 1 to 1000000, not '0'");
  EXPECT_EQ(ErrorOf("speed nan"), "speed: expected a number, 0 to 1000000, not 'nan'");
  EXPECT_EQ(ErrorOf("speed 1e-300"), "speed: expected 0 or at least 0.001, not '1e-300'");
  EXPECT_EQ(ErrorOf("speed 0.001"), "");
  EXPECT_EQ(ErrorOf("deploy a#b.dyn"), "deploy: a path must not hold '#': a#b.dyn");
  EXPECT_EQ(ErrorOf("deploy my prog.dyn"),
            "deploy: 'prog.dyn' is no hash of an image (a path must not hold blanks)");
  EXPECT_EQ(ErrorOf("kill m2 --cold"), "kill: unknown option --cold");
  EXPECT_EQ(ErrorOf("deploy x.dyn --to"), "--to: expected one module");
  EXPECT_EQ(ErrorOf("deploy x.dyn --at"), "--at: expected one time, such as 12.5 or 12.5s");
  EXPECT_EQ(ErrorOf("deploy x.dyn --at 3 --at 4"),
            "--at: expected one time, such as 12.5 or 12.5s");
  EXPECT_EQ(ErrorOf("deploy x.dyn --at -3"), "--at: expected a time, 0 to 1000000000 s, not '-3'");
  EXPECT_EQ(ErrorOf("invoke A.b --at 3"), "invoke: unknown option --at");
  EXPECT_EQ(ErrorOf("disconnect m2"), "expected MODULE.CONNECTOR, not 'm2'");
  EXPECT_EQ(ErrorOf("invoke turn"), "invoke: expected Role.command, not 'turn'");
  EXPECT_EQ(ErrorOf("push m5 east 2"), "");
  EXPECT_NE(ErrorOf("push m5 EST 2").find("(did you mean 'EAST'?)"), std::string::npos);
  EXPECT_NE(ErrorOf("push m5 0,0,0 2"), "");
  EXPECT_EQ(ErrorOf("deploy x\x1b.dyn"), "a command is one line of printable text");
  EXPECT_NE(ErrorOf(std::string(300, 'x')), "");
}

TEST(ControlCommandTest, AnswersAreReadBackAsTheyWere) {
  for (const ControlAnswer& answer :
       {ControlAnswer{7, ControlAnswer::State::kDone, 412, 0, ""},
        ControlAnswer{8, ControlAnswer::State::kLater, 413, 0, "", "deploy x.dyn --at 9.5"},
        ControlAnswer{9, ControlAnswer::State::kRefused, 0, 2, "no module 'm55' here"}}) {
    const std::string text = AnswerText(answer);
    EXPECT_TRUE(IsAnswer(text));
    EXPECT_FALSE(ParseControl(text)) << "an answer must be no command";
    const Result<ControlAnswer> read = ParseAnswer(text);
    ASSERT_TRUE(read);
    EXPECT_EQ(AnswerText(*read), text);
    EXPECT_EQ(read->reason, answer.reason);
    EXPECT_EQ(read->effect, answer.effect);
  }
  EXPECT_FALSE(ParseAnswer("answer x done 1"));
  EXPECT_FALSE(ParseAnswer("answer 1 perhaps 1"));
}

/// A command with this counter, as its sender gives it for the first time, the second, …
morphbus::control_t MessageOf(int64_t counter, const std::string& command, int64_t sequence = 0) {
  morphbus::control_t message;
  message.header.sequence = sequence;
  message.counter = counter;
  message.command = command;
  return message;
}

TEST(CommandFilterTest, ACommandIsTakenOnceAndNoneAfterALaterOne) {
  Ledger ledger;
  CommandFilter filter(&ledger);
  EXPECT_EQ(filter.Take(MessageOf(100, "pause")), Kind::kNew);
  EXPECT_EQ(filter.Take(MessageOf(100, "pause", 1)), Kind::kAgain);
  EXPECT_EQ(filter.Take(MessageOf(95, "pause")), Kind::kOvertaken);
  EXPECT_EQ(filter.Take(MessageOf(102, "answer 1 done 1")), Kind::kAnswer);
  EXPECT_EQ(filter.Take(MessageOf(101, "resume")), Kind::kNew);
  EXPECT_EQ(ledger.old_commands, 2);
}

TEST(CommandFilterTest, WhatIsSaidAgainUnderItsNumberIsNoRequestForAnAnswer) {
  Ledger ledger;
  CommandFilter filter(&ledger);
  EXPECT_EQ(filter.Take(MessageOf(100, "pause")), Kind::kNew);
  EXPECT_EQ(filter.Take(MessageOf(100, "pause", 1)), Kind::kAgain);
  EXPECT_EQ(filter.Take(MessageOf(90, "resume")), Kind::kOvertaken);
  for (const int64_t number : {0, 1, 0}) {
    EXPECT_EQ(filter.Take(MessageOf(100, "pause", number)), Kind::kRepeat);
  }
  EXPECT_EQ(filter.Take(MessageOf(90, "resume")), Kind::kRepeat);
  EXPECT_EQ(filter.Take(MessageOf(90, "resume", 1)), Kind::kOvertaken);
  // What is older than everything that is remembered was answered long ago.
  for (int i = 101; i <= 3000; ++i) filter.Take(MessageOf(i, "step 1"));
  for (int i = 1; i <= 1500; ++i) {
    EXPECT_EQ(filter.Take(MessageOf(i, "step 1", 7)), Kind::kRepeat);
  }
}

TEST(CommandFilterTest, NoneOfAThousandOldCommandsIsTakenAgain) {
  Ledger ledger;
  CommandFilter filter(&ledger);
  for (int i = 1; i <= 3000; ++i) ASSERT_EQ(filter.Take(MessageOf(i, "step 1")), Kind::kNew);
  for (int i = 1; i <= 3000; ++i) ASSERT_NE(filter.Take(MessageOf(i, "step 1")), Kind::kNew);
  EXPECT_EQ(ledger.old_commands, 3000);
}

/// The sim's end with what it was told to do, and a hub on which others are.
class ControlServiceTest : public ::testing::Test {
 protected:
  ControlServiceTest()
      : sim_bus_(hub_.Connect()),
        sealed_(sim_bus_.get(), KeyOf(1)),
        service_(&sealed_, &time_, kSim, &ledger_,
                 [this](int64_t counter, const ControlCommand& command) {
                   done_.push_back(ControlText(command));
                   service_.Answer({counter, ControlAnswer::State::kDone, 7, 0, ""});
                 }) {
    // As on a machine that has run for a while.
    time_.AdvanceTo(1'000'000'000);
  }

  /// A tool's bus, whose every wait gives the others their turn and lets time pass.
  class ToolBus : public Bus {
   public:
    ToolBus(InprocHub* hub, VirtualTime* time, int deaf)
        : hub_(*hub), time_(*time), bus_(hub->Connect()), deaf_(deaf) {}
    void Publish(const std::string& channel, const uint8_t* data, size_t size) override {
      bus_->Publish(channel, data, size);
    }
    void Subscribe(const std::string& channel, Handler handler, const Interest&) override {
      bus_->Subscribe(channel, [this, handler](std::string_view c, const uint8_t* d, size_t n) {
        if (--deaf_ < 0) handler(c, d, n);
      });
    }
    void SubscribePrefix(const std::string& prefix, Handler handler) override {
      bus_->SubscribePrefix(prefix, std::move(handler));
    }
    void Unsubscribe(const std::string& channel) override { bus_->Unsubscribe(channel); }
    int HandleFor(int64_t timeout_us) override {
      time_.AdvanceTo(time_.NowUs() + timeout_us);
      return hub_.HandleAll();
    }

   private:
    InprocHub& hub_;
    VirtualTime& time_;
    std::unique_ptr<Bus> bus_;
    int deaf_;  ///< Messages that it does not hear.
  };

  InprocHub hub_;
  VirtualTime time_;
  Ledger ledger_;
  std::unique_ptr<Bus> sim_bus_;
  SealedBus sealed_;
  std::vector<std::string> done_;
  ControlService service_;
};

TEST_F(ControlServiceTest, ACommandIsDoneOnceAndAnswered) {
  ToolBus tool(&hub_, &time_, 0);
  const auto answer = GiveCommand(&tool, time_, kTool, KeyOf(1), "pause", 1'000'000, nullptr);
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->tick, 7);
  EXPECT_EQ(done_, std::vector<std::string>{"pause"});
}

TEST_F(ControlServiceTest, AnAnswerThatGotLostIsRepeatedAndNothingIsDoneTwice) {
  // Of what the tool hears, the first messages are its own command and the first answer.
  ToolBus tool(&hub_, &time_, 2);
  const auto answer = GiveCommand(&tool, time_, kTool, KeyOf(1), "pause", 5'000'000, nullptr);
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_EQ(done_.size(), 1u);
}

TEST_F(ControlServiceTest, OvertakenCommandsAreAnsweredAndPushNoAnswerOut) {
  const auto endpoint = hub_.Connect();
  SealedBus tool(endpoint.get(), KeyOf(1));
  Ledger ledger;
  Outbox outbox(&tool, kTool, &ledger);
  const std::string channel = Channel("walk", "", Topic::kControl);
  std::vector<std::string> answers;
  tool.Subscribe(channel, [&](std::string_view, const uint8_t* data, size_t size) {
    morphbus::control_t heard;
    if (Decode(data, size, {}, &heard) && IsAnswer(heard.command)) answers.push_back(heard.command);
  });
  const auto give = [&](int64_t counter) {
    morphbus::control_t message = MessageOf(counter, "pause");
    outbox.Send(channel, 0, 0, &message);
    hub_.HandleAll();
  };
  const int64_t now = time_.NowUs();
  give(now);
  ASSERT_EQ(answers.size(), 1u);
  for (int i = 1; i <= 200; ++i) give(now - i);
  EXPECT_EQ(answers.size(), 201u);
  // The answer to the command that was obeyed is still kept.
  give(now);
  ASSERT_EQ(answers.size(), 202u);
  EXPECT_EQ(answers.back(), answers.front());
  EXPECT_EQ(done_.size(), 1u);
}

TEST_F(ControlServiceTest, WhoeverHasNoKeyIsNotAnswered) {
  ToolBus tool(&hub_, &time_, 0);
  const auto answer = GiveCommand(&tool, time_, kTool, KeyOf(2), "stop", 10'000, nullptr);
  EXPECT_FALSE(answer);
  EXPECT_TRUE(done_.empty());
  EXPECT_GE(sealed_.unauthentic().all, 1);
  EXPECT_EQ(ledger_.received, 0) << "it goes no further";
}

TEST_F(ControlServiceTest, WhatCannotBeReadIsRefusedWithTheReason) {
  ToolBus tool(&hub_, &time_, 0);
  const auto answer = GiveCommand(&tool, time_, kTool, KeyOf(1), "puase", 1'000'000, nullptr);
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->state, ControlAnswer::State::kRefused);
  EXPECT_EQ(answer->status, 2);
  EXPECT_EQ(answer->reason, "no command 'puase' (did you mean 'pause'?)");
  EXPECT_EQ(ledger_.malformed_commands, 1);
  // Neither is a message that is none, by whoever has the key.
  const std::vector<uint8_t> bytes(40);
  SealedBus(&tool, KeyOf(1))
      .Publish(Channel("walk", "", Topic::kControl), bytes.data(), bytes.size());
  hub_.HandleAll();
  EXPECT_EQ(ledger_.malformed_commands, 2);
  EXPECT_TRUE(done_.empty());
}

TEST_F(ControlServiceTest, ForgedAnswersAreNotBelieved) {
  ToolBus tool(&hub_, &time_, 0);
  const auto forger = hub_.Connect();
  SealedBus forged(forger.get(), KeyOf(3));
  Ledger ledger;
  Outbox outbox(&forged, kSim, &ledger);
  const std::string channel = Channel("walk", "", Topic::kControl);
  forger->Subscribe(channel, [&](std::string_view, const uint8_t* data, size_t size) {
    morphbus::control_t heard;
    if (!Decode(data, size, {}, &heard) || IsAnswer(heard.command)) return;
    // With a key of its own the forger claims to have done everything.
    morphbus::control_t lie = MessageOf(
        heard.counter + 1, AnswerText({heard.counter, ControlAnswer::State::kDone, 99, 0, ""}));
    outbox.Send(channel, 0, 0, &lie);
  });
  const auto answer = GiveCommand(&tool, time_, kTool, KeyOf(1), "pause", 1'000'000, nullptr);
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->tick, 7);
  EXPECT_EQ(sealed_.unauthentic().all, 1);
}

}  // namespace
}  // namespace morphbus::bridge
