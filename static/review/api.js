/** The review's data: JSON, packed curves, and computations that are waited for. */

const POLL_MS = 150;

/** An error that can be shown as it is. */
export class Refusal extends Error {}

/** `demo/data/…/trial-001.mcap` as part of a path; slashes stay. */
export const trialPath = (id) => `/api/review/trial/${id.split("/").map(encodeURIComponent).join("/")}`;

/**
 * Ask the server; a computation (202) is waited for.
 * @param {string} path
 * @param {{method?: string, body?: unknown, signal?: AbortSignal, progress?: (share: number) => void}} [options]
 * @returns {Promise<Response>}
 */
export async function ask(path, { method = "GET", body, signal, progress } = {}) {
  let response = await reach(path, {
    method,
    signal,
    ...(body === undefined ? {} : { body: JSON.stringify(body), headers: { "content-type": "application/json" } }),
  });
  while (response.status === 202) {
    const { job, progress: share } = await response.json();
    progress?.(share);
    try {
      await pause(POLL_MS, signal);
    } catch (error) {
      fetch(`/api/review/jobs/${job}`, { method: "DELETE" }).catch(() => {});
      throw error;
    }
    response = await reach(`/api/review/jobs/${job}`, { signal });
  }
  if (response.ok) return response;
  throw new Refusal(await reason(response));
}

async function reach(path, options) {
  try {
    return await fetch(path, options);
  } catch (error) {
    if (/** @type {Error} */ (error).name === "AbortError") throw error;
    throw new Refusal("The server does not answer. Is `hindsight review` still running?");
  }
}

async function reason(response) {
  try {
    return (await response.json()).error ?? `The server answered ${response.status}.`;
  } catch {
    return `The server answered ${response.status}.`;
  }
}

function pause(ms, signal) {
  return new Promise((resolve, reject) => {
    const timer = setTimeout(resolve, ms);
    signal?.addEventListener("abort", () => {
      clearTimeout(timer);
      reject(new DOMException("cancelled", "AbortError"));
    }, { once: true });
  });
}

/**
 * Curves as `app/review/packing.py` packs them.
 * @param {ArrayBuffer} buffer
 * @returns {{meta: any, arrays: Record<string, Float32Array>}}
 */
export function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const meta = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = {};
  meta.arrays.forEach((name, i) => {
    arrays[name] = new Float32Array(buffer, 4 + length + 4 * meta.n * i, meta.n);
  });
  return { meta, arrays };
}
