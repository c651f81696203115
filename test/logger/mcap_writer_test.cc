// The MCAP file byte by byte, read with nothing but the format's specification.

#include "logger/log/mcap_writer.h"

#include <gtest/gtest.h>
#include <zlib.h>
#include <zstd.h>

#include <cstring>
#include <string>
#include <vector>

namespace morphbus::logger {
namespace {

/// Reads little-endian fields one after the other; fails the test where bytes are missing.
class FieldReader {
 public:
  explicit FieldReader(std::string_view bytes) : bytes_(bytes) {}
  template <class Integer>
  Integer Get() {
    uint64_t value = 0;
    EXPECT_LE(at_ + sizeof(Integer), bytes_.size());
    for (size_t i = 0; i < sizeof(Integer) && at_ + i < bytes_.size(); ++i) {
      value |= uint64_t{static_cast<uint8_t>(bytes_[at_ + i])} << (8 * i);
    }
    at_ += sizeof(Integer);
    return static_cast<Integer>(value);
  }
  std::string_view Take(size_t size) {
    EXPECT_LE(at_ + size, bytes_.size());
    const std::string_view taken = bytes_.substr(std::min(at_, bytes_.size()), size);
    at_ += size;
    return taken;
  }
  std::string_view Text() { return Take(Get<uint32_t>()); }
  [[nodiscard]] bool at_end() const { return at_ >= bytes_.size(); }
  [[nodiscard]] size_t at() const { return at_; }

