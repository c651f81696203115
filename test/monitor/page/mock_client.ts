/** A client's end of a connection to the mock server: frames of the protocol to and fro, without a network. */
import type { Socket } from '../src/protocol/connection.ts';

/** What a client asks of the server. */
export interface Served {
  greeting(): string[];
  latch(client: MockClient, channelId: number): void;
  /** Does what a service is asked for. Throws a sentence if it refuses. */
  serve(client: MockClient, serviceId: number, request: unknown): unknown;
  forget(client: MockClient): void;
}

/** The client's end of a connection to the mock. */
export class MockClient implements Socket {
  binaryType = '';
  onopen: (() => void) | null = null;
  onclose: ((event: { code: number; reason: string }) => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  private readonly subscriptions = new Map<number, number>();
  private closed = false;

  constructor(private readonly server: Served) {}

  greet(): void {
    this.onopen?.();
    for (const text of this.server.greeting()) this.onmessage?.({ data: text });
  }

  sendText(message: unknown): void {
    if (!this.closed) this.onmessage?.({ data: JSON.stringify(message) });
  }

  sendMessage(channelId: number, nanoseconds: bigint, payload: Uint8Array): void {
    const subscription = this.subscriptions.get(channelId);
    if (subscription === undefined || this.closed) return;
    const frame = new Uint8Array(13 + payload.length);
    const view = new DataView(frame.buffer);
    view.setUint8(0, 1);
    view.setUint32(1, subscription, true);
    view.setBigUint64(5, nanoseconds, true);
    frame.set(payload, 13);
    this.onmessage?.({ data: frame.buffer });
  }

  send(data: string | ArrayBufferView<ArrayBuffer>): void {
    if (typeof data === 'string') {
      const message = JSON.parse(data);
      for (const { id, channelId } of message.op === 'subscribe' ? message.subscriptions : []) {
        this.subscriptions.set(channelId, id);
        this.server.latch(this, channelId);
      }
      return;
    }
    const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
    const [serviceId, callId, size] = [view.getUint32(1, true), view.getUint32(5, true), view.getUint32(9, true)];
    const request = JSON.parse(new TextDecoder().decode(new Uint8Array(data.buffer, data.byteOffset + 13 + size)));
    queueMicrotask(() => this.answer(serviceId, callId, request));
  }

  close(): void {
    if (this.closed) return;
    this.closed = true;
    this.server.forget(this);
    this.onclose?.({ code: 1006, reason: '' });
  }

  private answer(serviceId: number, callId: number, request: unknown): void {
    let answer: unknown;
    try {
      answer = this.server.serve(this, serviceId, request);
    } catch (error) {
      this.sendText({ op: 'serviceCallFailure', serviceId, callId, message: (error as Error).message });
      return;
    }
    if (this.closed) return;
    const payload = new TextEncoder().encode(`json${JSON.stringify(answer)}`);
    const frame = new Uint8Array(13 + payload.length);
    const view = new DataView(frame.buffer);
    view.setUint8(0, 3);
    view.setUint32(1, serviceId, true);
    view.setUint32(5, callId, true);
    view.setUint32(9, 4, true);
    frame.set(payload, 13);
    this.onmessage?.({ data: frame.buffer });
  }
}
