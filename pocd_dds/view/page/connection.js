// The link to pocd_view: messages of pieces in, wishes out; connects again by itself.
import { attach, openSocket } from "./socket.js";

const kJson = 1, kTile = 2, kChunk = 3, kChunkDone = 4;
const kSilence = 4000;  // a status comes every second [ms]

/** Bytes behind the number of a message: a raw deflate stream. */
async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Response(stream).arrayBuffer();
}

/** The surface in the body of a piece; null when it is gone. */
function surfaceOf(buffer, at) {
  const [vertices, indices, owners] = new Uint32Array(buffer, at, 3);
  if (vertices === 0) return null;
  let next = at + 12;
  const ownerIds = new Uint32Array(buffer, next, owners);
  next += 4 * owners;
  const vertexBytes = new Uint8Array(buffer, next, 12 * vertices);
  next += 12 * vertices;
  const index = vertices > 65535 ? new Uint32Array(buffer, next, indices) : new Uint16Array(buffer, next, indices);
  // Copies: the message's buffer is not kept.
  return { vertices, owners: ownerIds.slice(), bytes: vertexBytes.slice(), index: index.slice() };
}

function* piecesOf(buffer) {
  const text = new TextDecoder();
  for (let at = 0; at + 24 <= buffer.byteLength;) {
    const [kind, bytes] = new Uint32Array(buffer, at, 2);
    const [x, y, z, run] = new Int32Array(buffer, at + 8, 4);
    const body = at + 24;
    if (kind === kJson) yield { kind: "json", json: JSON.parse(text.decode(new Uint8Array(buffer, body, bytes))) };
    if (kind === kTile) yield { kind: "tile", x, y, z, run, surface: surfaceOf(buffer, body) };
    if (kind === kChunk) yield { kind: "chunk", x, y, z, run, surface: surfaceOf(buffer, body) };
    if (kind === kChunkDone) yield { kind: "done", x, y, z };
    at = body + bytes;
  }
}

export class Connection {
  /** `use(piece)` gets what comes; `said(state)` gets "open", "silent" or "closed" when that changes. */
  constructor(use, said) {
    this.ended = false;
    this.beats = true;  // a status comes every second: not of recordings and memories
    this.use = use;
    this.said = said;
    this.state = "closed";
    this.retry = 500;
    this.heard = 0;
    this.bytes = 0;
    this.wishes = new Map();  // what is asked again after a new connection
    this.watching = setInterval(() => this.watch(), 500);
    document.addEventListener("visibilitychange", () => this.watch());
    this.connect();
  }

  tell(state) {
    if (state === this.state) return;
    this.state = state;
    this.said(state);
  }

  connect() {
    const opened = openSocket(), { socket } = opened;
    this.socket = socket;
    this.heard = Date.now();
    let chain = Promise.resolve();
    const onopen = () => {
      this.retry = 500;
      this.use({ kind: "json", json: { type: "reset" } });
      for (const [name, value] of this.wishes) this.send({ [name]: value });
      this.tell("open");
    };
    const onmessage = (message) => {
      this.heard = Date.now();
      this.bytes += message.data.byteLength;
      this.tell("open");
      // One after the other, and each is acknowledged when it was used: the server does not run ahead.
      chain = chain.then(async () => {
        const number = new DataView(message.data).getUint32(0, true);
        for (const piece of piecesOf(await inflated(new Uint8Array(message.data, 4)))) this.use(piece);
        if (socket === this.socket) this.send({ ack: number });
      }).catch((error) => {
        console.error("message not read", error);
        socket.close();
      });
    };
    const onclose = () => {
      if (socket !== this.socket || this.ended) return;
      this.tell("closed");
      setTimeout(() => this.connect(), this.retry);
      this.retry = Math.min(2 * this.retry, 5000);
    };
    // Not before who made this connection is ready for what has come already.
    queueMicrotask(() => attach(opened, { onopen, onmessage, onclose }));
  }

  watch() {
    if (!this.beats || this.socket.readyState !== WebSocket.OPEN || Date.now() - this.heard < kSilence) return;
    this.tell("silent");
    if (Date.now() - this.heard > 5 * kSilence) this.socket.close();
  }

  end() {
    this.ended = true;
    clearInterval(this.watching);
    this.socket.close();
  }

  send(wish) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(wish));
  }

  /** Sent now, and again whenever the connection is made anew. */
  wish(name, value) {
    this.wishes.set(name, value);
    this.send({ [name]: value });
  }
}
