/**
 * The picture: viser's client in an iframe of our own origin. The page reads its camera to place the
 * tags and to know which way "away" is; it draws nothing in there.
 */

/** Column-major 4×4, as three.js keeps it in `Matrix4.elements`. */
function apply(m, [x, y, z, w]) {
  return [0, 1, 2, 3].map((i) => m[i] * x + m[i + 4] * y + m[i + 8] * z + m[i + 12] * w);
}

const PLAIN = "&antialias=0&shadows=0&surroundings=0&fixedDpr=0.6";

/** Whether WebGL here is drawn by the processor, at a few frames a second with all there is to draw. */
function drawsInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl");
  if (!gl) return true;
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  const renderer = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(renderer);
}

/**
 * What to leave out of the picture: nothing, or what a browser without a graphics card cannot keep
 * up with (shadows, reflections, floor, fine pixels). `?detail=full` and `?detail=plain` overrule.
 * @param {string} search the page's own query
 */
function leftOut(search) {
  const asked = new URLSearchParams(search).get("detail");
  const plain = asked === "plain" || (asked !== "full" && drawsInSoftware());
  return plain ? PLAIN : "";
}

export class Viewer {
  /** @param {HTMLIFrameElement} frame */
  constructor(frame) {
    this.frame = frame;
    this.path = "";
  }

  /** @param {string} path the session's viewer, as `hello` names it */
  open(path) {
    if (path === this.path || !/^\/[^/\\]/.test(path)) return;
    this.path = path;
    this.frame.src = `${path}?hideViserLogo${leftOut(location.search)}`;
  }

  get window() {
    return this.frame.contentWindow;
  }

  get #scene() {
    try {
      return /** @type {any} */ (this.window)?.__viserMutable;
    } catch {
      return undefined; // an error page of the browser is not of our origin
    }
  }

  get #camera() {
    const camera = this.#scene?.camera;
    return camera?.matrixWorld?.elements && camera.matrixWorldInverse?.elements && camera.projectionMatrix?.elements ? camera : null;
  }

  /** Whether the camera can be read, and with it tags be drawn. */
  get ready() {
    return this.#camera !== null;
  }

  /**
   * Heading about world z of what is up in the picture [rad]; null while there is no picture.
   * viser shows world (x, y, z) as three.js (−y, z, −x).
   */
  yaw() {
    const camera = this.#camera;
    if (!camera) return null;
    const m = camera.matrixWorld.elements;
    // Forward and up of the camera share their heading where it looks down; the sum also has one
    // where it looks along the table or straight at it.
    const x = m[10] - m[6];
    const y = m[8] - m[4];
    return Math.hypot(x, y) > 1e-6 ? Math.atan2(y, x) : null;
  }

  /**
   * Where a scene node stands in the picture.
   * @param {string} name
   * @returns {[number, number]|null} pixels from the top left; null where it is not to be seen
   */
  project(name) {
    const camera = this.#camera;
    const node = this.#scene?.nodeRefFromName?.[name]?.matrixWorld?.elements;
    if (!camera || !node) return null;
    const seen = apply(camera.matrixWorldInverse.elements, [node[12], node[13], node[14], 1]);
    const [x, y, , w] = apply(camera.projectionMatrix.elements, seen);
    if (!(w > 0)) return null;
    const { clientWidth, clientHeight } = this.frame;
    const [left, top] = [((x / w + 1) / 2) * clientWidth, ((1 - y / w) / 2) * clientHeight];
    return left >= 0 && left <= clientWidth && top >= 0 && top <= clientHeight ? [left, top] : null;
  }
}
