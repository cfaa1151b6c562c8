/** The page's own socket: seeks (the newest counts), commands (each is answered), and what is drawn. */

const RETRY_MS = [300, 800, 2000, 4000];

export class ReviewSocket extends EventTarget {
  /** @param {string} session */
  constructor(session) {
    super();
    this.session = session;
    /** @type {WebSocket|null} */
    this.socket = null;
    this.views = 0;
    this.status = null;
    this.tries = 0;
    this.next = 1;
    /** @type {Map<number, {resolve: () => void, reject: (error: Error) => void}>} */
    this.waiting = new Map();
    this.#open();
  }

  get ready() {
    return this.socket?.readyState === WebSocket.OPEN && this.views > 0;
  }

  /** Show a step; a wish that was overtaken before it was sent is forgotten by the server, too. */
  seek(step, view = 0) {
    if (this.ready) this.socket.send(JSON.stringify({ type: "seek", step, view }));
  }

  /** @returns {Promise<void>} kept once the view has done it */
  command(name, fields = {}) {
    if (!this.ready) return Promise.reject(new Error("the view is not there yet"));
    const id = this.next++;
    this.socket.send(JSON.stringify({ type: "command", id, name, ...fields }));
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }

  #open() {
    const socket = new WebSocket(`${location.origin.replace("http", "ws")}/review/socket/${this.session}`);
    this.socket = socket;
    socket.addEventListener("message", ({ data }) => this.#receive(JSON.parse(data)));
    socket.addEventListener("close", () => {
      this.views = 0;
      for (const { reject } of this.waiting.values()) reject(new Error("the connection was lost"));
      this.waiting.clear();
      this.#tell("lost");
      setTimeout(() => this.#open(), RETRY_MS[Math.min(this.tries++, RETRY_MS.length - 1)]);
    });
  }

  #receive(message) {
    if (message.type === "hello") {
      const before = this.views;
      this.views = message.views?.length ?? 0;
      this.tries = 0;
      this.#tell(before ? "views" : "ready");
    } else if (message.type === "status") {
      this.status = message;
      this.#tell("status");
    } else if (message.type === "ack") {
      const kept = this.waiting.get(message.id);
      this.waiting.delete(message.id);
      if (message.error) kept?.reject(new Error(message.error));
      else kept?.resolve();
    } else if (message.type === "notice" || message.type === "ended" || message.type === "error") {
      this.dispatchEvent(new CustomEvent("say", { detail: message.text ?? message.reason }));
    }
  }

  #tell(name) {
    this.dispatchEvent(new Event(name));
  }
}
