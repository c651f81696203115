/** A client of the server: connects, connects again when the connection is lost, subscribes, calls services. */

import { decoderOf, type Decoded, type Decoder } from './decoder.ts';
import {
  OP_MESSAGE_DATA,
  OP_SERVICE_RESPONSE,
  parseFrame,
  serviceRequest,
  type Channel,
  type ServerInfo,
  type ServerMessage,
  type Service,
} from './messages.ts';

/** What the connection needs of a WebSocket, so that tests can put their own in its place. */
export interface Socket {
  binaryType: string;
  onclose: ((event: { code: number; reason: string }) => void) | null;
  onmessage: ((event: { data: unknown }) => void) | null;
  send(data: string | ArrayBufferView<ArrayBuffer>): void;
  close(): void;
}

export type ConnectionState = 'connecting' | 'connected' | 'disconnected';

/** Who hears of what comes. */
export interface Listener {
  /** The state changed. `retryIn`: seconds until the next attempt, while disconnected. */
  onState(state: ConnectionState, retryIn: number): void;
  onServerInfo(info: ServerInfo): void;
  /** The server has told what it offers, channels or services. */
  onOffer(): void;
  /** A message; `time` is the sim time that the server stamped it with, seconds. */
  onMessage(channel: Channel, time: number, message: Decoded): void;
  onParameter(name: string, value: unknown): void;
  /** A notice of the server for people; an error (level 2) or a warning (1). */
  onStatus(level: number, message: string): void;
}

/** What a connection asks of its surroundings; `timer` returns a function that cancels. */
export interface Surroundings {
  open(): Socket;
  timer(seconds: number, action: () => void): () => void;
}

/** A call of a service that was refused or got lost. The message says why. */
export class CallError extends Error {}

/** Seconds between attempts to connect: the first comes soon, for a server that was restarted. */
const FIRST_RETRY = 0.5;
const LAST_RETRY = 5;
/** How long a call may take before it counts as lost, seconds: a run that holds still answers later. */
const CALL_LIMIT = 15;

interface Call {
  resolve(payload: Decoded): void;
  reject(error: CallError): void;
  cancel(): void;
}

export class Connection {
  state: ConnectionState = 'disconnected';
  private socket: Socket | null = null;
  private retry = FIRST_RETRY;
  private cancelRetry: (() => void) | null = null;
  private services = new Map<string, Service>();
  private subscriptions = new Map<number, { channel: Channel; decode: Decoder }>();
  private calls = new Map<number, Call>();
  private nextSubscription = 1;
  private nextCall = 1;
  /** Frames that could not be read. */
  unreadable = 0;

  /** @param wanted which of the offered topics to subscribe to. */
  constructor(
    private readonly surroundings: Surroundings,
    private readonly listener: Listener,
    private readonly wanted: (channel: Channel) => boolean = () => true,
  ) {}

  /** Connects now; also while it waits for the next attempt. */
  connect(): void {
    this.cancelRetry?.();
    this.cancelRetry = null;
    if (this.socket) return;
    this.setState('connecting', 0);
    let socket: Socket;
    try {
      socket = this.surroundings.open();
    } catch {
      this.scheduleRetry();
      return;
    }
    this.socket = socket;
    socket.binaryType = 'arraybuffer';
    socket.onmessage = (event) => this.take(event.data);
    socket.onclose = () => this.lose(socket);
  }

  hasService(name: string): boolean {
    return this.services.has(name);
  }

  /** Calls a service with JSON. Rejects with a CallError that says why it was refused. */
  call(name: string, request: unknown): Promise<Decoded> {
    const service = this.services.get(name);
    if (!service || !this.socket) {
      return Promise.reject(
        new CallError(this.socket ? `The server does not offer ${name}.` : 'There is no connection.'),
      );
    }
    const id = this.nextCall++;
    const payload = new TextEncoder().encode(JSON.stringify(request));
    return new Promise((resolve, reject) => {
      const cancel = this.surroundings.timer(CALL_LIMIT, () => {
        this.calls.delete(id);
        reject(new CallError(`No answer within ${CALL_LIMIT} s.`));
      });
      this.calls.set(id, { resolve, reject, cancel });
      this.socket?.send(serviceRequest(service.id, id, 'json', payload));
    });
  }

