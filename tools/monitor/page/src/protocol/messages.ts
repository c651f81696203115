/** The Foxglove WebSocket protocol, version 1, as far as the page speaks it: docs/monitor-protocol.md has all of it. */

export const SUBPROTOCOLS = ['foxglove.websocket.v1', 'foxglove.sdk.v1'];

/** A topic that the server offers. */
export interface Channel {
  id: number;
  topic: string;
  /** How messages are encoded: "protobuf". */
  encoding: string;
  schemaName: string;
  /** The base64 of a FileDescriptorSet with all that it imports. */
  schema: string;
}

/** A call that the server answers. */
export interface Service {
  id: number;
  name: string;
}

/** A value that the server holds. */
export interface Parameter {
  name: string;
  value?: unknown;
}

export interface ServerInfo {
  op: 'serverInfo';
  name: string;
  metadata?: Record<string, string>;
  /** Another one means another run of the server: what was known before is void. */
  sessionId?: string;
}

export type ServerMessage =
  | ServerInfo
  | { op: 'advertise'; channels: Channel[] }
  | { op: 'advertiseServices'; services: Service[] }
  | { op: 'serviceCallFailure'; callId: number; message: string }
  | { op: 'status'; level: number; message: string; id?: string }
  | { op: 'parameterValues'; parameters: Parameter[]; id?: string };

export const OP_MESSAGE_DATA = 1;
export const OP_TIME = 2;
export const OP_SERVICE_RESPONSE = 3;
export const OP_CLIENT_SERVICE_REQUEST = 2;

/** A binary frame from the server. */
export type ServerFrame =
  | { op: typeof OP_MESSAGE_DATA; subscription: number; timestamp: bigint; payload: Uint8Array }
  | { op: typeof OP_TIME; timestamp: bigint }
  | { op: typeof OP_SERVICE_RESPONSE; callId: number; payload: Uint8Array };

/** Reads a binary frame; null if it is none that the page knows. */
export function parseFrame(data: ArrayBuffer): ServerFrame | null {
  const view = new DataView(data);
  if (view.byteLength < 1) return null;
  const op = view.getUint8(0);
  if (op === OP_MESSAGE_DATA && view.byteLength >= 13) {
    return {
      op,
      subscription: view.getUint32(1, true),
      timestamp: view.getBigUint64(5, true),
      payload: new Uint8Array(data, 13),
    };
  }
  if (op === OP_TIME && view.byteLength >= 9) return { op, timestamp: view.getBigUint64(1, true) };
  if (op === OP_SERVICE_RESPONSE && view.byteLength >= 13) {
    const size = view.getUint32(9, true);
    if (13 + size > view.byteLength) return null;
    return { op, callId: view.getUint32(5, true), payload: new Uint8Array(data, 13 + size) };
  }
  return null;
}

/** A call of a service as a binary frame. */
export function serviceRequest(
  serviceId: number,
  callId: number,
  encoding: string,
  payload: Uint8Array,
): Uint8Array<ArrayBuffer> {
  const name = new TextEncoder().encode(encoding);
  const bytes = new Uint8Array(13 + name.length + payload.length);
  const view = new DataView(bytes.buffer);
  view.setUint8(0, OP_CLIENT_SERVICE_REQUEST);
  view.setUint32(1, serviceId, true);
  view.setUint32(5, callId, true);
  view.setUint32(9, name.length, true);
  bytes.set(name, 13);
  bytes.set(payload, 13 + name.length);
  return bytes;
}
