#include "logger/log/event_log.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <lcm/lcm-cpp.hpp>
#include <random>

namespace morphbus::logger {
namespace {

struct Event {
  int64_t timestamp_us = 0;
  std::string channel;
  std::vector<uint8_t> data;
  bool operator==(const Event&) const = default;
};

std::string TempPath(const std::string& name) {
  const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
  return ::testing::TempDir() + "event_log_" + test->name() + "_" + std::to_string(getpid()) + "_" +
         name;
}

std::vector<Event> SomeEvents(int count, bool equal_sizes = false) {
  std::mt19937 random(7);
  std::vector<Event> events;
  for (int i = 0; i < count; ++i) {
    Event event;
    event.timestamp_us = 1'700'000'000'000'000 + 1000 * i;
    event.channel = equal_sizes ? "R/m1/STATUS" : "R/m" + std::to_string(i * 7 % 12) + "/STATUS";
    event.data.resize(equal_sizes ? 25 : random() % 90);
    for (uint8_t& byte : event.data) byte = static_cast<uint8_t>(random());
    events.push_back(event);
  }
  return events;
}

std::vector<uint8_t> Encode(const std::vector<Event>& events) {
  std::vector<uint8_t> bytes;
  for (size_t i = 0; i < events.size(); ++i) {
    AppendEvent(static_cast<int64_t>(i), events[i].timestamp_us, events[i].channel, events[i].data,
                &bytes);
  }
  return bytes;
}

void WriteFile(const std::string& path, std::span<const uint8_t> bytes) {
  std::remove(path.c_str());  // Rewriting in place makes some file systems wait for the disk.
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

std::vector<uint8_t> ReadFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

struct ReadBack {
  std::vector<Event> events;
  std::vector<LogFinding> findings;
  bool damaged = false;
};

ReadBack Read(const std::string& path) {
  ReadBack back;
  auto reader = EventLogReader::Open(path);
  EXPECT_TRUE(reader.has_value());
  if (!reader) return back;
  LogEvent event;
  while ((*reader)->Next(&event)) {
    back.events.push_back(
        {event.timestamp_us, std::string(event.channel), {event.data.begin(), event.data.end()}});
  }
  back.findings = (*reader)->findings();
  back.damaged = (*reader)->damaged();
  return back;
}

/// Events of `expected` that are not, in order, among `got`.
size_t Lost(const std::vector<Event>& expected, const std::vector<Event>& got) {
  size_t lost = 0;
  size_t at = 0;
  for (const Event& event : expected) {
    size_t found = at;
    while (found < got.size() && !(got[found] == event)) ++found;
    if (found == got.size()) {
      ++lost;
    } else {
      at = found + 1;
    }
  }
  return lost;
}

class EventLogTest : public ::testing::Test {
 protected:
  std::string path_ = TempPath("log");
  void TearDown() override {
    std::remove(path_.c_str());
    std::remove((path_ + ".partial").c_str());
  }
};

TEST_F(EventLogTest, HeaderIsTwentyEightBigEndianBytes) {
  std::vector<uint8_t> bytes;
  const std::vector<uint8_t> data = {0xAA, 0xBB};
  AppendEvent(0x0102030405060708, 0x1112131415161718, "CHAN", data, &bytes);
  const std::vector<uint8_t> expected = {
      0xED, 0xA1, 0xDA, 0x01, 1, 2, 3, 4, 5, 6, 7, 8,   0x11, 0x12, 0x13, 0x14, 0x15,
      0x16, 0x17, 0x18, 0,    0, 0, 4, 0, 0, 0, 2, 'C', 'H',  'A',  'N',  0xAA, 0xBB};
  EXPECT_EQ(bytes, expected);
}

TEST_F(EventLogTest, StockReaderReadsWhatWeWrite) {
  const std::vector<Event> events = SomeEvents(500);
  auto writer = EventLogWriter::Create(path_);
  ASSERT_TRUE(writer.has_value());
  for (const Event& e : events) {
    ASSERT_TRUE((*writer)->Write(e.timestamp_us, e.channel, e.data).has_value());
  }
  ASSERT_TRUE((*writer)->Close().has_value());
  lcm::LogFile stock(path_, "r");
  ASSERT_TRUE(stock.good());
  for (size_t i = 0; i < events.size(); ++i) {
    const lcm::LogEvent* event = stock.readNextEvent();
    ASSERT_NE(event, nullptr) << i;
    EXPECT_EQ(event->eventnum, static_cast<int64_t>(i));
    EXPECT_EQ(event->timestamp, events[i].timestamp_us);
    EXPECT_EQ(event->channel, events[i].channel);
    const auto* data = static_cast<const uint8_t*>(event->data);
    EXPECT_EQ(std::vector<uint8_t>(data, data + event->datalen), events[i].data);
  }
  EXPECT_EQ(stock.readNextEvent(), nullptr);
}

TEST_F(EventLogTest, WeReadWhatTheStockWriterWritesAndWriteTheSameBytes) {
  const std::vector<Event> events = SomeEvents(200);
  {
    lcm::LogFile stock(path_, "w");
    for (const Event& e : events) {
      std::vector<uint8_t> data = e.data;
      lcm::LogEvent event{};
      event.timestamp = e.timestamp_us;
      event.channel = e.channel;
      event.datalen = static_cast<int32_t>(data.size());
      event.data = data.data();
      stock.writeEvent(&event);
    }
  }
  const ReadBack back = Read(path_);
  EXPECT_EQ(back.events, events);
  EXPECT_TRUE(back.findings.empty());
  EXPECT_EQ(ReadFile(path_), Encode(events));
}

TEST_F(EventLogTest, UnfinishedLogIsReadableUnderItsPartialName) {
  const std::vector<Event> events = SomeEvents(3);
  {
    auto writer = EventLogWriter::Create(path_);
    ASSERT_TRUE(writer.has_value());
    for (const Event& e : events) {
      ASSERT_TRUE((*writer)->Write(e.timestamp_us, e.channel, e.data).has_value());
    }
  }
  EXPECT_FALSE(std::filesystem::exists(path_));
  EXPECT_EQ(Read(path_ + ".partial").events, events);
}

TEST_F(EventLogTest, SecondWriterOfTheSameLogIsRefused) {
  auto first = EventLogWriter::Create(path_);
  ASSERT_TRUE(first.has_value());
  auto second = EventLogWriter::Create(path_);
  ASSERT_FALSE(second.has_value());
  EXPECT_NE(second.error().message.find("another process"), std::string::npos);
}

TEST_F(EventLogTest, APipeOrFolderIsNotReplaced) {
  const std::string pipe = path_ + ".pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& path : {pipe, std::filesystem::temp_directory_path().string()}) {
    const auto writer = EventLogWriter::Create(path);
    ASSERT_FALSE(writer.has_value());
    EXPECT_NE(writer.error().message.find("no regular file"), std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(path + ".partial"));
  }
  std::filesystem::remove(pipe);
}

TEST_F(EventLogTest, UnwritableDiskIsAnErrorNotACrash) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP();
  std::filesystem::create_symlink("/dev/full", path_ + ".partial");
  auto writer = EventLogWriter::Create(path_);
  if (!writer) return;  // Refusing to truncate a device is as good.
  ASSERT_TRUE((*writer)->Write(1, "A", std::vector<uint8_t>(10)).has_value());
  EXPECT_FALSE((*writer)->Close().has_value());
}

TEST_F(EventLogTest, EmptyFileIsALogWithoutEvents) {
  WriteFile(path_, {});
  const ReadBack back = Read(path_);
  EXPECT_TRUE(back.events.empty());
  EXPECT_FALSE(back.damaged);
}

TEST_F(EventLogTest, TruncationAnywhereKeepsEveryWholeEventAndSaysWhereItWasCut) {
  const std::vector<Event> events = SomeEvents(12);
  const std::vector<uint8_t> bytes = Encode(events);
  std::vector<size_t> ends = {0};
  for (const Event& e : events) {
    ends.push_back(ends.back() + kEventHeaderBytes + e.channel.size() + e.data.size());
  }
  for (size_t size = 0; size <= bytes.size(); ++size) {
    WriteFile(path_, std::span(bytes).first(size));
    const size_t whole =
        static_cast<size_t>(std::upper_bound(ends.begin(), ends.end(), size) - ends.begin() - 1);
    const ReadBack back = Read(path_);
    ASSERT_EQ(back.events,
              std::vector<Event>(events.begin(), events.begin() + static_cast<long>(whole)))
        << size;
    if (size == ends[whole]) {
      EXPECT_FALSE(back.damaged) << size;
      continue;
    }
    ASSERT_EQ(back.findings.size(), 1u) << size;
    EXPECT_EQ(back.findings[0].kind, LogFinding::Kind::kTruncated) << size;
    EXPECT_EQ(back.findings[0].begin, ends[whole]);
    EXPECT_EQ(back.findings[0].end, size);
  }
}

/// Flips every bit of the framing of every event, and checks what is lost and reported.
void FlipEveryHeaderBit(const std::vector<Event>& events, const std::string& path) {
  const std::vector<uint8_t> bytes = Encode(events);
  size_t begin = 0;
  for (const Event& e : events) {
    const size_t framing = kEventHeaderBytes;
    for (size_t bit = 0; bit < 8 * framing; ++bit) {
      std::vector<uint8_t> flipped = bytes;
      flipped[begin + bit / 8] ^= static_cast<uint8_t>(1u << (bit % 8));
      WriteFile(path, flipped);
      const ReadBack back = Read(path);
      const bool is_timestamp = bit / 8 >= 12 && bit / 8 < 20;
      const bool is_number = bit / 8 >= 4 && bit / 8 < 12;
      ASSERT_LE(Lost(events, back.events), 1u) << "byte " << begin + bit / 8 << " bit " << bit % 8;
      if (is_number) {
        ASSERT_EQ(back.events, events);
      }
      if (is_timestamp) {
        ASSERT_EQ(back.events.size(), events.size());
      } else if (back.events != events || !is_number) {
        ASSERT_TRUE(back.damaged) << "byte " << begin + bit / 8 << " bit " << bit % 8;
      }
    }
    begin += kEventHeaderBytes + e.channel.size() + e.data.size();
  }
}

TEST_F(EventLogTest, OneFlippedHeaderBitCostsAtMostOneEventAndIsReported) {
  FlipEveryHeaderBit(SomeEvents(7), path_);
}

TEST_F(EventLogTest, FlippedLengthThatEndsAtALaterMagicIsStillFound) {
  // 28 + 11 + 25 = 64 bytes an event: flipping a bit of the length swallows whole events.
  FlipEveryHeaderBit(SomeEvents(9, true), path_);
}

TEST_F(EventLogTest, FlippedNumberIsReportedAsSuch) {
  std::vector<uint8_t> bytes = Encode(SomeEvents(5, true));
  bytes[2 * 64 + 11] ^= 0x40;
  WriteFile(path_, bytes);
  const ReadBack back = Read(path_);
  EXPECT_EQ(back.events.size(), 5u);
  ASSERT_EQ(back.findings.size(), 1u);
  EXPECT_EQ(back.findings[0].kind, LogFinding::Kind::kNumber);
  EXPECT_EQ(back.findings[0].begin, 128u);
}

TEST_F(EventLogTest, OneWrongByteNeverCostsTheGoodEventBeforeIt) {
  // LCM's own reader throws away the event before a bad magic and ends there.
  const std::vector<Event> events = SomeEvents(6, true);
  std::vector<uint8_t> bytes = Encode(events);
  bytes[3 * 64] = 0;
  WriteFile(path_, bytes);
  const ReadBack back = Read(path_);
  ASSERT_EQ(back.events.size(), 5u);
  EXPECT_EQ(back.events[2], events[2]);
  EXPECT_EQ(back.events[3], events[4]);
  ASSERT_EQ(back.findings.size(), 1u);
  EXPECT_EQ(back.findings[0].begin, 192u);
  EXPECT_EQ(back.findings[0].end, 256u);
}

TEST_F(EventLogTest, MagicInsideAPayloadFoolsNobody) {
  std::vector<Event> events = SomeEvents(4);
  events[1].data = Encode(SomeEvents(5));
  WriteFile(path_, Encode(events));
  const ReadBack back = Read(path_);
  EXPECT_EQ(back.events, events);
  EXPECT_FALSE(back.damaged);
}

TEST_F(EventLogTest, ConcatenatedLogsAreOneLogWithARestart) {
  const std::vector<Event> events = SomeEvents(4);
  std::vector<uint8_t> bytes = Encode(events);
  const size_t half = bytes.size();
  bytes.insert(bytes.end(), bytes.begin(), bytes.begin() + static_cast<long>(half));
  WriteFile(path_, bytes);
  const ReadBack back = Read(path_);
  EXPECT_EQ(back.events.size(), 8u);
  EXPECT_FALSE(back.damaged);
  ASSERT_EQ(back.findings.size(), 1u);
  EXPECT_EQ(back.findings[0].kind, LogFinding::Kind::kRestart);
  EXPECT_EQ(back.findings[0].begin, half);
}

TEST_F(EventLogTest, EventsTakenOutAreNoticed) {
  const std::vector<Event> events = SomeEvents(6, true);
  std::vector<uint8_t> bytes = Encode(events);
  bytes.erase(bytes.begin() + 128, bytes.begin() + 256);
  WriteFile(path_, bytes);
  const ReadBack back = Read(path_);
  EXPECT_EQ(back.events.size(), 4u);
  ASSERT_EQ(back.findings.size(), 1u);
  EXPECT_EQ(back.findings[0].kind, LogFinding::Kind::kMissing);
}

TEST_F(EventLogTest, ZeroedBlockCostsOnlyTheEventsItTouches) {
  const std::vector<Event> events = SomeEvents(400);
  std::vector<uint8_t> bytes = Encode(events);
  std::fill(bytes.begin() + 4096, bytes.begin() + 8192, uint8_t{0});
  WriteFile(path_, bytes);
  const ReadBack back = Read(path_);
  EXPECT_TRUE(back.damaged);
  size_t touched = 0;
  size_t at = 0;
  for (const Event& e : events) {
    const size_t end = at + kEventHeaderBytes + e.channel.size() + e.data.size();
    if (end > 4096 && at < 8192) ++touched;
    at = end;
  }
  EXPECT_LE(Lost(events, back.events), touched);
}

TEST_F(EventLogTest, RandomBytesAreAllDamage) {
  std::mt19937 random(3);
  std::vector<uint8_t> bytes(100'000);
  for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random());
  WriteFile(path_, bytes);
  const ReadBack back = Read(path_);
  EXPECT_TRUE(back.events.empty());
  ASSERT_EQ(back.findings.size(), 1u);
  EXPECT_EQ(back.findings[0].begin, 0u);
  EXPECT_EQ(back.findings[0].end, bytes.size());
}

TEST_F(EventLogTest, HeadersThatClaimMoreThanTheFileHoldsCostNoMemory) {
  std::vector<uint8_t> bytes;
  for (int i = 0; i < 2000; ++i) {
    const size_t begin = bytes.size();
    AppendEvent(i, 0, "A", {}, &bytes);
    bytes[begin + 24] = 0x0F;  // 240 MiB and more.
  }
  WriteFile(path_, bytes);
  const ReadBack back = Read(path_);
  EXPECT_TRUE(back.events.empty());
  EXPECT_TRUE(back.damaged);
}

TEST_F(EventLogTest, ManyWrongNumbersStayLinear) {
  // Every event needs a second look here; it must stay a look at the event itself.
  std::vector<uint8_t> bytes;
  for (int i = 0; i < 200'000; ++i) AppendEvent(5, 0, "A", std::vector<uint8_t>(8), &bytes);
  WriteFile(path_, bytes);
  const ReadBack back = Read(path_);
  EXPECT_EQ(back.events.size(), 200'000u);
  EXPECT_EQ(back.findings.size(), 1000u);
}

TEST_F(EventLogTest, ExtremeNumbersAndTimesDoNotOverflow) {
  std::vector<uint8_t> bytes;
  for (const int64_t n : {INT64_MAX, INT64_MIN, int64_t{-1}, int64_t{0}, INT64_MAX}) {
    AppendEvent(n, n, "A", {}, &bytes);
  }
  WriteFile(path_, bytes);
  EXPECT_EQ(Read(path_).events.size(), 5u);
}

TEST_F(EventLogTest, SeekReturnsToAnEventSeenBefore) {
  const std::vector<Event> events = SomeEvents(50);
  WriteFile(path_, Encode(events));
  auto reader = EventLogReader::Open(path_);
  ASSERT_TRUE(reader.has_value());
  LogEvent event;
  uint64_t offset = 0;
  for (int i = 0; i < 20; ++i) ASSERT_TRUE((*reader)->Next(&event));
  offset = event.offset;
  while ((*reader)->Next(&event)) {
  }
  (*reader)->Seek(offset);
  ASSERT_TRUE((*reader)->Next(&event));
  EXPECT_EQ(event.number, 19);
  EXPECT_EQ((*reader)->num_findings(), 0);
}

TEST_F(EventLogTest, EventsLargerThanTheBufferAreRead) {
  std::vector<Event> events = SomeEvents(3);
  events[1].data.assign(3'000'000, 0x5A);
  WriteFile(path_, Encode(events));
  EXPECT_EQ(Read(path_).events, events);
}

TEST_F(EventLogTest, APipeIsRefusedAtOnceWhetherReadOrWritten) {
  // Opened as a file it would wait for the other end for ever.
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  const auto reader = EventLogReader::Open(path_);
  ASSERT_FALSE(reader.has_value());
  EXPECT_NE(reader.error().message.find("not a regular file"), std::string::npos);
  EXPECT_FALSE(EventLogWriter::Create(path_).has_value());
  std::remove(path_.c_str());
  ASSERT_EQ(mkfifo((path_ + ".partial").c_str(), 0600), 0);
  EXPECT_FALSE(EventLogWriter::Create(path_).has_value());
  std::remove((path_ + ".partial").c_str());
}

/// What flushing says after somebody did something to the file.
std::string FlushAfter(const std::string& path,
                       const std::function<void(const std::string&)>& act) {
  auto writer = EventLogWriter::Create(path);
  EXPECT_TRUE(writer.has_value());
  const std::vector<uint8_t> data(100, 1);
  EXPECT_TRUE((*writer)->Write(1, "A", data));
  EXPECT_TRUE((*writer)->Flush());
  act((*writer)->partial_path());
  EXPECT_TRUE((*writer)->Write(2, "A", data));
  const Result<void> flushed = (*writer)->Flush();
  EXPECT_EQ(flushed.has_value(), (*writer)->Close().has_value());
  std::remove(path.c_str());
  std::remove((path + ".partial").c_str());
  return flushed ? "" : flushed.error().message;
}

TEST_F(EventLogTest, AWriterNoticesThatItsFileWasRemovedReplacedOrCut) {
  const auto said = [&](const std::function<void(const std::string&)>& act) {
    return FlushAfter(path_, act);
  };
  EXPECT_EQ(said([](const std::string&) {}), "");
  const std::string name = path_ + ".partial";
  EXPECT_EQ(said([](const std::string& file) { std::remove(file.c_str()); }),
            name + " was removed while it was written");
  EXPECT_EQ(said([](const std::string& file) { WriteFile(file, {}); }),
            name + " was replaced while it was written");
  for (const int size : {0, 50, 1000}) {
    EXPECT_EQ(said([size](const std::string& file) { std::filesystem::resize_file(file, size); }),
              name + " was altered by somebody else while it was written");
  }
}

TEST_F(EventLogTest, ADiscardedLogLeavesNothing) {
  auto writer = EventLogWriter::Create(path_);
  ASSERT_TRUE(writer.has_value());
  (*writer)->Discard();
  EXPECT_FALSE(std::filesystem::exists(path_ + ".partial"));
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(EventLogTest, MissingFileAndDirectoryAreErrorsThatNameThePath) {
  auto missing = EventLogReader::Open(path_);
  ASSERT_FALSE(missing.has_value());
  EXPECT_NE(missing.error().message.find(path_), std::string::npos);
  EXPECT_FALSE(EventLogReader::Open(::testing::TempDir()).has_value());
}

}  // namespace
}  // namespace morphbus::logger
