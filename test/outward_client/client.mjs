// An independent client of the monitor: Foxglove's own protocol library and protobufjs, which know nothing of
// Morphbus. It connects under a subprotocol, subscribes to everything, decodes every message by the schema that
// came with its channel, and prints what it got as JSON.
//
// Usage: client.mjs URL SUBPROTOCOL [--play SOURCE]   plays a log whole and prints its transforms
//        client.mjs URL SUBPROTOCOL [--live SECONDS]  listens to a run until something of every topic came
import {createRequire} from 'node:module';

const require = createRequire(import.meta.url);
const {FoxgloveClient} = require('@foxglove/ws-protocol');
const protobuf = require('protobufjs');
const descriptor = require('protobufjs/ext/descriptor');
const WebSocket = require('ws');

const [url, subprotocol, mode, argument] = process.argv.slice(2);
// Topics on which a run that is in order says nothing for long.
const kSeldom = ['faults', 'prints', 'traces', 'log', 'health', 'channels'];

const socket = new WebSocket(url, [subprotocol]);
const client = new FoxgloveClient({ws: socket});
const result = {protocol: null, serverInfo: null, counts: {}, schemas: {}, transforms: [], joints: [], statuses: []};
const channels = new Map();  // by subscription
const services = new Map();  // by name
let nextCall = 1;
const calls = new Map();

const fail = (why) => {
  console.error(why);
  process.exit(1);
};
// This package ends with the protocol foxglove.websocket.v1. Under the later one it is told how far playback is, which its
// kind of client is free to leave out.
const kLater = 'Unrecognized server opcode in binary message: 5';
client.on('error', (error) => {
  if (subprotocol !== 'foxglove.sdk.v1' || error?.message !== kLater) fail(`error: ${error?.message ?? error}`);
});
client.on('close', () => fail('the server closed the connection'));
client.on('open', () => { result.protocol = socket.protocol; });
client.on('serverInfo', (info) => { result.serverInfo = info; });
client.on('status', (status) => { result.statuses.push(status); });

client.on('advertise', (list) => {
  for (const channel of list) {
    const set = descriptor.FileDescriptorSet.decode(Buffer.from(channel.schema, 'base64'));
    const type = protobuf.Root.fromDescriptor(set).lookupType(channel.schemaName);
    channels.set(client.subscribe(channel.id), {...channel, type});
    result.counts[channel.topic] = 0;
    result.schemas[channel.topic] = channel.schemaName;
  }
});

client.on('advertiseServices', (list) => {
  for (const service of list) services.set(service.name, service.id);
  start();
});

const call = (name, request) => new Promise((resolve, reject) => {
  const callId = nextCall++;
  calls.set(callId, {resolve, reject});
  const data = new TextEncoder().encode(JSON.stringify(request));
  client.sendServiceCallRequest({serviceId: services.get(name), callId, encoding: 'json', data: new DataView(data.buffer)});
});
client.on('serviceCallResponse', (response) => {
  calls.get(response.callId).resolve(JSON.parse(new TextDecoder().decode(response.data)));
});
client.on('serviceCallFailure', (failure) => calls.get(failure.callId).reject(new Error(failure.message)));

const seconds = (time) => Number(time?.seconds ?? 0) * 1e9 + (time?.nanos ?? 0);
let playing = false;

client.on('message', ({subscriptionId, timestamp, data}) => {
  const channel = channels.get(subscriptionId);
  const bytes = new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
  const message = channel.type.decode(bytes);
  if (mode === '--play' && !playing) return;
  result.counts[channel.topic] += 1;
  const name = channel.topic.split('/').pop();
  if (name === 'tf' || name === 'tf_propagated') {
    for (const t of message.transforms) {
      if (BigInt(seconds(t.timestamp)) !== timestamp) fail(`${channel.topic}: the times of frame and message differ`);
      result.transforms.push([name, Number(timestamp / 1000n), t.parent_frame_id, t.child_frame_id,
        t.translation.x, t.translation.y, t.translation.z, t.rotation.w, t.rotation.x, t.rotation.y, t.rotation.z]);
    }
  }
  if (name === 'joints') {
    for (const j of message.joints) result.joints.push([Number(timestamp / 1000n), j.module, j.joint, j.position]);
  }
  if (mode === '--live') {
    const missing = Object.entries(result.counts).filter(([topic, count]) =>
      count === 0 && !kSeldom.includes(topic.split('/').pop()));
    if (missing.length === 0) finish();
  }
});

let finished = false;
const finish = () => {
  // Messages go on coming until the last byte is out.
  if (finished) return;
  finished = true;
  process.stdout.write(JSON.stringify(result), () => process.exit(0));
};

async function start() {
  if (mode !== '--play') return;
  // The range is whole when playback pauses, which is told behind its last message.
  const paused = `/${argument}/paused`;
  await call(`/${argument}/playback`, {playing: false});
  client.subscribeParameterUpdates([paused]);
  client.on('parameterValues', ({parameters}) => {
    if (playing && parameters.some((p) => p.name === paused && p.value === true)) finish();
  });
  playing = true;
  await call(`/${argument}/playback`, {playing: true, speed: 0, from_us: 0});
}
