#pragma once
// MCAP files (https://mcap.dev/spec, version 0), as Foxglove and many others read them: messages in
// chunks that are compressed with zstd, with CRCs, an index of every chunk and a summary.

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "logger/log/byte_sink.h"

namespace morphbus::logger {

/// Writes one MCAP file to a sink, front to back: nothing is ever written twice, so a pipe will do.
/// Memory holds one chunk, and for each chunk and each channel in it an entry of the index. Schemas
/// and channels stand in the chunk in which they are first needed and again in the summary.
class McapWriter {
 public:
  /// How large a chunk may grow before it is written, in bytes before compression.
  static constexpr size_t kChunkBytes = size_t{1} << 20;

  /// `write` takes the file's bytes in order.
  explicit McapWriter(ByteSink write);

  /// Adds a schema of Protocol Buffers and returns its number, from 1. `data` is a serialized
  /// FileDescriptorSet with all that it refers to, and `name` the full name of the message in it.
  uint16_t AddSchema(std::string_view name, std::string_view data);
  /// Adds a channel and returns its number, from 0. Schema 0 stands for none. There are 65,535 of
  /// each at most (checked).
  uint16_t AddChannel(uint16_t schema, std::string_view topic, std::string_view message_encoding);
  /// Appends a message. Times are nanoseconds; readers sort by `log_time_ns`, which need not ascend
  /// here. Fails as the sink does; from the first failure on nothing more is written.
  Result<void> Write(uint16_t channel, uint32_t sequence, uint64_t log_time_ns,
                     uint64_t publish_time_ns, std::span<const uint8_t> data);
  /// Writes the last chunk, the summary and the footer. Nothing can be written after.
  Result<void> Close();

 private:
  /// A chunk as the index in the summary names it.
  struct ChunkEntry {
    uint64_t start_ns = 0, end_ns = 0;
    uint64_t offset = 0, length = 0;             ///< Of its record in the file.
    std::map<uint16_t, uint64_t> index_offsets;  ///< Of its MessageIndex records, by channel.
    uint64_t index_length = 0;
    uint64_t compressed_size = 0, size = 0;
  };
  /// Kinds of records (their opcodes).
  enum class Record : uint8_t;
  /// Little-endian records, as the format has them (mcap_writer.cc).
  class Bytes;

  /// Hands bytes to the sink, and counts them into the CRC of the section that is being written.
  void Emit(std::string_view bytes);
  /// Writes the present chunk with its index, if it holds anything.
  void FlushChunk();
  /// Writes all records of one kind of the summary, and notes where they stand.
  void EmitGroup(Record kind, const std::vector<std::string>& records, std::string* offsets);

  ByteSink write_;
  /// The first failure of the sink; empty until then.
  std::string error_;
  /// Bytes written so far.
  uint64_t offset_ = 0;
  /// CRC-32 of the data section so far, later of the summary.
  uint32_t crc_ = 0;
  /// Uncompressed records of the present chunk, and the (time, offset) pairs of its messages.
  std::string chunk_;
  std::map<uint16_t, std::vector<std::pair<uint64_t, uint64_t>>> chunk_index_;
  uint64_t chunk_start_ns_ = 0, chunk_end_ns_ = 0;
  /// What the summary repeats: whole records.
  std::vector<std::string> schemas_, channels_;
  std::vector<ChunkEntry> chunks_;
  std::map<uint16_t, uint64_t> channel_messages_;
  uint64_t num_messages_ = 0, start_ns_ = 0, end_ns_ = 0;
};

}  // namespace morphbus::logger