 private:
  std::string_view bytes_;
  size_t at_ = 0;
};

struct ReadRecord {
  uint8_t opcode = 0;
  size_t offset = 0;  ///< Of the record in what was read.
  size_t length = 0;  ///< With opcode and length.
  std::string_view content;
};

std::vector<ReadRecord> Records(std::string_view bytes, size_t begin = 0) {
  std::vector<ReadRecord> records;
  FieldReader reader(bytes);
  while (!reader.at_end()) {
    ReadRecord& record = records.emplace_back();
    record.offset = begin + reader.at();
    record.opcode = reader.Get<uint8_t>();
    record.content = reader.Take(reader.Get<uint64_t>());
    record.length = 9 + record.content.size();
  }
  return records;
}

uint32_t Crc(std::string_view bytes) {
  return static_cast<uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);

struct Message {
  uint16_t channel = 0;
  uint32_t sequence = 0;
  uint64_t log_time = 0;
  uint64_t publish_time = 0;
  std::string data;
  bool operator==(const Message&) const = default;
};

/// Messages whose times do not ascend, and one of 3 MB.
std::vector<Message> SomeMessages() {
  std::vector<Message> messages;
  for (uint32_t i = 0; i < 4000; ++i) {
    messages.push_back({static_cast<uint16_t>(i % 2), i, 1'000'000 + (i * 7919) % 4000, i,
                        std::string(i == 2000 ? 3'000'000 : i % 2000, static_cast<char>(i))});
  }
  return messages;
}

std::string Written(const std::vector<Message>& messages) {
  std::string file;
  McapWriter writer([&](std::span<const uint8_t> bytes) {
    file.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return Result<void>();
  });
  const uint16_t schema = writer.AddSchema("a.B", "described");
  EXPECT_EQ(writer.AddChannel(schema, "/one", "protobuf"), 0);
  EXPECT_EQ(writer.AddChannel(0, "/two", "lcm"), 1);
  for (const Message& m : messages) {
    EXPECT_TRUE(writer.Write(m.channel, m.sequence, m.log_time, m.publish_time,
                             {reinterpret_cast<const uint8_t*>(m.data.data()), m.data.size()}));
  }
  EXPECT_TRUE(writer.Close());
  return file;
}

/// Checks one chunk's CRC and sizes; returns its records, decompressed into `records`.
std::string Decompressed(std::string_view content, uint64_t* start, uint64_t* end) {
  FieldReader chunk(content);
  *start = chunk.Get<uint64_t>();
  *end = chunk.Get<uint64_t>();
  std::string records(chunk.Get<uint64_t>(), '\0');
  const auto crc = chunk.Get<uint32_t>();
  EXPECT_EQ(chunk.Text(), "zstd");
  const std::string_view compressed = chunk.Take(chunk.Get<uint64_t>());
  EXPECT_TRUE(chunk.at_end());
  EXPECT_EQ(ZSTD_decompress(records.data(), records.size(), compressed.data(), compressed.size()),
            records.size());
  EXPECT_EQ(Crc(records), crc);
  return records;
}

Message MessageOf(std::string_view content) {
  FieldReader reader(content);
  Message message;
  message.channel = reader.Get<uint16_t>();
  message.sequence = reader.Get<uint32_t>();
  message.log_time = reader.Get<uint64_t>();
  message.publish_time = reader.Get<uint64_t>();
  message.data = content.substr(reader.at());
  return message;
}

TEST(McapWriterTest, ChunksHoldAllMessagesInOrderAndTheirIndexPointsAtEachOne) {
  const std::vector<Message> messages = SomeMessages();
  const std::string file = Written(messages);
  std::vector<Message> back;
  std::string chunk;
  size_t indexed = 0;
  for (const ReadRecord& record : Records(std::string_view(file).substr(8, file.size() - 16), 8)) {
    uint64_t start = 0;
    uint64_t end = 0;
    if (record.opcode == 0x06) {
      chunk = Decompressed(record.content, &start, &end);
      for (const ReadRecord& inner : Records(chunk)) {
        if (inner.opcode != 0x05) continue;
        back.push_back(MessageOf(inner.content));
        EXPECT_GE(back.back().log_time, start);
        EXPECT_LE(back.back().log_time, end);
      }
    } else if (record.opcode == 0x07) {
      FieldReader index(record.content);
      const auto channel = index.Get<uint16_t>();
      FieldReader pairs(index.Text());
      while (!pairs.at_end()) {
        const auto time = pairs.Get<uint64_t>();
        const auto offset = pairs.Get<uint64_t>();
        ASSERT_LT(offset + 9, chunk.size());
        const std::vector<ReadRecord> at = Records(std::string_view(chunk).substr(offset));
        ASSERT_EQ(at.front().opcode, 0x05);
        EXPECT_EQ(MessageOf(at.front().content).log_time, time);
        EXPECT_EQ(MessageOf(at.front().content).channel, channel);
        ++indexed;
      }
    }
  }
  EXPECT_EQ(back, messages);
  EXPECT_EQ(indexed, messages.size());
}

TEST(McapWriterTest, SummaryCountsAndPointsRightAndBothCrcsHold) {
  const std::vector<Message> messages = SomeMessages();
  const std::string file = Written(messages);
  ASSERT_EQ(std::string_view(file).substr(0, 8), kMagic);
  ASSERT_EQ(std::string_view(file).substr(file.size() - 8), kMagic);
  // The footer is 29 bytes before the last magic: where the summary and its offsets begin, and the
  // CRC.
  const size_t footer_at = file.size() - 8 - 29;
  FieldReader footer(std::string_view(file).substr(footer_at + 9, 20));
  const auto summary = footer.Get<uint64_t>();
  const auto offsets = footer.Get<uint64_t>();
  EXPECT_EQ(footer.Get<uint32_t>(),
            Crc(std::string_view(file).substr(summary, footer_at + 25 - summary)));
  // The data section ends with its CRC right before the summary.
  const size_t data_end = summary - 13;
  EXPECT_EQ(static_cast<uint8_t>(file[data_end]), 0x0F);
  FieldReader crc(std::string_view(file).substr(data_end + 9, 4));
  EXPECT_EQ(crc.Get<uint32_t>(), Crc(std::string_view(file).substr(0, data_end)));
  // The statistics, and each chunk's index against the chunk itself.
  uint64_t in_chunks = 0;
  int chunks = 0;
  for (const ReadRecord& record :
       Records(std::string_view(file).substr(summary, offsets - summary), summary)) {
    FieldReader reader(record.content);
    if (record.opcode == 0x0B) {
      EXPECT_EQ(reader.Get<uint64_t>(), messages.size());
      EXPECT_EQ(reader.Get<uint16_t>(), 1u);
      EXPECT_EQ(reader.Get<uint32_t>(), 2u);
      EXPECT_EQ(reader.Get<uint64_t>(), 0u);  // Attachments and metadata.
      EXPECT_GT(reader.Get<uint32_t>(), 3u);
      EXPECT_EQ(reader.Get<uint64_t>(), 1'000'000u);
      EXPECT_EQ(reader.Get<uint64_t>(), 1'003'999u);
      FieldReader counts(reader.Text());
      for (const uint16_t channel : {0, 1}) {
        EXPECT_EQ(counts.Get<uint16_t>(), channel);
        EXPECT_EQ(counts.Get<uint64_t>(), messages.size() / 2);
      }
    } else if (record.opcode == 0x08) {
      ++chunks;
      reader.Take(16);
      const auto at = reader.Get<uint64_t>();
      const auto length = reader.Get<uint64_t>();
      const ReadRecord chunk = Records(std::string_view(file).substr(at, length)).front();
      EXPECT_EQ(chunk.opcode, 0x06);
      EXPECT_EQ(chunk.length, length);
      FieldReader indexes(reader.Text());
      const auto index_length = reader.Get<uint64_t>();
      uint64_t total = 0;
      while (!indexes.at_end()) {
        const auto channel = indexes.Get<uint16_t>();
        const auto offset = indexes.Get<uint64_t>();
        const ReadRecord index =
            Records(std::string_view(file).substr(offset, at + length + index_length - offset))
                .front();
        EXPECT_EQ(index.opcode, 0x07);
        EXPECT_EQ(FieldReader(index.content).Get<uint16_t>(), channel);
        total += index.length;
      }
      EXPECT_EQ(total, index_length);
      in_chunks += length;
    }
  }
  EXPECT_GT(chunks, 3);
  EXPECT_GT(in_chunks, 0u);
  // Every group of the summary is where its offset says.
  for (const ReadRecord& record :
       Records(std::string_view(file).substr(offsets, footer_at - offsets))) {
    ASSERT_EQ(record.opcode, 0x0E);
    FieldReader reader(record.content);
    const auto opcode = reader.Get<uint8_t>();
    const auto begin = reader.Get<uint64_t>();
    for (const ReadRecord& one :
         Records(std::string_view(file).substr(begin, reader.Get<uint64_t>()))) {
      EXPECT_EQ(one.opcode, opcode);
    }
  }
}

TEST(McapWriterTest, AFileWithoutMessagesIsWhole) {
  const std::string file = Written({});
  EXPECT_EQ(std::string_view(file).substr(file.size() - 8), kMagic);
}

TEST(McapWriterTest, AFailureOfTheSinkIsToldAndEndsTheWriting) {
  int calls = 0;
  McapWriter writer([&](std::span<const uint8_t>) -> Result<void> {
    if (++calls > 2) return Fail("disk full");
    return {};
  });
  writer.AddChannel(0, "/one", "lcm");
  const std::vector<uint8_t> data(2 * McapWriter::kChunkBytes, 1);
  const Result<void> written = writer.Write(0, 0, 0, 0, data);
  ASSERT_FALSE(written.has_value());
  EXPECT_EQ(written.error().message, "disk full");
  EXPECT_FALSE(writer.Write(0, 1, 0, 0, data).has_value());
  EXPECT_FALSE(writer.Close().has_value());
  EXPECT_EQ(calls, 3);
}

}  // namespace
}  // namespace morphbus::logger
