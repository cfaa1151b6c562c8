/** Asking the server: state of the participation, and what the page wants done. */

const AGAIN = [500, 1000, 2000, 4000]; // waits before asking once more [ms]

/**
 * @typedef {{state?: any, error?: string, items?: Record<string, string>, erased?: string[], status: number}} Answer
 */

/** @returns {Promise<Answer>} */
export function getState() {
  return ask({ method: "GET" });
}

/**
 * A server that is restarted, or a line that drops, is asked again: doing a thing twice is harmless.
 * @param {Record<string, unknown>} wish
 * @returns {Promise<Answer>}
 */
export function want(wish) {
  return ask({ method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(wish) });
}

async function ask(options) {
  for (let tried = 0; ; tried++) {
    try {
      const response = await fetch("/api/study", { ...options, cache: "no-store", credentials: "same-origin" });
      const answer = await response.json();
      if (response.status !== 503 || tried >= AGAIN.length) return { ...answer, status: response.status };
    } catch {
      if (tried >= 30) return { error: "The server does not answer. Please check your connection.", status: 0 };
    }
    await new Promise((done) => setTimeout(done, AGAIN[Math.min(tried, AGAIN.length - 1)]));
  }
}

/** A random number of this browser tab, kept over reloads: the server takes a consent once. */
export function requestNumber() {
  const made = crypto.randomUUID?.() ?? Array.from(crypto.getRandomValues(new Uint8Array(16)), (b) => b.toString(16).padStart(2, "0")).join("");
  try {
    const known = sessionStorage.getItem("hindsight.study.request");
    if (!known) sessionStorage.setItem("hindsight.study.request", made);
    return known ?? made;
  } catch {
    return made; // without storage a reload asks for consent again
  }
}
