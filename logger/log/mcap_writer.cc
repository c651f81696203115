#include "logger/log/mcap_writer.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>

#include "compiler/base/check.h"

namespace morphbus::logger {

/// The opcodes of https://mcap.dev/spec#opcodes.
enum class McapWriter::Record : uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

namespace {

/// Begins and ends every file.
constexpr std::string_view kMcapMagic("\x89MCAP0\r\n", 8);
constexpr std::string_view kMcapCompression = "zstd";
constexpr size_t kMostEntries = 65535;

/// CRC-32 (IEEE 802.3, reflected) over what `crc` covers and then `bytes`; 0 covers nothing.
uint32_t ExtendCrc(uint32_t crc, std::string_view bytes) {
  const uLong extended = crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  return static_cast<uint32_t>(extended);
}

}  // namespace

/// The content of a record, field by field.
class McapWriter::Bytes {
 public:
  /// An unsigned integer in its own size.
  template <class Integer>
  Bytes& Add(Integer value) {
    for (size_t i = 0; i < sizeof value; ++i) {
      text_ += static_cast<char>(static_cast<uint64_t>(value) >> (8 * i) & 0xFF);
    }
    return *this;
  }
  /// A text or bytes behind their length in 32 bits.
  Bytes& AddText(std::string_view text) {
    Add(static_cast<uint32_t>(text.size()));
    return AddRaw(text);
  }
  Bytes& AddRaw(std::string_view bytes) {
    text_ += bytes;
    return *this;
  }
  /// A map or list: what `fill` adds, behind its size in bytes.
  template <class Fill>
  Bytes& AddList(const Fill& fill) {
    Bytes inner;
    fill(&inner);
    return AddText(inner.text_);
  }
  /// The record: opcode, length, content.
  [[nodiscard]] std::string AsRecord(Record kind) const {
    Bytes record;
    record.Add(static_cast<uint8_t>(kind)).Add(uint64_t{text_.size()});
    return record.text_ + text_;
  }

