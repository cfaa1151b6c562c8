/** Frame-rate dips, told to the robot so that they are recorded with the trial. */

const LOOK_EVERY = 1000; // [ms]
const LOW = 15; // [Hz]
const FINE = 22; // [Hz]

/** @param {(name: "frames_low"|"frames_ok") => void} tell */
export function watchFrames(tell) {
  let count = 0;
  let from = performance.now();
  let low = false;
  const step = () => {
    requestAnimationFrame(step);
    count += 1;
    const now = performance.now();
    if (now - from < LOOK_EVERY) return;
    const rate = (1000 * count) / (now - from);
    const hidden = document.hidden || now - from > 5 * LOOK_EVERY;
    count = 0;
    from = now;
    if (hidden || (low ? rate < FINE : rate >= LOW)) return;
    low = !low;
    tell(low ? "frames_low" : "frames_ok");
  };
  requestAnimationFrame(step);
}
