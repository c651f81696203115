// A forger without the run's key races each kind of message a hundred times: it puts an altered
// copy with a right CRC on the bus before the original, with it or after it. No run is harmed.
// Witnesses that take no part in the product's own comparison say so: the robot, the programs and
// the log, against an undisturbed run.

#include <gtest/gtest.h>

#include <map>
#include <morphbus/info_part_t.hpp>
#include <morphbus/sim_clock_t.hpp>

#include "bridge/wire/channels.h"
#include "test/bridge/forger.h"

namespace morphbus::bridge {
namespace {

/// What the forger copies.
struct Race {
  const char* name;
  Topic topic;
  int phase = -1;  ///< Of CLOCK; -1: any.
  /// Nobody says such a thing in the run: the forger makes it up.
  bool made_up = false;
};

std::ostream& operator<<(std::ostream& out, const Race& race) { return out << race.name; }

constexpr int kRaces = 100;

/// Whether a message is one that the race is about.
bool IsOf(const Race& race, const Spoken& message) {
  if (race.made_up) return ParseChannel(message.channel)->topic == Topic::kActuator;
  if (ParseChannel(message.channel)->topic != race.topic) return false;
  if (race.topic == Topic::kClock) {
    morphbus::sim_clock_t clock;
    return Decode(message.bytes.data(), message.bytes.size(), {}, &clock) &&
           (race.phase < 0 || clock.phase == race.phase);
  }
  return true;
}

FakeRunOptions Options() {
  FakeRunOptions options;
  options.ticks = 24;
  return options;
}

/// Everybody tells of its health now and then, and the logger describes the run.
void SpeakOnAllChannels(FakeRun* run) {
  run->sim->OnAfterTick([run](int64_t tick) {
    if (tick % 6 == 0) run->sim->PublishHealth();
    for (size_t i = 0; i < run->modules.size(); ++i) {
      if ((tick + static_cast<int64_t>(i)) % 6 == 1) run->modules[i].participant->PublishHealth();
    }
    if (tick % 6 != 4) return;
    run->log->PublishHealth();
    morphbus::info_part_t info;
    info.part = 0;
    info.num_parts = 2;
    info.size = info.total_bytes = 0;
    run->log->outbox().Send("test/INFO", tick, tick * 20000, &info);
  });
}

/// What an undisturbed run comes to, and what is said in one with another key: nobody has heard
/// beforehand what is said with this one. Worked out once for all races.
struct Reference {
  std::vector<Spoken> said = [] {
    FakeRunOptions options = Options();
    options.key = RunKey(RunKey::Bytes{9});
    return Overhear(options, SpeakOnAllChannels);
  }();
  Outcome outcome = [] {
    FakeRun run(Options());
    SpeakOnAllChannels(&run);
    return OutcomeOf(&run);
  }();
};
const Reference& TrueRun() {
  static const Reference reference;
  return reference;
}

/// Whether everybody came to what an undisturbed run comes to.
bool AllAgree(const Outcome& outcome) {
  const Outcome& true_one = TrueRun().outcome;
  return outcome.published == true_one.published && outcome.recorded == true_one.published &&
         outcome.state == true_one.state && outcome.moves == true_one.moves;
}

class Forged : public testing::TestWithParam<Race> {};

TEST_P(Forged, HarmsNoRun) {
  const std::vector<Spoken>& said = TrueRun().said;
  ASSERT_TRUE(TrueRun().outcome.sim_ok && TrueRun().outcome.log_clean);
  std::vector<size_t> originals;
  for (size_t i = 0; i < said.size(); ++i) {
    if (IsOf(GetParam(), said[i])) originals.push_back(i);
  }
  ASSERT_FALSE(originals.empty());
  for (uint64_t seed = 0; seed < kRaces; ++seed) {
    std::mt19937_64 random(seed * 1000 + static_cast<uint64_t>(GetParam().topic));
    // One message is raced, or many are; each when some other message near it is heard.
    std::map<int64_t, std::vector<Spoken>> at;
    const int races = seed % 3 == 2 ? 12 : 1;
    for (int i = 0; i < races; ++i) {
      const size_t original = originals[random() % originals.size()];
      const int64_t lead = static_cast<int64_t>(random() % 40) - 10;
      const int64_t when = std::max<int64_t>(0, static_cast<int64_t>(original) - lead);
      at[when].push_back(GetParam().made_up ? MadeUp(GetParam().topic, said[original], &random)
                                            : AlteredAnyhow(said[original], &random));
    }
    FakeRun run(Options());
    SpeakOnAllChannels(&run);
    Forger* self = nullptr;
    int spoken = 0;
    Forger forger(&run, [&](int64_t count, const Spoken&) {
      for (const Spoken& message : at[count]) {
        self->Say(message);
        ++spoken;
      }
    });
    self = &forger;
    const Outcome outcome = OutcomeOf(&run);
    EXPECT_TRUE(outcome.sim_ok && outcome.log_clean) << "seed " << seed << ": " << outcome.error;
    EXPECT_TRUE(AllAgree(outcome)) << "seed " << seed;
    EXPECT_LT(outcome.seconds, TrueRun().outcome.seconds + 0.1) << "seed " << seed;
    // The logger hears everything, if only until it is done.
    EXPECT_LE(outcome.refused.unauthentic, int64_t{5} * spoken);
    EXPECT_EQ(run.logged_bad + run.logged_refused, 0) << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Race, Forged,
    testing::Values(Race{"clock", Topic::kClock},
                    Race{"end", Topic::kClock, morphbus::sim_clock_t::PHASE_END},
                    Race{"sensors", Topic::kSensors}, Race{"world", Topic::kWorld},
                    Race{"transform", Topic::kTransform}, Race{"actuator", Topic::kActuator},
                    Race{"status", Topic::kStatus}, Race{"hello", Topic::kHello},
                    Race{"progress", Topic::kProgress}, Race{"totals", Topic::kTotals},
                    Race{"verdict", Topic::kVerdict}, Race{"leave", Topic::kLeave},
                    Race{"health", Topic::kHealth}, Race{"info", Topic::kInfo},
                    Race{"made_up_resend", Topic::kResend, -1, true},
                    Race{"made_up_progress", Topic::kProgress, -1, true},
                    Race{"made_up_totals", Topic::kTotals, -1, true},
                    Race{"made_up_verdict", Topic::kVerdict, -1, true},
                    Race{"made_up_leave", Topic::kLeave, -1, true},
                    Race{"made_up_admit", Topic::kAdmit, -1, true}),
    [](const testing::TestParamInfo<Race>& race) { return std::string(race.param.name); });

}  // namespace
}  // namespace morphbus::bridge
