// Runs before viser's client in the viewer's frame.
(() => {
  "use strict";
  const query = new URLSearchParams(location.search);
  const root = document.documentElement;

  // The ground behind the canvas follows the page's theme.
  const setTheme = (theme) => { root.dataset.theme = theme === "light" ? "light" : "dark"; };
  setTheme(query.get("theme"));
  if (parent !== window) {
    const outer = parent.document.documentElement;
    const follow = () => setTheme(outer.dataset.theme);
    follow();
    new MutationObserver(follow).observe(outer, { attributeFilter: ["data-theme"] });
  }

  // viser reconnects only while its own document has focus, which the page around it holds.
  document.hasFocus = () => true;

  // viser loads a sorter of Gaussian splats that compiles text to code, which the frame's policy
  // forbids. Nothing of ours is a splat; the failed promise need not look like a fault.
  addEventListener("unhandledrejection", (event) => {
    if (event.reason instanceof EvalError) event.preventDefault();
  });

  // A click into the view takes the keyboard: hand every key to the page instead. viser's own
  // shortcuts would move the camera. Tab stays, so that the keyboard can leave the frame.
  const forward = (event) => {
    if (event.key === "Tab") return;
    event.stopImmediatePropagation();
    if (!event.ctrlKey && !event.metaKey && !event.altKey) event.preventDefault();
    if (parent === window) return;
    parent.postMessage({
      type: event.type,
      key: event.key,
      code: event.code,
      repeat: event.repeat,
      altKey: event.altKey,
      ctrlKey: event.ctrlKey,
      metaKey: event.metaKey,
      shiftKey: event.shiftKey,
    }, location.origin);
  };
  addEventListener("keydown", forward, true);
  addEventListener("keyup", forward, true);

  // What a browser without a graphics card leaves out: ?antialias=0, ?shadows=0, ?surroundings=0.
  const plain = query.get("antialias") === "0";
  const shadowless = query.get("shadows") === "0";
  const bare = query.get("surroundings") === "0";
  if (plain) {
    for (const Canvas of [HTMLCanvasElement, globalThis.OffscreenCanvas]) {
      if (!Canvas) continue;
      const original = Canvas.prototype.getContext;
      Canvas.prototype.getContext = function getContext(kind, options) {
        const webgl = kind === "webgl2" || kind === "webgl";
        return original.call(this, kind, webgl ? { ...options, antialias: false } : options);
      };
    }
  }
  const leaveOut = (scene) => {
    if (bare) {
      scene.environment = null;
      const floor = globalThis.__viserMutable.nodeRefFromName["/hindsight/floor"];
      if (floor) floor.visible = false;
    }
    scene.traverse((node) => {
      if (shadowless && node.isLight) node.castShadow = false;
      // The sky stands in for the reflections of the surroundings.
      if (bare && node.isHemisphereLight) node.intensity = Math.max(node.intensity, 1.6);
    });
  };
  if (shadowless || bare) {
    // Lights come and go with the scene, so look again now and then.
    setInterval(() => {
      const scene = globalThis.__viserMutable && globalThis.__viserMutable.scene;
      if (scene) leaveOut(scene);
    }, 250);
  }
})();