  /** Asks for values now and whenever they change. */
  watchParameters(names: readonly string[]): void {
    this.socket?.send(JSON.stringify({ op: 'getParameters', parameterNames: names }));
    this.socket?.send(JSON.stringify({ op: 'subscribeParameterUpdates', parameterNames: names }));
  }

  private setState(state: ConnectionState, retryIn: number): void {
    this.state = state;
    this.listener.onState(state, retryIn);
  }

  private scheduleRetry(): void {
    const seconds = this.retry;
    this.retry = Math.min(LAST_RETRY, this.retry * 2);
    this.setState('disconnected', seconds);
    this.cancelRetry = this.surroundings.timer(seconds, () => this.connect());
  }

  /** The connection is gone: so is all that belonged to it. */
  private lose(socket: Socket): void {
    if (this.socket !== socket) return;
    this.socket = null;
    this.services.clear();
    this.subscriptions.clear();
    for (const call of this.calls.values()) {
      call.cancel();
      call.reject(new CallError('The connection was lost before the answer came.'));
    }
    this.calls.clear();
    this.scheduleRetry();
  }

  private take(data: unknown): void {
    if (typeof data === 'string') {
      let message: ServerMessage;
      try {
        message = JSON.parse(data) as ServerMessage;
      } catch {
        this.unreadable++;
        return;
      }
      this.takeText(message);
    } else if (data instanceof ArrayBuffer) {
      this.takeFrame(data);
    }
  }

  private takeText(message: ServerMessage): void {
    switch (message.op) {
      case 'serverInfo':
        // Only a server that speaks counts as one: a port that accepts and closes is asked ever more seldom.
        this.retry = FIRST_RETRY;
        this.setState('connected', 0);
        this.listener.onServerInfo(message);
        break;
      case 'advertise':
        this.listener.onOffer();
        this.subscribe(message.channels);
        break;
      case 'advertiseServices':
        for (const service of message.services) this.services.set(service.name, service);
        this.listener.onOffer();
        break;
      case 'serviceCallFailure':
        this.finish(message.callId)?.reject(new CallError(message.message));
        break;
      case 'parameterValues':
        for (const parameter of message.parameters) this.listener.onParameter(parameter.name, parameter.value);
        break;
      case 'status':
        this.listener.onStatus(message.level, message.message);
        break;
      default:
        break;
    }
  }

  private subscribe(channels: readonly Channel[]): void {
    const subscriptions: { id: number; channelId: number }[] = [];
    for (const channel of channels) {
      if (!this.wanted(channel)) continue;
      let decode: Decoder;
      try {
        decode = decoderOf(channel);
      } catch (error) {
        this.listener.onStatus(1, String((error as Error).message));
        continue;
      }
      const id = this.nextSubscription++;
      this.subscriptions.set(id, { channel, decode });
      subscriptions.push({ id, channelId: channel.id });
    }
    if (subscriptions.length) this.socket?.send(JSON.stringify({ op: 'subscribe', subscriptions }));
  }

  private takeFrame(data: ArrayBuffer): void {
    const frame = parseFrame(data);
    if (!frame) {
      this.unreadable++;
    } else if (frame.op === OP_MESSAGE_DATA) {
      const subscription = this.subscriptions.get(frame.subscription);
      if (!subscription) return;
      let message: Decoded;
      try {
        message = subscription.decode(frame.payload);
      } catch {
        this.unreadable++;
        return;
      }
      this.listener.onMessage(subscription.channel, Number(frame.timestamp) / 1e9, message);
    } else if (frame.op === OP_SERVICE_RESPONSE) {
      const call = this.finish(frame.callId);
      try {
        call?.resolve(frame.payload.length ? (JSON.parse(new TextDecoder().decode(frame.payload)) as Decoded) : {});
      } catch {
        call?.reject(new CallError('The answer cannot be read.'));
      }
    }
  }

  private finish(id: number): Call | undefined {
    const call = this.calls.get(id);
    call?.cancel();
    this.calls.delete(id);
    return call;
  }
}
