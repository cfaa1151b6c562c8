/**
 * The websocket to the server: it reconnects by itself, and numbers inputs and commands on end, so
 * that the robot can refuse what is stale and the trial goes on where it was.
 */

const PING_EVERY = 1000; // [ms]
const SILENT_AFTER = 4000; // no message for so long means a dead line [ms]
const GIVE_UP_AFTER = 75_000; // the server ends a session a minute after its page went [ms]
const SPARE = 1000; // numbers left for what is sent between storing the last one and leaving
const BACKOFF = [250, 500, 1000, 2000, 3000, 5000]; // [ms]

export class Socket {
  /**
   * @param {string} url
   * @param {{message: (m: any) => void, change: (c: Partial<import("./types.js").Connection>) => void,
   *          lost: (pending: string[]) => void}} listener
   */
  constructor(url, listener) {
    this.url = url;
    this.listener = listener;
    this.sequence = restoreSequence();
    this.commandId = 0;
    /** @type {Map<number, {name: string, done: (error: string|null) => void}>} */
    this.pending = new Map();
    this.attempts = 0;
    this.downSince = performance.now();
    this.rtt = null;
    this.heardAt = 0;
    this.ended = false;
    addEventListener("pagehide", () => saveSequence(this.sequence));
    setInterval(() => this.#beat(), PING_EVERY);
    this.connect();
  }

  get open() {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  /** Open the line now; also the person's "Try now". */
  connect() {
    clearTimeout(this.timer);
    if (this.ended || this.open) return;
    this.#drop();
    this.listener.change({ retryAt: null });
    const socket = new WebSocket(this.url);
    this.socket = socket;
    this.heardAt = performance.now();
    socket.onmessage = (event) => socket === this.socket && this.#receive(event.data);
    socket.onclose = (event) => socket === this.socket && this.#closed(event);
  }

  /** @param {Omit<import("./types.js").InputMessage, "type"|"seq">} fields */
  sendInput(fields) {
    this.#send({ type: "input", seq: ++this.sequence, ...fields });
  }

  /** A page event: blur, focus, hidden, visible. */
  sendEvent(name) {
    this.#send({ type: "event", name });
  }

  /**
   * @param {string} name
   * @param {Record<string, unknown>} [fields]
   * @returns {Promise<string|null>} the robot's objection, or null where it was done
   */
  command(name, fields = {}) {
    if (!this.open) return Promise.resolve("There is no connection to the robot.");
    const id = ++this.commandId;
    return new Promise((done) => {
      this.pending.set(id, { name, done });
      this.#send({ type: "command", id, name, ...fields });
    });
  }

  #send(message) {
    if (this.open) this.socket.send(JSON.stringify(message));
  }

  #receive(text) {
    this.heardAt = performance.now();
    let message;
    try {
      message = JSON.parse(text);
    } catch {
      return; // half a message of a dying worker; the next status says all
    }
    if (typeof message !== "object" || message === null) return;
    if (message.type === "hello") {
      this.attempts = 0;
      this.listener.change({ state: "connected", before: true, retryAt: null, reason: "" });
    }
    if (message.type === "pong") {
      this.rtt = Math.max(0, clock() - message.t);
      this.listener.change({ rtt: this.rtt });
    } else if (message.type === "ack") {
      this.pending.get(message.id)?.done(message.error ?? null);
      this.pending.delete(message.id);
    } else {
      if (message.type === "ended") this.#end(message.reason);
      this.listener.message(message);
    }
  }

  #beat() {
    if (!this.open) return;
    if (performance.now() - this.heardAt > SILENT_AFTER) {
      const socket = this.socket;
      socket.onclose = null; // a dead line may take minutes to say so
      socket.close();
      this.#closed({ code: 1006, reason: "" });
      return;
    }
    this.#send({ type: "ping", t: clock(), rtt: this.rtt ?? 0 });
  }

  #closed({ code, reason }) {
    this.socket = undefined;
    const waiting = [...this.pending.values()];
    this.pending.clear();
    for (const { done } of waiting) done(null);
    if (waiting.length) this.listener.lost(waiting.map((command) => command.name));
    if (this.ended) return;
    if (this.attempts === 0) this.downSince = performance.now();
    // Codes from 4000 on are the server's own verdict: trying again would not change it.
    if (code >= 4000 || performance.now() - this.downSince > GIVE_UP_AFTER) return this.#end(reason);
    const wait = BACKOFF[Math.min(this.attempts++, BACKOFF.length - 1)] * (0.8 + 0.4 * Math.random());
    this.listener.change({ state: "reconnecting", retryAt: performance.now() + wait, rtt: null });
    this.timer = setTimeout(() => this.connect(), wait);
  }

  #end(reason) {
    this.ended = true;
    clearTimeout(this.timer);
    this.listener.change({ state: "lost", retryAt: null, rtt: null, reason: String(reason ?? "") });
    this.#drop();
  }

  #drop() {
    if (!this.socket) return;
    this.socket.onclose = null;
    this.socket.close();
    this.socket = undefined;
  }
}

/** A clock that never steps back: `now` of performance.now() on the wall clock of the page's start [ms]. */
export function clock(now = performance.now()) {
  return performance.timeOrigin + now;
}

function restoreSequence() {
  try {
    return Number(sessionStorage.getItem("hindsight.sequence")) || 0;
  } catch {
    return 0;
  }
}

function saveSequence(sequence) {
  try {
    sessionStorage.setItem("hindsight.sequence", String(sequence + SPARE));
  } catch {
    // Without storage a reload starts at one, as a new client.
  }
}
