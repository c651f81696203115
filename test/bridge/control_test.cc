#include <gtest/gtest.h>

#include <limits>
#include <morphbus/control_answer_t.hpp>
#include <morphbus/control_t.hpp>
#include <optional>
#include <vector>

#include "bridge/bus/inproc_bus.h"
#include "bridge/control/control_service.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/sealed_bus.h"

namespace morphbus::bridge {
namespace {

using State = ControlAnswer::State;

constexpr uint64_t kModel = 42;
const Sender kSim = {"walk", "SIM", kModel, 0};
const Sender kTool = {"walk", "TOOL", kModel, 0};
const std::string kControlChannel = "walk/CONTROL", kAnswerChannel = "walk/SIM/ANSWER";

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

/// Commands of every kind, as people write them.
constexpr const char* kCommands[] = {"pause",
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
                                     "lose m3",
                                     "inspect",
                                     "inspect m5",
                                     "connect m1.c2 m2.c5",
                                     "disconnect m2.c3",
                                     "deploy models/x.dyn",
                                     "deploy x.dyn 0123456789abcdef --to m5",
                                     "deploy x.dyn --at 12.5",
                                     "deploy x.dyn fedcba9876543210 --to m5 --at 11.2",
                                     "invoke Leg.turn 3 -0.5 $NORTH true --to m5"};

TEST(ControlCommandTest, TextsAreReadBackAsTheyWere) {
  std::vector<const char*> texts(std::begin(kCommands), std::end(kCommands));
  // As CLOCK names a restart that was done a tick before.
  texts.push_back("restart m2 --cold --from 411");
  for (const char* text : texts) {
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
  EXPECT_EQ(ErrorOf("inspect m5 m6"), "expected: inspect [MODULE]");
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

/// A command as it goes over the bus.
std::vector<uint8_t> BytesOf(const ControlCommand& command, int64_t counter) {
  morphbus::control_t message = MessageOf(command, counter);
  message.header = {};
  message.header.protocol = morphbus::header_t::PROTOCOL;
  std::vector<uint8_t> bytes;
  Encode(message, &bytes);
  return bytes;
}

TEST(ControlMessageTest, CarriesEveryCommandWhole) {
  for (const char* text : kCommands) {
    const std::vector<uint8_t> bytes = BytesOf(*ParseControl(text), 7);
    morphbus::control_t read;
    const Result<void> decoded = Decode(bytes.data(), bytes.size(), {}, &read);
    ASSERT_TRUE(decoded) << text << ": " << decoded.error().message;
    const Result<ControlCommand> command = CommandOf(read);
    ASSERT_TRUE(command) << text << ": " << command.error().message;
    EXPECT_EQ(ControlText(*command), text);
    EXPECT_EQ(read.counter, 7);
  }
}

TEST(ControlMessageTest, AWordOf200BytesFitsWhereverItStands) {
  const std::string word(180, 'w');
  for (const std::string& text :
       {"kill " + word, "push m1." + word + " EAST 1", "connect m1.c1 " + word + ".c",
        "deploy " + word, "deploy x --to " + word, "invoke A." + word, "invoke A.b " + word}) {
    const Result<ControlCommand> command = ParseControl(text);
    ASSERT_TRUE(command) << text;
    const std::vector<uint8_t> bytes = BytesOf(*command, 1);
    EXPECT_TRUE(Check<morphbus::control_t>(bytes.data(), bytes.size(), {})) << text;
  }
  std::string many = "invoke A.b";
  for (int i = 0; i < 63; ++i) many += " 1";
  const std::vector<uint8_t> bytes = BytesOf(*ParseControl(many), 1);
  EXPECT_TRUE(Check<morphbus::control_t>(bytes.data(), bytes.size(), {}));
}

TEST(ControlMessageTest, OnlyTheFieldsOfItsKindMeanSomething) {
  // As a sender might who uses one message for all of its commands.
  morphbus::control_t message = MessageOf(*ParseControl("invoke Leg.turn 3 --to m5"), 1);
  const morphbus::control_t pushed = MessageOf(*ParseControl("push m5.c1 EAST 2"), 1);
  message.module_name = pushed.module_name;
  message.part_name = pushed.part_name;
  message.direction[2] = pushed.direction[2];
  message.force_n = pushed.force_n;
  message.kind = morphbus::control_t::KIND_PAUSE;
  EXPECT_EQ(ControlText(*CommandOf(message)), "pause");
  message.kind = morphbus::control_t::KIND_LOSE;
  EXPECT_EQ(ControlText(*CommandOf(message)), "lose m5");
  message.kind = morphbus::control_t::KIND_PUSH;
  EXPECT_EQ(ControlText(*CommandOf(message)), "push m5.c1 EAST 2");
}

/// Why a message is no command; empty if it is one.
std::string WhyNone(const morphbus::control_t& message) {
  const Result<ControlCommand> command = CommandOf(message);
  return command ? "" : command.error().message;
}

TEST(ControlMessageTest, NumbersOutOfRangeAndWordsThatNoTextHasAreRefused) {
  morphbus::control_t step = MessageOf(*ParseControl("step"), 1);
  step.num_steps = 0;
  EXPECT_EQ(WhyNone(step), "step: expected a number, 1 to 1000000, not 0");
  morphbus::control_t speed = MessageOf(*ParseControl("speed 1"), 1);
  for (const double value : {-1.0, 1e-9, 2e6}) {
    speed.speed = value;
    EXPECT_NE(WhyNone(speed), "") << value;
  }
  const morphbus::control_t push = MessageOf(*ParseControl("push m5 EAST 2"), 1);
  const auto with = [](morphbus::control_t message, auto change) {
    change(&message);
    return WhyNone(message);
  };
  using M = morphbus::control_t*;
  EXPECT_EQ(with(push, [](M m) { m->direction[2] = 0; }), "direction: it has no length");
  EXPECT_NE(with(push, [](M m) { m->direction[2] = 1e7; }), "");
  EXPECT_NE(with(push, [](M m) { m->force_n = 1e5; }), "");
  EXPECT_NE(with(push, [](M m) { m->duration_s = -1; }), "");
  // CLOCK names the command as text, which must say the same.
  EXPECT_EQ(with(push, [](M m) { m->module_name = "m5.c1"; }), "expected MODULE, not 'm5.c1'");
  EXPECT_NE(with(push, [](M m) { m->module_name = ""; }), "");
  EXPECT_NE(with(push, [](M m) { m->part_name = "a b"; }), "");
  EXPECT_NE(with(push, [](M m) { m->part_name = "a\nb"; }), "");
  const morphbus::control_t deploy = MessageOf(*ParseControl("deploy x.dyn 1"), 1);
  EXPECT_NE(with(deploy, [](M m) { m->program_path = "my x.dyn"; }), "");
  EXPECT_NE(with(deploy, [](M m) { m->program_path = "--to"; }), "");
  EXPECT_NE(with(deploy, [](M m) { m->program_path = "x#y"; }), "");
  EXPECT_NE(with(deploy, [](M m) { m->has_time = 1, m->time_s = -1; }), "");
  const morphbus::control_t invoke = MessageOf(*ParseControl("invoke A.b 1"), 1);
  EXPECT_NE(with(invoke, [](M m) { m->role_name = "A.b"; }), "");
  EXPECT_NE(with(invoke, [](M m) { m->routine_name = ""; }), "");
  EXPECT_NE(with(invoke, [](M m) { m->arguments[0] = "--to"; }), "");
  const morphbus::control_t connect = MessageOf(*ParseControl("connect m1.c1 m2.c2"), 1);
  EXPECT_NE(with(connect, [](M m) { m->mate_part_name = ""; }), "");
}

using Kind = CommandFilter::Kind;

TEST(CommandFilterTest, ACommandIsTakenOnceAndNoneAfterALaterOne) {
  Ledger ledger;
  CommandFilter filter(&ledger);
  EXPECT_EQ(filter.Take(100, 0), Kind::kNew);
  EXPECT_EQ(filter.Take(100, 1), Kind::kAgain);
  EXPECT_EQ(filter.Take(95, 0), Kind::kOvertaken);
  EXPECT_EQ(filter.Take(101, 0), Kind::kNew);
  EXPECT_EQ(ledger.old_commands, 2);
}

TEST(CommandFilterTest, WhatIsSaidAgainUnderItsNumberIsNoRequestForAnAnswer) {
  Ledger ledger;
  CommandFilter filter(&ledger);
  EXPECT_EQ(filter.Take(100, 0), Kind::kNew);
  EXPECT_EQ(filter.Take(100, 1), Kind::kAgain);
  EXPECT_EQ(filter.Take(90, 0), Kind::kOvertaken);
  for (const int64_t number : {0, 1, 0}) EXPECT_EQ(filter.Take(100, number), Kind::kRepeat);
  EXPECT_EQ(filter.Take(90, 0), Kind::kRepeat);
  EXPECT_EQ(filter.Take(90, 1), Kind::kOvertaken);
  // What is older than everything that is remembered was answered long ago.
  for (int i = 101; i <= 3000; ++i) filter.Take(i, 0);
  for (int i = 1; i <= 1500; ++i) EXPECT_EQ(filter.Take(i, 7), Kind::kRepeat);
}

TEST(CommandFilterTest, NoneOfAThousandOldCommandsIsTakenAgain) {
  Ledger ledger;
  CommandFilter filter(&ledger);
  for (int i = 1; i <= 3000; ++i) ASSERT_EQ(filter.Take(i, 0), Kind::kNew);
  for (int i = 1; i <= 3000; ++i) ASSERT_NE(filter.Take(i, 0), Kind::kNew);
  EXPECT_EQ(ledger.old_commands, 3000);
}

/// The sim's end with what it was told to do, and a hub on which others are.
class ControlServiceTest : public ::testing::Test {
 protected:
  ControlServiceTest()
      : sim_bus_(hub_.Connect()),
        sealed_(sim_bus_.get(), KeyOf(1)),
        service_(&sealed_, kSim, &ledger_, [this](int64_t counter, const ControlCommand& command) {
          done_.push_back(ControlText(command));
          ControlAnswer answer = reply_.value_or(
              ControlAnswer{0, State::kDone, 7, 0, "", ControlText(command), std::nullopt});
          answer.counter = counter;
          service_.Answer(answer);
        }) {
    // As on a machine that has run for a while.
    time_.AdvanceTo(1'000'000'000);
    tool_.Subscribe(kAnswerChannel, [this](std::string_view, const uint8_t* data, size_t size) {
      if (morphbus::control_answer_t heard; Decode(data, size, {}, &heard)) {
        answers_.push_back(heard);
      }
    });
  }

  /// Gives a command as a tool does.
  Result<ControlAnswer> Give(Bus* tool, const RunKey& key, const char* text) {
    return GiveCommand(tool, time_, kTool, key, *ParseControl(text), 5'000'000, nullptr);
  }
  /// Publishes a message with the run's key; the answers to it, and to all others, are in answers_.
  void Publish(morphbus::control_t message) {
    outbox_.Send(kControlChannel, 0, 0, &message);
    hub_.HandleAll();
  }
  void GiveRaw(int64_t counter) { Publish(MessageOf(*ParseControl("pause"), counter)); }

  /// A tool's bus, whose every wait gives the others their turn and lets time pass.
  class ToolBus : public Bus {
   public:
    ToolBus(InprocHub* hub, VirtualTime* time, int deaf)
        : hub_(*hub), time_(*time), bus_(hub->Connect()), deaf_(deaf) {}
    void Publish(const std::string& channel, const uint8_t* data, size_t size) override {
      bus_->Publish(channel, data, size);
    }
    void Receive(const Channels& channels, Handler handler) override {
      bus_->Receive(channels, [this, handler](std::string_view c, const uint8_t* d, size_t n) {
        if (--deaf_ < 0) handler(c, d, n);
      });
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
  std::optional<ControlAnswer> reply_;  ///< What is answered to everything; its counter is set.
  ControlService service_;
  // Another tool, and the answers that it has heard.
  std::unique_ptr<Bus> tool_bus_ = hub_.Connect();
  SealedBus tool_ = {tool_bus_.get(), KeyOf(1)};
  Ledger tool_ledger_;
  Outbox outbox_ = {&tool_, kTool, &tool_ledger_};
  std::vector<morphbus::control_answer_t> answers_;
};

TEST_F(ControlServiceTest, ACommandIsDoneOnceAndAnswered) {
  ToolBus tool(&hub_, &time_, 0);
  const auto answer = Give(&tool, KeyOf(1), "pause");
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->tick, 7);
  EXPECT_EQ(answer->state, State::kDone);
  EXPECT_EQ(answer->command, "pause");
  EXPECT_FALSE(answer->at);
  EXPECT_EQ(done_, std::vector<std::string>{"pause"});
}

TEST_F(ControlServiceTest, AnAnswerSaysAllThatTheSimSays) {
  ToolBus tool(&hub_, &time_, 0);
  reply_ = {0, State::kRefused, 9, 2, "no\nmodule '" + std::string(300, 'x') + "'", "kill x", 2.5};
  const auto refused = Give(&tool, KeyOf(1), "kill x");
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->state, State::kRefused);
  EXPECT_EQ(refused->status, 2);
  EXPECT_EQ(refused->reason, reply_->reason.substr(0, 200)) << "what a message holds";
  EXPECT_EQ(refused->at, 2.5);
  reply_ = {0, State::kLater, 413, 0, "", "deploy x.dyn 1 --at 9.5", 9.5};
  const auto later = Give(&tool, KeyOf(1), "deploy x.dyn 1");
  ASSERT_TRUE(later);
  EXPECT_EQ(later->state, State::kLater);
  EXPECT_EQ(later->tick, 413);
  EXPECT_EQ(later->command, "deploy x.dyn 1 --at 9.5");
}

TEST_F(ControlServiceTest, AnAnswerThatGotLostIsRepeatedAndNothingIsDoneTwice) {
  ToolBus tool(&hub_, &time_, 1);
  const auto answer = Give(&tool, KeyOf(1), "pause");
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_EQ(done_.size(), 1u);
  EXPECT_EQ(ledger_.old_commands, 1);
}

TEST_F(ControlServiceTest, OvertakenCommandsAreAnsweredAndPushNoAnswerOut) {
  const int64_t now = time_.NowUs();
  GiveRaw(now);
  ASSERT_EQ(answers_.size(), 1u);
  for (int i = 1; i <= 200; ++i) GiveRaw(now - i);
  ASSERT_EQ(answers_.size(), 201u);
  EXPECT_EQ(answers_.back().state, morphbus::control_answer_t::STATE_OVERTAKEN);
  EXPECT_EQ(answers_.back().counter, now - 200);
  // The answer to the command that was obeyed is still kept.
  GiveRaw(now);
  ASSERT_EQ(answers_.size(), 202u);
  EXPECT_EQ(answers_.back().counter, now);
  EXPECT_EQ(answers_.back().state, morphbus::control_answer_t::STATE_DONE);
  EXPECT_EQ(done_.size(), 1u);
  EXPECT_EQ(ledger_.old_commands, 201);
}

TEST_F(ControlServiceTest, WhoIsOvertakenGivesTheCommandAnew) {
  // Another tool's command, whose clock is ahead by less than the time to ask again.
  GiveRaw(time_.NowUs() + 100'000);
  ToolBus tool(&hub_, &time_, 0);
  const auto answer = Give(&tool, KeyOf(1), "resume");
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_EQ(answer->state, State::kDone);
  EXPECT_EQ(done_.back(), "resume");
}

TEST_F(ControlServiceTest, ASenderWithoutTheKeyIsNotAnswered) {
  ToolBus tool(&hub_, &time_, 0);
  const auto answer = Give(&tool, KeyOf(2), "stop");
  EXPECT_FALSE(answer);
  EXPECT_TRUE(done_.empty());
  EXPECT_GE(sealed_.unauthentic().all, 1);
  EXPECT_EQ(ledger_.received, 0) << "it goes no further";
}

TEST_F(ControlServiceTest, WhatIsNoCommandIsRefusedWithTheReason) {
  morphbus::control_t step = MessageOf(*ParseControl("step"), 5);
  step.num_steps = 0;
  Publish(step);
  ASSERT_EQ(answers_.size(), 1u);
  EXPECT_EQ(answers_[0].state, morphbus::control_answer_t::STATE_REFUSED);
  EXPECT_EQ(answers_[0].status, 2);
  EXPECT_EQ(answers_[0].reason, "step: expected a number, 1 to 1000000, not 0");
  EXPECT_EQ(ledger_.malformed_commands, 1);
  // A kind that does not exist, a number that is none, and bytes that are no message are not even
  // answered.
  morphbus::control_t strange = MessageOf(*ParseControl("pause"), 6);
  strange.kind = 15;
  Publish(strange);
  strange = MessageOf(*ParseControl("push m5 EAST 1"), 7);
  strange.force_n = std::numeric_limits<double>::quiet_NaN();
  Publish(strange);
  const std::vector<uint8_t> bytes(40);
  tool_.Publish(kControlChannel, bytes.data(), bytes.size());
  hub_.HandleAll();
  EXPECT_EQ(answers_.size(), 1u);
  EXPECT_EQ(ledger_.malformed_commands, 4);
  EXPECT_TRUE(done_.empty());
}

TEST_F(ControlServiceTest, ForgedAnswersAreNotBelieved) {
  ToolBus tool(&hub_, &time_, 0);
  const auto forger = hub_.Connect();
  SealedBus forged(forger.get(), KeyOf(3));
  Ledger ledger;
  Outbox outbox(&forged, kSim, &ledger);
  forger->Subscribe(kControlChannel, [&](std::string_view, const uint8_t* data, size_t size) {
    morphbus::control_t heard;
    if (!Decode(data, size, {}, &heard)) return;
    // With a key of its own the forger claims to have done everything.
    morphbus::control_answer_t lie = {};
    lie.counter = heard.counter;
    lie.state = morphbus::control_answer_t::STATE_DONE;
    lie.tick = 99;
    outbox.Send(kAnswerChannel, 0, 0, &lie);
  });
  const auto answer = Give(&tool, KeyOf(1), "pause");
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->tick, 7);
}

}  // namespace
}  // namespace morphbus::bridge
