/** A video that is made of what a canvas shows, picture by picture. */

import {
  BufferTarget,
  CanvasSource,
  Mp4OutputFormat,
  Output,
  QUALITY_HIGH,
  WebMOutputFormat,
  getFirstEncodableVideoCodec,
  type VideoCodec,
} from 'mediabunny';

export interface Film {
  /** What the name of its file ends in. */
  readonly ending: string;
  /** What the encoder has made so far. */
  readonly bytes: number;
  /** Whether the times of pictures are those that add() says, and not those of the wall at which it was called. */
  readonly timed: boolean;
  /**
   * Adds what the canvas shows now.
   * @param time, duration since the video's beginning, seconds; times go up.
   * @returns once the encoder has room for the next picture.
   */
  add(time: number, duration: number): Promise<void>;
  /** The file. */
  finish(): Promise<Blob>;
}

/** Of the codecs that a browser has, the one that most players know. */
const CODECS: VideoCodec[] = ['avc', 'vp9', 'vp8', 'av1'];
/** Bits a second where the times of the wall count. */
const BITS = 8_000_000;

/**
 * Encodes by WebCodecs, by which each picture has the time that it shall have. Where the browser has none, as on a page
 * that came from another machine without encryption, by a MediaRecorder, which has pictures last as long as they were there.
 * @throws Error if the browser encodes no video at all.
 */
export async function beginFilm(canvas: HTMLCanvasElement): Promise<Film> {
  const { width, height } = canvas;
  const codec =
    typeof VideoEncoder === 'undefined'
      ? null
      : await getFirstEncodableVideoCodec(CODECS, { width, height, quality: QUALITY_HIGH });
  if (codec) {
    const film = new EncodedFilm(canvas, codec);
    await film.start();
    return film;
  }
  if (typeof MediaRecorder === 'undefined') throw new Error('This browser encodes no video.');
  return new StreamFilm(canvas);
}

class EncodedFilm implements Film {
  readonly ending: string;
  readonly timed = true;
  bytes = 0;
  private readonly target = new BufferTarget();
  private readonly output: Output;
  private readonly source: CanvasSource;

  constructor(canvas: HTMLCanvasElement, codec: VideoCodec) {
    const mp4 = codec === 'avc';
    this.ending = mp4 ? 'mp4' : 'webm';
    const format = mp4 ? new Mp4OutputFormat({ fastStart: 'in-memory' }) : new WebMOutputFormat();
    this.output = new Output({ format, target: this.target });
    this.source = new CanvasSource(canvas, {
      codec,
      quality: QUALITY_HIGH,
      onEncodedPacket: (packet) => (this.bytes += packet.byteLength),
    });
    this.output.addVideoTrack(this.source);
  }

  async start(): Promise<void> {
    await this.output.start();
  }

  async add(time: number, duration: number): Promise<void> {
    await this.source.add(time, duration);
  }

  async finish(): Promise<Blob> {
    await this.output.finalize();
    return new Blob([this.target.buffer ?? new ArrayBuffer(0)], { type: `video/${this.ending}` });
  }
}

class StreamFilm implements Film {
  readonly ending: string;
  readonly timed = false;
  bytes = 0;
  private readonly parts: Blob[] = [];
  private readonly recorder: MediaRecorder;

  constructor(canvas: HTMLCanvasElement) {
    const type = ['video/webm;codecs=vp9', 'video/webm', 'video/mp4'].find((t) => MediaRecorder.isTypeSupported(t));
    this.recorder = new MediaRecorder(canvas.captureStream(), { mimeType: type, videoBitsPerSecond: BITS });
    this.ending = this.recorder.mimeType.includes('mp4') ? 'mp4' : 'webm';
    this.recorder.addEventListener('dataavailable', ({ data }) => {
      this.parts.push(data);
      this.bytes += data.size;
    });
    // A part a second, so that it is known how much there is.
    this.recorder.start(1000);
  }

  async add(): Promise<void> {
    // The stream takes up by itself what is drawn.
  }

  async finish(): Promise<Blob> {
    await new Promise((done) => {
      this.recorder.addEventListener('stop', done, { once: true });
      this.recorder.stop();
    });
    for (const track of this.recorder.stream.getTracks()) track.stop();
    // It encodes beside the page, and on a busy machine has not begun when a short recording ends.
    if (!this.bytes) throw new Error('the browser has encoded no picture of it. Record for longer.');
    return new Blob(this.parts, { type: `video/${this.ending}` });
  }
}
