/** The page's one state. Parts read it in their render; whoever learns something updates it. */

export class Store extends EventTarget {
  /** @param {import("./types.js").State} state */
  constructor(state) {
    super();
    this.state = state;
    /** @type {Map<string, {value: unknown, until: number}>} */
    this.wishes = new Map();
  }

  /** @param {Partial<import("./types.js").State>} changes */
  update(changes) {
    this.state = { ...this.state, ...changes };
    this.dispatchEvent(new Event("change"));
  }

  /**
   * Remember what the person just chose, so that a switch does not jump back until the robot's next
   * status confirms it.
   */
  wish(key, value) {
    this.wishes.set(key, { value, until: performance.now() + 1000 });
    this.dispatchEvent(new Event("change"));
  }

  /** What to show for `key`: the fresh wish, or what the robot reports. */
  shown(key, actual) {
    const wish = this.wishes.get(key);
    if (!wish) return actual;
    if (wish.value === actual || performance.now() > wish.until) {
      this.wishes.delete(key);
      return actual;
    }
    return wish.value;
  }
}

/** @returns {import("./types.js").State} */
export function initialState() {
  return {
    connection: { state: "reconnecting", before: false, retryAt: null, reason: "", rtt: null },
    hello: null,
    status: null,
    axes: [0, 0, 0, 0],
    mode: "translate",
    device: { kind: "pointer", name: "On-screen sticks" },
    yaw: 0,
    viewYaw: 0,
    follow: true,
    theme: "dark",
    drawer: false,
    menu: false,
    layersOpen: false,
    coach: false,
    notices: [],
  };
}
