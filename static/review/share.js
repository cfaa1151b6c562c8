/** Taking a trial elsewhere: one HTML file, a picture, a film, a link. */

import { byId, h, setText } from "../dom.js";
import { ask, trialPath } from "./api.js";

const FILM_FPS = 30;
const FILM_BITS = 6_000_000;
const LAST_FRAME_MS = 400;

export function createShare(page) {
  const name = (ending) => {
    const { meta } = page.trial;
    return `${meta.participant}-trial-${String(meta.trial).padStart(3, "0")}${ending}`;
  };

  const save = (blob, filename) => {
    const link = /** @type {HTMLAnchorElement} */ (h("a", { href: URL.createObjectURL(blob), download: filename }));
    document.body.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
  };

  const state = h("p", { class: "cap", role: "status" });
  const tell = (text) => setText(state, text);

  const guarded = (act) => async (event) => {
    const button = event.currentTarget;
    button.disabled = true;
    try {
      await act();
    } catch (error) {
      tell(/** @type {Error} */ (error).message);
    } finally {
      button.disabled = false;
    }
  };

  const html = async () => {
    tell("Writing the file …");
    const response = await ask(`${trialPath(page.trial.meta.id)}/share`, { method: "POST", body: { theme: page.theme }, progress: (share) => tell(`Writing the file … ${Math.round(100 * share)} %`) });
    save(await response.blob(), name(".html"));
    tell("Saved. It plays from disk in any browser.");
  };

  const view = () => {
    const found = page.views.picture;
    if (!found) throw new Error("The 3-D view is not there yet.");
    return found;
  };

  const picture = async () => {
    save(await still(view()), name(`-${page.player.seconds.toFixed(2)}s.png`));
    tell("Saved the view.");
  };

  /** Plays the trial from here and records what is seen. */
  const film = async () => {
    const type = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"].find((kind) => globalThis.MediaRecorder?.isTypeSupported(kind));
    if (!type) throw new Error("This browser cannot record WebM.");
    const inside = view();
    const recorder = new MediaRecorder(inside.canvas.captureStream(FILM_FPS), { mimeType: type, videoBitsPerSecond: FILM_BITS });
    const parts = [];
    recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
    const stopped = new Promise((resolve) => recorder.addEventListener("stop", resolve, { once: true }));
    recorder.start(500);
    tell("Recording; pause to end.");
    inside.requestRender?.(); // a picture at rest sends no frame
    page.player.play();
    await new Promise((resolve) => {
      const over = () => {
        if (page.player.playing) return;
        page.player.removeEventListener("played", over);
        resolve(null);
      };
      page.player.addEventListener("played", over);
    });
    await new Promise((resolve) => setTimeout(resolve, LAST_FRAME_MS));
    recorder.stop();
    await stopped;
    if (!parts.some(({ size }) => size > 0)) throw new Error("The view drew no frame to record.");
    save(new Blob(parts, { type: "video/webm" }), name(".webm"));
    tell("Saved the film.");
  };

  const link = async () => {
    const wish = new URLSearchParams({ trial: page.trial.meta.id, t: page.player.seconds.toFixed(2) });
    const url = `${location.origin}/review#${wish}`;
    field.hidden = false;
    field.value = url;
    field.select();
    // A page that did not come over TLS or from this machine has no clipboard.
    const copied = navigator.clipboard?.writeText(url) ?? Promise.reject(new Error());
    await copied.then(() => tell("Copied."), () => tell("Copy the link above."));
  };

  const field = /** @type {HTMLInputElement} */ (h("input", { type: "text", readonly: true, hidden: true, "aria-label": "Link to this moment", dataset: { testid: "share-url" } }));
  const button = (label, id, act) => h("button", { type: "button", class: "btn line small", dataset: { testid: id }, on: { click: guarded(act) } }, label);
  byId("share").append(
    h("h2", {}, "Share"),
    button("One HTML file of the trial", "share-html", html),
    button("PNG of the view", "share-png", picture),
    button("WebM from here on", "share-webm", film),
    button("Link to this moment", "share-link", link),
    field,
    state,
  );
  page.pops.add("share-open", "share");
}

/** What the view shows: drawn once more, because a WebGL canvas is empty outside of a frame. */
function still({ canvas, scene }) {
  const state = scene?.__r3f?.root?.getState?.();
  if (!state?.gl) throw new Error("This version of the viewer gives no picture; use the browser's own screenshot.");
  state.gl.render(state.scene, state.camera);
  return new Promise((resolve, reject) => canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("The picture could not be encoded."))), "image/png"));
}
