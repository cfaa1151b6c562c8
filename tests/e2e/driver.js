// A person at the sticks: looks at where the hand and the object are (the page's own figures),
// pushes the sticks accordingly, and presses Grasp when the hand is around the object.
// It knows nothing of the server, the assistance or the grasp poses.
window.driver = (() => {
  const $ = (id) => document.querySelector(`[data-testid="${id}"]`);
  const look = (id) => ['x', 'y', 'z'].map((k) => Number($(id).dataset[k]));
  const clip = (v, limit = 1) => Math.max(-limit, Math.min(limit, v));
  const frame = () => new Promise((done) => setTimeout(done, 25));
  const held = {};

  function pointer(id, kind, x, y) {
    const stick = $(id);
    const box = stick.getBoundingClientRect();
    const reach = 0.3 * box.width;  // the knob's travel
    stick.dispatchEvent(new PointerEvent(kind, {
      bubbles: true, cancelable: true, isPrimary: true, pointerType: 'touch',
      pointerId: id === 'stick-left' ? 11 : 12, button: 0, buttons: kind === 'pointerup' ? 0 : 1,
      clientX: box.x + box.width / 2 + reach * x, clientY: box.y + box.height / 2 - reach * y,
    }));
  }

  function push(id, x, y) {
    if (!held[id]) { pointer(id, 'pointerdown', 0, 0); held[id] = true; }
    pointer(id, 'pointermove', x, y);
  }

  function release(id) {
    if (held[id]) { pointer(id, 'pointerup', 0, 0); held[id] = false; }
  }

  // How the three ways of input carry "right, away, up", each in [-1, 1].
  const devices = {
    sticks: {
      steer: (right, away, up) => { push('stick-right', right, away); push('stick-left', 0, up); },
      rest: () => { release('stick-right'); release('stick-left'); },
      grasp: () => $('grasp').click(),
    },
    gamepad: {
      steer: (right, away, up) => { window.pad.axes = [0, -up, right, -away]; },
      rest: () => { window.pad.axes = [0, 0, 0, 0]; },
      grasp: async () => {
        window.pad.buttons[0] = { pressed: true, touched: true, value: 1 };
        for (let i = 0; i < 8; i++) await frame();
        window.pad.buttons[0] = { pressed: false, touched: false, value: 0 };
      },
    },
    keyboard: (() => {
      const down = new Set();
      const key = (kind, code) => document.body.dispatchEvent(new KeyboardEvent(kind, {
        code, key: code === 'Space' ? ' ' : code.slice(3).toLowerCase(), bubbles: true, cancelable: true,
      }));
      const set = (code, on) => {
        if (on && !down.has(code)) { down.add(code); key('keydown', code); }
        if (!on && down.has(code)) { down.delete(code); key('keyup', code); }
      };
      // A key is all or nothing: tap in proportion to the error, as people do.
      let tick = 0;
      const tap = (value) => Math.abs(value) > 0.08 && (tick % 6) / 6 < Math.abs(value);
      return {
        steer: (right, away, up) => {
          tick += 1;
          set('KeyD', right > 0 && tap(right)); set('KeyA', right < 0 && tap(right));
          set('KeyW', away > 0 && tap(away)); set('KeyS', away < 0 && tap(away));
          set('KeyR', up > 0 && tap(up)); set('KeyF', up < 0 && tap(up));
        },
        rest: () => { for (const code of [...down]) set(code, false); },
        grasp: () => { key('keydown', 'Space'); key('keyup', 'Space'); },
      };
    })(),
  };

  /** Steer to the object and close the hand; resolves to the trial's outcome. */
  async function grasp(name, { device = 'sticks', seconds = 60 } = {}) {
    const { steer, rest, grasp: close } = devices[device];
    const ends = performance.now() + 1000 * seconds;
    let settled = 0;
    let aligned = false;
    let seen = '';  // the last figures of the hand, and when they changed
    let seenAt = performance.now();
    let pace = 0.05;  // [s] between two looks, on average
    while ($('trial').dataset.outcome === 'running' && performance.now() < ends) {
      const hand = look('hand');
      if (hand.join() !== seen) {
        pace += 0.3 * ((performance.now() - seenAt) / 1000 - pace);
        [seen, seenAt] = [hand.join(), performance.now()];
      }
      // Whoever sees the hand jump pushes less: no more than 2 cm between two looks.
      const reach = Math.max(0.3, Math.min(1, 0.02 / (0.2 * pace)));  // well beyond the dead zone
      const object = look(`object-${name}`);
      const [dx, dy, dz] = object.map((value, i) => value - hand[i]);
      // First beside and behind the object, then straight in.
      if (Math.abs(dy) < 0.012 && Math.abs(dz) < 0.02) aligned = true;
      if (Math.abs(dy) > 0.03 && dx > 0.05) aligned = false;
      const forward = aligned ? dx : Math.min(0, dx - 0.16);
      const gain = 9;
      const [ex, ey, ez] = [clip(gain * forward), clip(gain * dy), clip(gain * dz)];
      const yaw = Number($('compass').dataset.yaw);
      const away = ex * Math.cos(yaw) + ey * Math.sin(yaw);
      const right = ex * Math.sin(yaw) - ey * Math.cos(yaw);
      if (aligned && Math.hypot(dx, dy) < 0.012 && Math.abs(dz) < 0.03) {
        rest();
        settled += 1;
        if (settled > 6) { await close(); break; }
      } else {
        settled = 0;
        steer(clip(right, reach), clip(away, reach), clip(ez, reach));
      }
      await frame();
    }
    rest();
    while ($('trial').dataset.outcome === 'running' && performance.now() < ends) await frame();
    return $('trial').dataset.outcome;
  }

  return { grasp, look, push, release };
})();