 private:
  std::string text_;
};

McapWriter::McapWriter(ByteSink write) : write_(std::move(write)) {
  Emit(kMcapMagic);
  Emit(Bytes().AddText("").AddText("morphbus").AsRecord(Record::kHeader));
}

void McapWriter::Emit(std::string_view bytes) {
  // After the first failure nothing more is written, and Write() and Close() return it.
  if (!error_.empty()) return;
  crc_ = ExtendCrc(crc_, bytes);
  offset_ += bytes.size();
  const Result<void> written =
      write_({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()});
  if (!written) error_ = written.error().message;
}

uint16_t McapWriter::AddSchema(std::string_view name, std::string_view data) {
  MORPHBUS_CHECK(schemas_.size() < kMostEntries);
  const auto id = static_cast<uint16_t>(schemas_.size() + 1);
  // Kept as a record, which the summary repeats.
  schemas_.push_back(
      Bytes().Add(id).AddText(name).AddText("protobuf").AddText(data).AsRecord(Record::kSchema));
  chunk_ += schemas_.back();
  return id;
}

uint16_t McapWriter::AddChannel(uint16_t schema, std::string_view topic,
                                std::string_view message_encoding) {
  // Schema 0 stands for messages without one; channels are numbered from 0, schemas from 1.
  MORPHBUS_CHECK(channels_.size() < kMostEntries && schema <= schemas_.size());
  const auto id = static_cast<uint16_t>(channels_.size());
  constexpr uint32_t kNoMetadata = 0;
  channels_.push_back(Bytes()
                          .Add(id)
                          .Add(schema)
                          .AddText(topic)
                          .AddText(message_encoding)
                          .Add(kNoMetadata)
                          .AsRecord(Record::kChannel));
  chunk_ += channels_.back();
  return id;
}

Result<void> McapWriter::Write(uint16_t channel, uint32_t sequence, uint64_t log_time_ns,
                               uint64_t publish_time_ns, std::span<const uint8_t> data) {
  MORPHBUS_CHECK(channel < channels_.size());
  // Times of the chunk and of the file are those of their earliest and latest message.
  const bool first_of_chunk = chunk_index_.empty();
  chunk_start_ns_ = first_of_chunk ? log_time_ns : std::min(chunk_start_ns_, log_time_ns);
  chunk_end_ns_ = first_of_chunk ? log_time_ns : std::max(chunk_end_ns_, log_time_ns);
  start_ns_ = num_messages_ == 0 ? log_time_ns : std::min(start_ns_, log_time_ns);
  end_ns_ = std::max(end_ns_, log_time_ns);
  ++num_messages_;
  // By these counts and places a reader finds a channel's messages without reading the others.
  ++channel_messages_[channel];
  chunk_index_[channel].emplace_back(log_time_ns, chunk_.size());
  chunk_ += Bytes()
                .Add(channel)
                .Add(sequence)
                .Add(log_time_ns)
                .Add(publish_time_ns)
                .AddRaw({reinterpret_cast<const char*>(data.data()), data.size()})
                .AsRecord(Record::kMessage);
  if (chunk_.size() >= kChunkBytes) FlushChunk();
  return error_.empty() ? Result<void>() : Fail(error_);
}

void McapWriter::FlushChunk() {
  if (chunk_.empty()) return;
  // A chunk is compressed as a whole.
  std::string compressed(ZSTD_compressBound(chunk_.size()), '\0');
  const size_t size = ZSTD_compress(compressed.data(), compressed.size(), chunk_.data(),
                                    chunk_.size(), ZSTD_CLEVEL_DEFAULT);
  MORPHBUS_CHECK(ZSTD_isError(size) == 0);  // The buffer is as large as zstd asks for.
  compressed.resize(size);
  // The chunk itself; one with schemas and channels alone has no times.
  ChunkEntry entry;
  entry.start_ns = chunk_index_.empty() ? 0 : chunk_start_ns_;
  entry.end_ns = chunk_index_.empty() ? 0 : chunk_end_ns_;
  entry.offset = offset_;
  entry.size = chunk_.size();
  entry.compressed_size = size;
  Bytes chunk;
  chunk.Add(entry.start_ns).Add(entry.end_ns).Add(uint64_t{chunk_.size()});
  chunk.Add(ExtendCrc(0, chunk_)).AddText(kMcapCompression);
  chunk.Add(uint64_t{size}).AddRaw(compressed);
  Emit(chunk.AsRecord(Record::kChunk));
  entry.length = offset_ - entry.offset;
  // Behind it, by channel, where its messages stand in the uncompressed records.
  const uint64_t index_begin = offset_;
  for (const auto& [channel, messages] : chunk_index_) {
    entry.index_offsets[channel] = offset_;
    const auto& list = messages;
    Emit(Bytes()
             .Add(channel)
             .AddList([&](Bytes* pairs) {
               for (const auto& [time_ns, at] : list) pairs->Add(time_ns).Add(at);
             })
             .AsRecord(Record::kMessageIndex));
  }
  entry.index_length = offset_ - index_begin;
  chunks_.push_back(std::move(entry));
  chunk_.clear();
  chunk_index_.clear();
}

void McapWriter::EmitGroup(Record kind, const std::vector<std::string>& records,
                           std::string* offsets) {
  if (records.empty()) return;
  // Readers that want one kind of record find where it begins, and how long its group is.
  const uint64_t begin = offset_;
  for (const std::string& record : records) Emit(record);
  *offsets += Bytes()
                  .Add(static_cast<uint8_t>(kind))
                  .Add(begin)
                  .Add(offset_ - begin)
                  .AsRecord(Record::kSummaryOffset);
}

Result<void> McapWriter::Close() {
  // The end of the data has the checksum of all bytes before it.
  FlushChunk();
  Emit(Bytes().Add(crc_).AsRecord(Record::kDataEnd));
  // The summary: what a reader needs in order to find everything else.
  const uint64_t summary_begin = offset_;
  crc_ = 0;
  std::string offsets;
  EmitGroup(Record::kSchema, schemas_, &offsets);
  EmitGroup(Record::kChannel, channels_, &offsets);
  // What is in the file, in numbers.
  Bytes statistics;
  statistics.Add(num_messages_).Add(static_cast<uint16_t>(schemas_.size()));
  statistics.Add(static_cast<uint32_t>(channels_.size()));
  statistics.Add(uint32_t{0}).Add(uint32_t{0});  // Neither attachments nor metadata.
  statistics.Add(static_cast<uint32_t>(chunks_.size())).Add(start_ns_).Add(end_ns_);
  statistics.AddList([&](Bytes* list) {
    for (const auto& [channel, count] : channel_messages_) list->Add(channel).Add(count);
  });
  EmitGroup(Record::kStatistics, {statistics.AsRecord(Record::kStatistics)}, &offsets);
  // Where each chunk stands, and the indices behind it.
  std::vector<std::string> chunk_records;
  for (const ChunkEntry& entry : chunks_) {
    Bytes index;
    index.Add(entry.start_ns).Add(entry.end_ns).Add(entry.offset).Add(entry.length);
    index.AddList([&](Bytes* list) {
      for (const auto& [channel, offset] : entry.index_offsets) list->Add(channel).Add(offset);
    });
    index.Add(entry.index_length).AddText(kMcapCompression);
    index.Add(entry.compressed_size).Add(entry.size);
    chunk_records.push_back(index.AsRecord(Record::kChunkIndex));
  }
  EmitGroup(Record::kChunkIndex, chunk_records, &offsets);
  // Where the groups of the summary stand, and the footer, whose CRC covers its own beginning.
  const uint64_t offsets_begin = offset_;
  Emit(offsets);
  const std::string footer =
      Bytes().Add(summary_begin).Add(offsets_begin).Add(uint32_t{0}).AsRecord(Record::kFooter);
  Emit(std::string_view(footer).substr(0, footer.size() - sizeof(uint32_t)));
  // The checksum is the last field of the footer, and could not be in what it covers.
  std::string crc;
  for (int i = 0; i < 4; ++i) crc += static_cast<char>(crc_ >> (8 * i) & 0xFF);
  Emit(crc);
  Emit(kMcapMagic);
  return error_.empty() ? Result<void>() : Fail(error_);
}

}  // namespace morphbus::logger
