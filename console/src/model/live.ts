/** The one connection to the program: its state, pictures and shapes as they come, and what it is asked for. */
import {type KeptState, type Phase, type MapState, type Row, type RunState, rowOf, type SceneState, type SourceState} from './types';
import {parseShape, type Shape} from './shape';

export interface LiveState {
  connected: boolean;
  lostSince: number | null;
  phase: Phase;
  sentence: string;
  stages: [string, number][];
  scene: SceneState | null;
  source: SourceState | null;
  map: MapState | null;
  run: RunState | null;
  kept: KeptState | null;
  mayOpenLive: boolean;
  rows: Row[];
  roundTrip_ms: number;
}

export interface LivePicture {
  bitmap: ImageBitmap;
  frame: number;
  /** Since both pictures of the frame were decoded (of a live source: since its stamp), when it came here. */
  ageAtArrival_ms: number;
  arrived: number;
}

const kAgain_ms = 700;
const kPing_ms = 2000;
const kPictureKind = 1;

type Reply = {resolve: () => void; reject: (error: Error) => void};

class Live {
  state: LiveState = {
    connected: false, lostSince: performance.now(), phase: 'idle', sentence: '', stages: [], scene: null, source: null,
    map: null, run: null, kept: null, mayOpenLive: false, rows: [], roundTrip_ms: 0,
  };
  picture: LivePicture | null = null;
  shape: Shape | null = null;
  /** Times at which the last pictures were drawn, for the frame rate. */
  drawn: number[] = [];

  private socket: WebSocket | null = null;
  private listeners = new Set<() => void>();
  private replies = new Map<number, Reply>();
  private nextId = 1;
  private wants = {picture: false, shape: false};
  private isDecoding = false;
  private waiting: ArrayBuffer | null = null;
  private willTell = false;

  start() {
    this.connect();
    setInterval(() => this.send({ping: performance.now()}), kPing_ms);
  }

  listen(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  /** Fails with the program's own sentence. */
  ask(what: string, fields: object = {}): Promise<void> {
    return new Promise((resolve, reject) => {
      const id = this.nextId++;
      if (!this.send({id, ask: what, ...fields})) return reject(new Error('The program does not answer.'));
      this.replies.set(id, {resolve, reject});
    });
  }

  view(wants: {picture: boolean; shape: boolean}) {
    this.wants = wants;
    this.send({view: wants});
  }

  private send(message: object): boolean {
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  private connect() {
    const socket = new WebSocket(`ws://${location.host}/live`);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    socket.onopen = () => this.send({view: this.wants});
    socket.onmessage = (event) => {
      if (typeof event.data === 'string') this.takeText(JSON.parse(event.data));
      else this.takeBytes(event.data as ArrayBuffer);
    };
    socket.onclose = () => {
      for (const reply of this.replies.values()) reply.reject(new Error('The program does not answer.'));
      this.replies.clear();
      if (this.state.connected) this.change({connected: false, lostSince: performance.now()});
      setTimeout(() => this.connect(), kAgain_ms);
    };
  }

  private takeText(message: Record<string, unknown>) {
    if ('pong' in message) return this.change({roundTrip_ms: performance.now() - Number(message['pong'])});
    if ('reply' in message) {
      const reply = this.replies.get(Number(message['reply']));
      this.replies.delete(Number(message['reply']));
      if (message['error']) reply?.reject(new Error(String(message['error'])));
      else reply?.resolve();
      return;
    }
    if (!('phase' in message)) return;
    const next: Partial<LiveState> = {connected: true, lostSince: null, mayOpenLive: message['may_open_live'] === true};
    for (const key of ['phase', 'sentence', 'stages', 'scene', 'source', 'map', 'run', 'kept'] as const)
      if (key in message) (next as Record<string, unknown>)[key] = message[key];
    if (!message['run']) next.rows = [];
    if (Array.isArray(message['rows'])) {
      const before = message['rows_from'] === 0 ? [] : this.state.rows;
      const rows = message['rows'].map(rowOf);
      next.rows = rows.length || before !== this.state.rows ? [...before, ...rows] : before;
      if (message['rows_from'] === 0 && !this.state.run?.over) this.drawn = [];
    }
    this.change(next);
  }

  private takeBytes(bytes: ArrayBuffer) {
    if (new DataView(bytes).getUint32(0, true) === kPictureKind) {
      this.waiting = bytes;
      void this.decodeNewest();
    } else {
      this.shape = parseShape(bytes.slice(16));
      this.tell();
    }
  }

  /** One picture at a time: while it is decoded only the newest waits. */
  private async decodeNewest() {
    if (this.isDecoding) return;
    this.isDecoding = true;
    while (this.waiting) {
      const bytes = this.waiting;
      this.waiting = null;
      const head = new DataView(bytes);
      const arrived = performance.now();
      try {
        const bitmap = await createImageBitmap(new Blob([bytes.slice(16)], {type: 'image/jpeg'}));
        this.picture?.bitmap.close();
        this.picture = {bitmap, frame: head.getInt32(4, true), ageAtArrival_ms: head.getFloat64(8, true), arrived};
        this.drawn = [...this.drawn.slice(-30), performance.now()];
        this.tell();
      } catch {
        // A picture that does not decode is followed by the next one; its age shows meanwhile.
      }
    }
    this.isDecoding = false;
  }

  private change(next: Partial<LiveState>) {
    this.state = {...this.state, ...next};
    this.tell();
  }

  /** At most once per drawn frame; a hidden page is told later. */
  private tell() {
    if (this.willTell) return;
    this.willTell = true;
    const now = () => {
      this.willTell = false;
      for (const listener of this.listeners) listener();
    };
    if (document.hidden) setTimeout(now, 200);
    else requestAnimationFrame(now);
  }
}

export const live = new Live();
