#include "logger/log/repair.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <nlohmann/json.hpp>

#include "logger/log/run_log.h"
#include "test/logger/temp_log.h"

namespace morphbus::logger {
namespace {

using test::SyntheticEvent;

std::vector<SyntheticEvent> ShortRun() {
  test::SyntheticOptions options;
  options.ticks = 5;
  return test::SyntheticEvents(options);
}

std::vector<char> BytesOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST(RepairTest, ARepairedLogIsSoundForTheStockReader) {
  const std::vector<SyntheticEvent> events = ShortRun();
  std::vector<uint8_t> bytes = test::EncodeLog(events);
  bytes[0] = 0;  // The first event loses its magic, the last one its end.
  bytes.erase(bytes.end() - 3, bytes.end());
  const TempLog in(bytes);
  const TempFile out;
  const auto report = RepairLog(in.path(), out.path());
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_EQ(report->events_kept, static_cast<int64_t>(events.size()) - 2);
  EXPECT_EQ(report->bytes_dropped, bytes.size() - std::filesystem::file_size(out.path()));
  EXPECT_EQ(report->findings.size(), 2u);
  lcm::LogFile stock(out.path(), "r");
  for (int64_t i = 0; i < report->events_kept; ++i) {
    const lcm::LogEvent* event = stock.readNextEvent();
    ASSERT_NE(event, nullptr);
    EXPECT_EQ(event->eventnum, i);
  }
  EXPECT_EQ(stock.readNextEvent(), nullptr);
}

TEST(RepairTest, AMessageThatDoesNotFitItsCrcIsDroppedAndListed) {
  std::vector<SyntheticEvent> events = ShortRun();
  events[10].payload.back() ^= 1;
  events.insert(events.begin() + 20,
                {events[20].timestamp_us, "FOREIGN", {1, 2, 3}});  // of which nothing is known
  const TempLog in(test::EncodeLog(events));
  const TempFile out;
  const auto report = RepairLog(in.path(), out.path());
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_EQ(report->events_kept, static_cast<int64_t>(events.size()) - 1);
  EXPECT_EQ(report->num_findings, 1);
  ASSERT_EQ(report->findings.size(), 1u);
  EXPECT_EQ(FindingJson(report->findings[0])["kind"], "payload");
  EXPECT_NE(report->findings[0].what.find("on " + events[10].channel), std::string::npos);
  EXPECT_EQ(report->bytes_dropped, report->findings[0].end - report->findings[0].begin);
  // It invents nothing: what was dropped is missing.
  const Result<RunLog> log = LoadRunLog(out.path());
  ASSERT_TRUE(log.has_value());
  EXPECT_EQ(log->facts.channels.at(events[10].channel).bad, 0);
  EXPECT_EQ(log->facts.lost(), 1);
}

TEST(RepairTest, TheLogThatIsReadIsNeverWrittenOver) {
  const std::vector<uint8_t> bytes = test::EncodeLog(ShortRun());
  const TempFile file;
  const TempFile copy;
  for (const std::string& in : {file.path(), file.path() + ".partial"}) {
    test::WriteBytes(in, bytes);
    const auto report = RepairLog(in, file.path());
    ASSERT_FALSE(report.has_value());
    EXPECT_NE(report.error().message.find("would overwrite " + in), std::string::npos);
    EXPECT_EQ(RepairLog(in, copy.path())->bytes_dropped, 0u);  // it is still whole
    std::remove(in.c_str());
  }
}

TEST(RepairTest, AFailedRepairLeavesNoPartBehind) {
  std::vector<SyntheticEvent> damaged = ShortRun();
  for (SyntheticEvent& event : damaged) event.payload.back() ^= 1;
  for (const std::vector<uint8_t>& bytes :
       {std::vector<uint8_t>{'n', 'o', ' ', 'l', 'o', 'g'}, test::EncodeLog(damaged)}) {
    const TempLog in(bytes);
    const TempFile out;
    const auto report = RepairLog(in.path(), out.path());
    ASSERT_FALSE(report.has_value());
    EXPECT_NE(report.error().message.find("no sound event"), std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(out.path()));
    EXPECT_FALSE(std::filesystem::exists(out.path() + ".partial"));
    EXPECT_EQ(BytesOf(in.path()).size(), bytes.size());
  }
}

}  // namespace
}  // namespace morphbus::logger
