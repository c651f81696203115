// Reads an MCAP file with @mcap/core, once front to back and once by its index, with every CRC validated, and prints
// what is in it: a line a message ({topic, sequence, logTime, publishTime, schema, encoding, message or bytes}, in
// the order of the file), then {statistics, indexed}. Usage: node read.mjs FILE
import { open } from 'node:fs/promises';
import { McapIndexedReader, McapStreamReader } from '@mcap/core';
import { decompress } from 'fzstd';
import protobuf from 'protobufjs';
import descriptor from 'protobufjs/ext/descriptor/index.js';

const decompressHandlers = { zstd: (data, size) => decompress(data, new Uint8Array(Number(size))) };
const file = await open(process.argv[2]);

/** A decoder of messages by the FileDescriptorSet that came with the file. */
function decoderOf(schema) {
  const root = protobuf.Root.fromDescriptor(descriptor.FileDescriptorSet.decode(schema.data));
  root.resolveAll();
  const type = root.lookupType(schema.name);
  return (data) => type.toObject(type.decode(data), { longs: String, bytes: 'hex', defaults: true, arrays: true });
}

const json = (value) => JSON.stringify(value, (_, v) => {
  if (typeof v === 'bigint') return v.toString();
  if (v instanceof Uint8Array || v?.type === 'Buffer') return Buffer.from(v.data ?? v).toString('hex');
  if (Object.is(v, -0)) return '-0';
  return v;
});

// Front to back.
const reader = new McapStreamReader({ validateCrcs: true, decompressHandlers });
const schemas = new Map();
const channels = new Map();
const streamed = new Map();
const size = Number((await file.stat()).size);
const lines = [];
for (let at = 0; at < size;) {
  const { buffer, bytesRead } = await file.read(new Uint8Array(100_000), 0, 100_000, at);
  reader.append(buffer.subarray(0, bytesRead));
  at += bytesRead;
  for (let record; (record = reader.nextRecord()) != null;) {
    if (record.type === 'Schema' && !schemas.has(record.id)) schemas.set(record.id, { ...record, decode: decoderOf(record) });
    if (record.type === 'Channel') channels.set(record.id, record);
    if (record.type !== 'Message') continue;
    const channel = channels.get(record.channelId);
    const schema = schemas.get(channel.schemaId);
    streamed.set(channel.topic, (streamed.get(channel.topic) ?? 0) + 1);
    lines.push(json({
      topic: channel.topic, sequence: record.sequence, logTime: record.logTime, publishTime: record.publishTime,
      schema: schema?.name ?? null, encoding: channel.messageEncoding,
      ...(schema ? { message: schema.decode(record.data) } : { bytes: Buffer.from(record.data).toString('hex') }),
    }));
  }
}
if (!reader.done()) throw new Error('the file does not end with its magic');
process.stdout.write(lines.join('\n') + '\n');

// By the index, in order of time.
const indexed = await McapIndexedReader.Initialize({
  readable: {
    size: async () => BigInt(size),
    read: async (offset, length) => {
      const bytes = new Uint8Array(Number(length));
      const { bytesRead } = await file.read(bytes, 0, bytes.length, Number(offset));
      if (bytesRead !== bytes.length) throw new Error(`no ${length} bytes at ${offset}`);
      return bytes;
    },
  },
  decompressHandlers,
});
const counts = new Map();
let last = 0n;
for await (const message of indexed.readMessages({ validateCrcs: true })) {
  if (message.logTime < last) throw new Error('the index is not in order of time');
  last = message.logTime;
  const { topic } = indexed.channelsById.get(message.channelId);
  counts.set(topic, (counts.get(topic) ?? 0) + 1);
}
const { statistics } = indexed;
process.stdout.write(json({
  statistics: { ...statistics, channelMessageCounts: Object.fromEntries(
    [...statistics.channelMessageCounts].map(([id, n]) => [indexed.channelsById.get(id).topic, n])) },
  indexed: Object.fromEntries(counts), streamed: Object.fromEntries(streamed),
  chunks: indexed.chunkIndexes.length, offsets: indexed.summaryOffsetsByOpcode.size,
}) + '\n');
