// Looks at the page as it stands; each audit returns what is wrong with it.
window.audits = {
  /** Pairs of parts that overlap, and parts beyond the window's edge. */
  overlaps(selector) {
    const parts = [...document.querySelectorAll(selector)].filter((e) => e.checkVisibility());
    const boxes = parts.map((e) => [e.id || e.className, e.getBoundingClientRect()]);
    const found = boxes
      .filter(([, b]) => b.left < 0 || b.top < 0 || b.right > innerWidth + 0.5 || b.bottom > innerHeight + 0.5)
      .map(([name]) => `${name} leaves the window`);
    boxes.forEach(([a, p], i) => boxes.slice(i + 1).forEach(([b, q]) => {
      const across = p.left < q.right - 1 && q.left < p.right - 1;
      const down = p.top < q.bottom - 1 && q.top < p.bottom - 1;
      if (across && down) found.push(`${a} and ${b} overlap`);
    }));
    return found;
  },

  /** Text below 4.5:1 on its ground (WCAG 2), black behind whatever is translucent. */
  contrasts() {
    const canvas = document.createElement('canvas').getContext('2d', { willReadFrequently: true });
    const rgba = (colour) => {
      canvas.clearRect(0, 0, 1, 1);
      canvas.fillStyle = colour;
      canvas.fillRect(0, 0, 1, 1);
      return [...canvas.getImageData(0, 0, 1, 1).data];
    };
    const over = ([r, g, b, a], under) => [r, g, b].map((v, i) => (v * a + under[i] * (255 - a)) / 255);
    const linear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
    const light = ([r, g, b]) => 0.2126 * linear(r / 255) + 0.7152 * linear(g / 255) + 0.0722 * linear(b / 255);
    const left = '.unseen, .off, option, noscript, [aria-disabled=true]';
    const bad = [];
    for (const e of document.querySelectorAll('body *')) {
      const text = [...e.childNodes].some((n) => n.nodeType === Node.TEXT_NODE && n.data.trim());
      if (!text || e.closest(left) || !e.checkVisibility({ opacityProperty: true })) continue;
      const grounds = [];
      for (let up = e; up; up = up.parentElement) grounds.unshift(rgba(getComputedStyle(up).backgroundColor));
      const ground = grounds.reduce((under, colour) => over(colour, under), [0, 0, 0]);
      const [a, b] = [light(over(rgba(getComputedStyle(e).color), ground)), light(ground)];
      const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
      if (ratio < 4.5) bad.push(`${e.textContent.trim().slice(0, 20)}: ${ratio.toFixed(2)}`);
    }
    return bad;
  },

  /** Controls a screen reader could not name. */
  nameless() {
    const named = (e) => e.getAttribute('aria-label') || e.innerText?.trim() || e.title
      || [...(e.labels ?? [])].some((label) => label.innerText.trim())
      || document.getElementById(e.getAttribute('aria-labelledby'))?.innerText.trim();
    return [...document.querySelectorAll('button, input, select, [tabindex="0"], iframe')]
      .filter((e) => e.checkVisibility() && !named(e)).map((e) => e.outerHTML.slice(0, 100));
  },

  /** Controls a finger could miss: below 44 pixels either way. */
  small() {
    return [...document.querySelectorAll('button, select, label:has(input), .stick')]
      .filter((e) => e.checkVisibility())
      .map((e) => [e.id || e.innerText || e.getAttribute('aria-label'), e.getBoundingClientRect()])
      .filter(([, b]) => b.height < 44 || b.width < 44)
      .map(([name, b]) => `${name}: ${Math.round(b.width)} × ${Math.round(b.height)}`);
  },

  /** Elements that would move. */
  moving() {
    return [...document.querySelectorAll('*')].filter((e) => {
      const style = getComputedStyle(e);
      const eased = style.transitionDuration !== '0s' && style.transitionProperty !== 'none';
      return style.animationName !== 'none' || eased;
    }).length;
  },
};
