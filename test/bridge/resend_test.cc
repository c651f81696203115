// How often an outbox sends a message again, and the totals by which a log is checked.

#include <gtest/gtest.h>

#include <morphbus/totals_t.hpp>
#include <morphbus/world_t.hpp>
#include <string>
#include <vector>

#include "bridge/bus/inproc_bus.h"
#include "bridge/lockstep/outbox.h"
#include "bridge/lockstep/run_totals.h"

namespace morphbus::bridge {
namespace {

TEST(Resend, AnswersComeSoonAndNotWithoutEndHoweverOftenTheyAreAskedFor) {
  InprocHub hub;
  const auto bus = hub.Connect(), ears = hub.Connect();
  int heard = 0;
  ears->SubscribePrefix("r/", [&heard](std::string_view, const uint8_t*, size_t) { ++heard; });
  Ledger ledger;
  Outbox outbox(bus.get(), {"r", "m1", 1, 1}, &ledger);
  morphbus::world_t world;
  world.part = 0;
  world.num_parts = 1;
  world.num_bodies = world.num_contacts = 0;
  for (int64_t tick = 0; tick < 40; ++tick) outbox.Send("r/SIM/WORLD", tick, tick, &world);
  hub.HandleAll();
  heard = 0;
  for (int64_t us = 0; us < 10'000; us += 10) {
    outbox.Resend("r/SIM/WORLD", 0, int64_t{1} << 62, 1'000'000 + us);
    hub.HandleAll();
  }
  EXPECT_EQ(heard, 16 * (16 + 5)) << "of each that is kept sixteen within 1.6 ms, then one in 2 ms";
  EXPECT_EQ(ledger.resent, heard);
}

TEST(RunTotals, SayNothingWhereAllAgreeAndNameTheFirstChannelThatDiffers) {
  std::vector<ChannelTotal> published = {{"r/SIM/SENSORS", 4, 40, true},
                                         {"r/m1/TRANSFORM", 3, 30, true},
                                         {"r/m2/STATUS", 0, 7, true},
                                         {"r/m2/HEALTH", 9, 9, false}};
  std::vector<ChannelTotal> recorded;
  for (const ChannelTotal& total : published) {
    if (total.hashed && total.count > 0) recorded.push_back(total);
  }
  EXPECT_EQ(WhereTheLogDiffers(published, recorded), "");
  // What nobody published is a difference, too, but where nobody can know any more.
  recorded.push_back({"r/m9/STATUS", 2, 5, true});
  EXPECT_EQ(WhereTheLogDiffers(published, recorded),
            "LOG recorded other messages on m9/STATUS than m9 published (2 of 0)");
  EXPECT_EQ(WhereTheLogDiffers(published, recorded, {"m9"}), "");
  recorded.pop_back();
  published[1].chained_hash = 31;
  EXPECT_EQ(WhereTheLogDiffers(published, recorded),
            "LOG recorded other messages on m1/TRANSFORM than m1 published (3 of 3)");
  published[0].count = 5;
  EXPECT_EQ(WhereTheLogDiffers(published, recorded),
            "LOG recorded other messages on SIM/SENSORS than SIM published (4 of 5), and 1 more "
            "such differences");
}

/// The longest name that a process can have.
const std::string kProcess(28, 'm');

TEST(RunTotals, OfManyChannelsComeInPartsThatFitTheirDatagrams) {
  std::vector<ChannelTotal> totals;
  for (int i = 0; i < 300; ++i) {
    totals.push_back({std::string(40, 'c') + std::to_string(i), i, i, true});
  }
  const std::vector<morphbus::totals_t> parts = SplitTotals(kProcess, 7, totals);
  ASSERT_GT(parts.size(), 10u);
  TotalsParts together;
  for (size_t i = parts.size(); i-- > 0;) {
    std::vector<uint8_t> bytes;
    Encode(parts[i], &bytes);
    EXPECT_LE(bytes.size(), kMaxPayloadBytes);
    EXPECT_EQ(together.Take(parts[i]), i == 0) << "in any order, and complete with the last one";
    EXPECT_FALSE(together.Take(parts[i])) << "once more";
  }
  EXPECT_EQ(together.totals().size(), 300u);
  EXPECT_EQ(WhereTheLogDiffers(totals, together.totals()), "");
  // A later report begins anew, but what is whole stays until all of that is there.
  std::vector<ChannelTotal> more = totals;
  for (const int64_t tick : {7, 9}) {
    more[0].count += 5;
    const std::vector<morphbus::totals_t> later = SplitTotals(kProcess, tick, more);
    for (size_t i = 1; i < later.size(); ++i) {
      EXPECT_FALSE(together.Take(later[i]));
      EXPECT_TRUE(together.complete());
      EXPECT_NE(WhereTheLogDiffers(more, together.totals()), "");
    }
    EXPECT_TRUE(together.Take(later[0]));
    EXPECT_EQ(WhereTheLogDiffers(more, together.totals()), "") << "of one report, and all of it";
  }
  // An earlier tick says nothing any more.
  EXPECT_TRUE(together.Take(SplitTotals(kProcess, 10, {}).front()));
  EXPECT_TRUE(together.totals().empty());
  EXPECT_FALSE(together.Take(parts[0]));
}

TEST(RunTotals, OfNoChannelAreOnePart) {
  const std::vector<morphbus::totals_t> parts = SplitTotals(kProcess, 7, {});
  ASSERT_EQ(parts.size(), 1u);
  TotalsParts together;
  EXPECT_FALSE(together.complete());
  EXPECT_TRUE(together.Take(parts[0]));
  EXPECT_TRUE(together.complete());
}

}  // namespace
}  // namespace morphbus::bridge
