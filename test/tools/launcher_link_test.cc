#include "tools/launch/launcher_link.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <optional>
#include <string>

namespace morphbus::tools {
namespace {

/// Waits for something to read, then reads it.
std::vector<nlohmann::ordered_json> Await(LauncherLink* link) {
  pollfd fd = {link->fd(), POLLIN, 0};
  poll(&fd, 1, -1);
  return link->Receive();
}

TEST(LauncherLinkTest, MessagesArriveWholeAndInOrder) {
  Result<std::pair<LauncherLink, int>> ends = LauncherLink::Create();
  ASSERT_TRUE(ends.has_value());
  LauncherLink other(ends->second);
  other.Deliver({{"tick", 1}});
  other.Deliver({{"text", "two\nlines"}});
  const auto messages = Await(&ends->first);
  ASSERT_EQ(messages.size(), 2u);
  EXPECT_EQ(messages[0]["tick"], 1);
  EXPECT_EQ(messages[1]["text"], "two\nlines");
}

TEST(LauncherLinkTest, TheEndOfTheOtherSideIsSeen) {
  Result<std::pair<LauncherLink, int>> ends = LauncherLink::Create();
  std::optional<LauncherLink> other(std::in_place, ends->second);
  EXPECT_EQ(StopReason(&ends->first), "");
  other.reset();
  EXPECT_EQ(StopReason(&ends->first), "the launcher is gone");
}

TEST(LauncherLinkTest, AStopGivesItsReason) {
  Result<std::pair<LauncherLink, int>> ends = LauncherLink::Create();
  LauncherLink other(ends->second);
  ends->first.Deliver({{"stop", "module m3 exited with status 1"}});
  EXPECT_EQ(StopReason(&other), "module m3 exited with status 1");
}

TEST(LauncherLinkTest, AFullSocketNeverBlocksProgress) {
  Result<std::pair<LauncherLink, int>> ends = LauncherLink::Create();
  LauncherLink other(ends->second);
  for (int i = 0; i < 100000; ++i) other.Send({{"tick", i}});
  int64_t last = -1;
  for (const auto& message : Await(&ends->first)) {
    EXPECT_EQ(message["tick"].get<int64_t>(), last + 1);  // a prefix, no half lines
    last = message["tick"];
  }
  EXPECT_GT(last, 10);
}

TEST(LauncherLinkTest, APeerThatNeverReadsIsGivenUp) {
  Result<std::pair<LauncherLink, int>> ends = LauncherLink::Create();
  LauncherLink other(ends->second);
  other.Deliver({{"text", std::string(10'000'000, 'x')}}, 0.01);
  EXPECT_TRUE(ends->first.Receive().empty());
}

TEST(LauncherLinkTest, ALinkToNobodySaysNothing) {
  LauncherLink none(-1);
  none.Deliver({{"tick", 1}});
  EXPECT_EQ(StopReason(&none), "");
}

}  // namespace
}  // namespace morphbus::tools
