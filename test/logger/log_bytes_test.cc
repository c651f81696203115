// Logs that were compressed afterwards: read as the plain ones are, whatever is wrong with them.

#include "logger/log/log_bytes.h"

#include <gtest/gtest.h>
#include <zstd.h>

#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "logger/log/compress.h"
#include "logger/log/event_log.h"
#include "logger/log/run_log.h"
#include "test/logger/temp_log.h"

namespace morphbus::logger {
namespace {

using Bytes = std::vector<uint8_t>;

/// A log of `count` events whose payloads hardly compress.
Bytes SoundLog(int count, size_t payload) {
  Bytes log;
  uint32_t state = 1;
  for (int i = 0; i < count; ++i) {
    Bytes data(payload);
    for (uint8_t& byte : data)
      byte = static_cast<uint8_t>((state = state * 1664525u + 1013904223u) >> 24);
    AppendEvent(i, 1'700'000'000'000'000 + i, "R/m1/STATUS", data, &log);
  }
  return log;
}

/// One frame, as plain `zstd` makes it.
Bytes Zstd(const Bytes& bytes) {
  Bytes out(ZSTD_compressBound(bytes.size()));
  ZSTD_CCtx* context = ZSTD_createCCtx();
  ZSTD_CCtx_setParameter(context, ZSTD_c_checksumFlag, 1);
  out.resize(ZSTD_compress2(context, out.data(), out.size(), bytes.data(), bytes.size()));
  ZSTD_freeCCtx(context);
  return out;
}

/// By our own compressor: several frames.
Bytes Compressed(const Bytes& bytes) {
  const TempLog log(bytes);
  Bytes out;
  const auto report = CompressLog(log.path(), [&](std::span<const uint8_t> more) {
    out.insert(out.end(), more.begin(), more.end());
    return Result<void>();
  });
  EXPECT_TRUE(report.has_value());
  EXPECT_EQ(report->log_bytes, bytes.size());
  EXPECT_EQ(report->compressed_bytes, out.size());
  return out;
}

struct ReadLog {
  std::vector<int64_t> numbers;
  std::vector<LogFinding> findings;
  uint64_t log_size = 0;
  bool damaged = false;
};

ReadLog Read(const Bytes& file) {
  const TempLog log(file);
  ReadLog read;
  auto reader = EventLogReader::Open(log.path());
  EXPECT_TRUE(reader.has_value());
  LogEvent event;
  while ((*reader)->Next(&event)) read.numbers.push_back(event.number);
  read.findings = (*reader)->findings();
  read.log_size = (*reader)->log_size();
  read.damaged = (*reader)->damaged();
  EXPECT_EQ((*reader)->file_size(), file.size());
  return read;
}

/// Frames of zstd in a file, told by their magic.
std::vector<size_t> FrameOffsets(const Bytes& file) {
  std::vector<size_t> offsets;
  const Bytes magic = {0x28, 0xB5, 0x2F, 0xFD};
  for (size_t at = 0; at + 4 <= file.size(); ++at) {
    if (std::equal(magic.begin(), magic.end(), file.begin() + static_cast<ptrdiff_t>(at))) {
      offsets.push_back(at);
    }
  }
  return offsets;
}

TEST(LogBytesTest, ACompressedLogIsReadAsThePlainOne) {
  const Bytes log = SoundLog(9000, 1000);
  const ReadLog plain = Read(log);
  ASSERT_EQ(plain.numbers.size(), 9000u);
  for (const Bytes& file : {Zstd(log), Compressed(log)}) {
    const ReadLog read = Read(file);
    EXPECT_EQ(read.numbers, plain.numbers);
    EXPECT_EQ(read.log_size, log.size());
    EXPECT_TRUE(read.findings.empty());
  }
}

TEST(LogBytesTest, TheCompressorMakesFramesThatBeginWithEventsAndDecompressToTheLog) {
  Bytes log = SoundLog(9000, 1000);
  log.resize(log.size() - 100);  // A cut log is compressed as it is, too.
  const Bytes file = Compressed(log);
  EXPECT_GE(FrameOffsets(file).size(), 3u);
  Bytes back;
  for (size_t at = 0; at < file.size();) {
    const size_t size = ZSTD_findFrameCompressedSize(file.data() + at, file.size() - at);
    ASSERT_FALSE(ZSTD_isError(size));
    Bytes frame(ZSTD_getFrameContentSize(file.data() + at, file.size() - at));
    ASSERT_EQ(ZSTD_decompress(frame.data(), frame.size(), file.data() + at, size), frame.size());
    EXPECT_EQ(Bytes(frame.begin(), frame.begin() + 4), Bytes({0xED, 0xA1, 0xDA, 0x01}));
    back.insert(back.end(), frame.begin(), frame.end());
    at += size;
  }
  EXPECT_EQ(back, log);
}

TEST(LogBytesTest, ACompressedFileThatIsCutIsToldFromALogThatWasCut) {
  const Bytes log = SoundLog(3000, 1000);
  // The log was cut and then compressed: the frame is whole, the last event is not.
  const ReadLog cut_before = Read(Zstd(Bytes(log.begin(), log.end() - 500)));
  ASSERT_EQ(cut_before.findings.size(), 1u);
  EXPECT_EQ(cut_before.findings[0].kind, LogFinding::Kind::kTruncated);
  EXPECT_NE(cut_before.findings[0].what.find("the log ends at byte"), std::string::npos);
  EXPECT_EQ(cut_before.numbers.size(), 2999u);
  // The compressed file was cut: told as such, beside the event that lost its end.
  Bytes file = Zstd(log);
  file.resize(file.size() / 2);
  const ReadLog cut_after = Read(file);
  ASSERT_FALSE(cut_after.findings.empty());
  EXPECT_EQ(cut_after.findings.back().kind, LogFinding::Kind::kTruncated);
  EXPECT_NE(cut_after.findings.back().what.find("the compressed file ends at its byte"),
            std::string::npos);
  EXPECT_GT(cut_after.numbers.size(), 1000u);
  EXPECT_LT(cut_after.numbers.size(), 2000u);
}

TEST(LogBytesTest, AWrongByteIsNoticedWhereverItIsAndCostsOneFrameAtMost) {
  const Bytes log = SoundLog(13000, 1000);
  const Bytes file = Compressed(log);
  const std::vector<size_t> frames = FrameOffsets(file);
  ASSERT_EQ(frames.size(), 4u);
  // Every event of the other frames is still there, and so are their numbers.
  for (size_t at = frames[1]; at < frames[2]; at += (frames[2] - frames[1]) / 7) {
    Bytes wrong = file;
    wrong[at] ^= 0x40;
    const ReadLog read = Read(wrong);
    EXPECT_TRUE(read.damaged) << at;
    EXPECT_GE(read.numbers.size(), 13000u - 4300u) << at;
    EXPECT_EQ(read.numbers.back(), 12999) << at;
    // What was read is what was there: no event is told with another number than its own.
    EXPECT_TRUE(std::is_sorted(read.numbers.begin(), read.numbers.end())) << at;
    const bool told = std::any_of(read.findings.begin(), read.findings.end(), [](const auto& f) {
      return f.what.find("the compressed file is damaged between its bytes") != std::string::npos;
    });
    EXPECT_TRUE(told) << at;
  }
}

TEST(LogBytesTest, BytesBehindTheLastFrameAndAFileOfNothingButAMagicAreDamage) {
  Bytes file = Zstd(SoundLog(20, 100));
  file.insert(file.end(), {1, 2, 3, 4, 5});
  const ReadLog read = Read(file);
  EXPECT_EQ(read.numbers.size(), 20u);
  EXPECT_TRUE(read.damaged);
  const ReadLog empty = Read(Bytes{0x28, 0xB5, 0x2F, 0xFD});
  EXPECT_TRUE(empty.numbers.empty());
  EXPECT_TRUE(empty.damaged);
}

TEST(LogBytesTest, WhatExpandsAsNoLogDoesIsNotReadToItsEnd) {
  // Eight million zeros a frame, sixteen thousand frames: a hundred gigabytes.
  const Bytes frame = Zstd(Bytes(size_t{8} << 20, 0));
  Bytes file;
  for (int i = 0; i < 4000; ++i) file.insert(file.end(), frame.begin(), frame.end());
  ASSERT_LT(file.size(), size_t{8} << 20);
  const ReadLog read = Read(file);
  EXPECT_TRUE(read.numbers.empty());
  EXPECT_LT(read.log_size,
            std::max<uint64_t>(uint64_t{1} << 30, 1000 * file.size()) + (uint64_t{4} << 20));
  ASSERT_FALSE(read.findings.empty());
  EXPECT_NE(read.findings.back().what.find("expands to more than"), std::string::npos);
}

TEST(LogBytesTest, SeekingBackReadsTheSameEventsAgain) {
  const TempLog log(Compressed(SoundLog(9000, 1000)));
  auto reader = EventLogReader::Open(log.path());
  ASSERT_TRUE(reader.has_value());
  LogEvent event;
  uint64_t offset = 0;
  while ((*reader)->Next(&event)) {
    if (event.number == 1234) offset = event.offset;
  }
  (*reader)->Seek(offset);
  ASSERT_TRUE((*reader)->Next(&event));
  EXPECT_EQ(event.number, 1234);
  (*reader)->Seek(0);
  ASSERT_TRUE((*reader)->Next(&event));
  EXPECT_EQ(event.number, 0);
  EXPECT_FALSE((*reader)->damaged());
}

TEST(LogBytesTest, AParallelCompressorsSkippableFramesAreNoDamage) {
  const Bytes log = SoundLog(50, 100);
  Bytes file = {0x50, 0x2A, 0x4D, 0x18, 4, 0, 0, 0, 9, 9, 9, 9};
  const Bytes frame = Zstd(log);
  file.insert(file.end(), frame.begin(), frame.end());
  const ReadLog read = Read(file);
  EXPECT_EQ(read.numbers.size(), 50u);
  EXPECT_FALSE(read.damaged);
}

TEST(LogBytesTest, ARunIsLoadedFromACompressedLogAsFromAPlainOne) {
  const TempLog plain;
  std::ifstream stream(plain.path(), std::ios::binary);
  const Bytes log{std::istreambuf_iterator<char>(stream), {}};
  const TempLog compressed(Zstd(log));
  EXPECT_TRUE(BeginsAsLog(plain.path()));
  EXPECT_TRUE(BeginsAsLog(compressed.path()));
  EXPECT_FALSE(BeginsAsLog(TempLog(Zstd(Bytes{1, 2, 3, 4, 5})).path()));
  const auto a = LoadRunLog(plain.path());
  const auto b = LoadRunLog(compressed.path());
  ASSERT_TRUE(a.has_value());
  ASSERT_TRUE(b.has_value());
  EXPECT_EQ(a->facts.run_hash, b->facts.run_hash);
  EXPECT_EQ(b->facts.end_state, EndState::kVerified);
  EXPECT_FALSE(a->facts.compressed);
  EXPECT_TRUE(b->facts.compressed);
  EXPECT_EQ(b->facts.log_bytes, a->facts.file_bytes);
}

}  // namespace
}  // namespace morphbus::logger
