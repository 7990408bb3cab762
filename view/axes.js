// What all plots share: room around them, ticks and their labels, the box at the pointer, and what a pointer does.

const LEFT = 58, RIGHT = 10, TOP = 8, BOTTOM = 34;

function ticks(low, high, count) {  // their distance, the ticks, two at least, and the power of ten that is taken out of their labels
  const raw = (high - low) / count, ten = 10 ** Math.floor(Math.log10(raw)), step = ten * ([1, 2, 5].find(m => m * ten >= raw * 0.999) || 10);
  const all = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step && all.length < 60; k++) all.push(k * step);
  if (all.length < 2 && high > low && count < 16) return ticks(low, high, 2 * count);
  const size = Math.max(Math.abs(low), Math.abs(high)), power = size >= 1e5 || size < 5e-3 ? 3 * Math.floor(Math.log10(size) / 3) : 0;
  return [step, all, power];
}

function dates(low, high, count) {  // digits of a date that tell the ticks apart, the ticks, begins of days, months or years in UTC
  const raw = (high - low) / count / 86400, all = [];
  const months = [1, 2, 3, 6, 12, 24, 60, 120, 600].find(m => 30 * m >= raw) || 1200, days = [1, 2, 5, 10].find(d => d >= raw);
  const from = new Date(1000 * low), at = days ? Date.UTC(from.getUTCFullYear(), from.getUTCMonth(), from.getUTCDate()) : 0;
  for (let k = 0; all.length < 60; k++) {
    const t = (days ? at + 864e5 * days * k : Date.UTC(from.getUTCFullYear(), months * (Math.floor(from.getUTCMonth() / months) + k), 1)) / 1000;
    if (t > high) break;
    if (t >= low) all.push(t);
  }
  return [days ? 10 : months < 12 ? 7 : 4, all, 0];
}

function label(v, step, power) {
  const digits = Math.max(0, Math.min(9, -Math.floor(Math.log10(step) - power + 1e-9)));
  const text = (v / 10 ** power).toFixed(digits);
  return Number(text) === 0 ? "0" : text.replace("-", "−");
}

function note(g, W, H, rows, x, y, tint, ink) {  // the box at the pointer
  const longest = Math.max(120, W - LEFT - RIGHT - 30);
  const cut = text => { while (g.measureText(text).width > longest) text = "…" + text.slice(2); return text; };
  rows[0] = cut(rows[0]);
  const width = Math.max(...rows.map(row => g.measureText(row).width)) + 16, left = x + 12 + width > W ? Math.max(2, x - 12 - width) : x + 12;
  const top = Math.max(TOP, Math.min(H - BOTTOM - 40, y - 46));
  g.fillStyle = ink.paper + "f0"; g.strokeStyle = tint; g.lineWidth = 1;
  g.beginPath(); g.rect(left, top, width, 38); g.fill(); g.stroke();
  g.fillStyle = ink.ink; g.textAlign = "left"; g.fillText(rows[0], left + 8, top + 15); g.fillText(rows[1], left + 8, top + 31);
}

function touch(plot, board, panel) {  // a pointer on a plot: the value there, a stretch to zoom to; `panel` gets the pointer's height
  const fingers = new Map();
  const when = event => {
    const box = plot.getBoundingClientRect(), [a, b] = board.view;
    return Math.min(b, Math.max(a, a + (event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT) * (b - a)));
  };
  let from = null, pinch = null;
  plot.onpointerdown = event => {
    if (event.button) return;
    plot.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, event.clientX);
    if (fingers.size === 2) { const [p, q] = [...fingers.values()]; pinch = { span: Math.abs(p - q) || 1, view: [...board.view], middle: when({ clientX: (p + q) / 2 }) }; from = null; return; }
    from = { x: event.clientX, t: when(event) };
    if (event.pointerType !== "mouse") board.seek(from.t);
  };
  plot.onpointermove = event => {
    const box = plot.getBoundingClientRect();
    panel.pointer = event.clientY - box.top;
    if (fingers.has(event.pointerId)) fingers.set(event.pointerId, event.clientX);
    if (pinch && fingers.size === 2) {
      const [p, q] = [...fingers.values()], share = pinch.span / (Math.abs(p - q) || 1), { middle, view: [a, b] } = pinch;
      board.show(middle - (middle - a) * share, middle + (b - middle) * share);
    } else if (from && event.pointerType !== "mouse") board.seek(when(event));
    else {
      board.drag = from && Math.abs(event.clientX - from.x) > 5 ? [from.t, when(event)] : null;
      board.point(when(event));
    }
  };
  const up = event => {
    fingers.delete(event.pointerId);
    if (pinch) { if (!fingers.size) pinch = null; return; }
    if (from && event.pointerType === "mouse" && event.type === "pointerup") {
      if (board.drag) board.show(Math.min(...board.drag), Math.max(...board.drag)); else board.seek(when(event));
    }
    from = null; board.drag = null; board.point(event.pointerType === "mouse" ? when(event) : null);
  };
  plot.onpointerup = plot.onpointercancel = up;
  plot.onpointerleave = () => { panel.pointer = undefined; if (!from) board.point(null); };
  plot.ondblclick = () => board.all();
  plot.addEventListener("wheel", event => {
    if (!event.ctrlKey && !event.shiftKey) return;  // the page scrolls
    event.preventDefault();
    const [a, b] = board.view, t = when(event), turned = event.deltaY || event.deltaX;
    if (event.shiftKey) { const by = Math.sign(turned) * 0.1 * (b - a); board.show(a + by, b + by); }
    else { const share = Math.exp(Math.max(-1, Math.min(1, turned / 200))); board.show(t - (t - a) * share, t + (b - t) * share); }
  }, { passive: false });
}
