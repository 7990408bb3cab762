// Curves over time. Those of one unit share a panel and its axis; a column has one colour, a run one dash.

const LEFT = 58, RIGHT = 10, TOP = 8, BOTTOM = 34;

class Panel {  // of one unit, or of what its curves call their panel: {label, colour, unit, lines: [{run, name}], drop, panel, quiet: without an entry in the legend}
  constructor(parent, board) {
    this.board = board; this.curves = [];
    this.legend = make("ul", { className: "legend" });
    this.base = make("canvas", { role: "img" });
    this.over = make("canvas", { "aria-hidden": "true" });
    this.plot = make("div", { className: "plot" }, this.base, this.over);
    this.element = make("section", { className: "panel" }, this.legend, this.plot);
    parent.append(this.element);
    this.touch();
  }

  set(curves) {
    this.curves = curves;
    this.unit = curves[0].unit;
    this.values = [];
    this.title = make("li", { className: "axis" });
    this.legend.replaceChildren(this.title);
    this.base.setAttribute("aria-label", `${this.heading()} over time: ${curves.map(c => c.label).join(", ")}`);
    const quiet = curves.filter(curve => curve.quiet);
    for (const curve of curves) {
      if (curve.quiet) continue;
      const item = make("li", {});
      for (const line of curve.lines) {
        const mark = make("span", { className: "mark" }), value = make("span", { className: "value" });
        mark.style.background = sample(line.dash, colour(curve.colour));
        this.values.push([line, value]);
        if (line === curve.lines[0]) item.append(mark, make("span", {}, curve.label), " ", value);
        else item.append(" ", make("span", { className: "pair" }, mark, value));
      }
      if (curve.drop) item.append(" ", make("span", { className: "pair" }, item.lastChild, make("button", { title: "take away", ariaLabel: `Take ${curve.label} away`, onclick: curve.drop }, "×")));
      this.legend.append(item);
    }
    if (quiet.length) {
      const mark = make("span", { className: "mark" });
      mark.style.background = quiet[0].colour;
      this.legend.append(make("li", {}, mark, `${quiet.length} ${this.values.length ? "others" : "in all"}`));
    }
  }

  heading(power = 0) { return (this.curves[0].panel ? `${this.curves[0].panel}, ` : "") + axis(this.unit, power); }

  draw() {
    const [g, W, H] = fit(this.base), ink = theme(), [a, b] = this.board.view;
    this.W = W; this.H = H;
    let low = Infinity, high = -Infinity;
    const drawn = [];
    for (const curve of this.curves) for (const line of curve.lines) {
      const run = runs[line.run], values = run.values(line.name), time = run.time, last = time.length - 1;
      if (b < time[0] || a > time[last]) continue;
      const first = Math.max(0, run.place(a)), end = Math.min(last, run.place(b) + 1);
      const seen = [values, ...(!curve.quiet && run.bounds(line.name) || [])];
      for (const x of seen) for (let k = first; k <= end; k++) { const v = x[k]; if (v < low && v > -Infinity) low = v; if (v > high && v < Infinity) high = v; }
      drawn.push([curve, line, run, values, first, end]);
    }
    if (!(low <= high)) { low = -1; high = 1; }
    const room = high > low ? 0.06 * (high - low) : Math.max(0.05 * Math.abs(high), 1e-9) || 1;
    this.low = low -= room; this.high = high += room;
    this.X = t => LEFT + (W - LEFT - RIGHT) * (t - a) / (b - a);
    this.Y = v => TOP + (H - TOP - BOTTOM) * (high - v) / (high - low);
    this.axes(g, W, H, ink, a, b);
    g.save(); g.beginPath(); g.rect(LEFT, TOP - 2, W - LEFT - RIGHT, H - TOP - BOTTOM + 4); g.clip();
    g.lineJoin = "round";
    for (const one of drawn.reverse()) this.line(g, W, ...one);
    g.restore();
    this.mark();
  }

  axes(g, W, H, ink, a, b) {
    const { X, Y } = this;
    g.fillStyle = ink.shade;
    for (const [from, to] of D.windows || []) if (to > a && from < b) g.fillRect(Math.max(LEFT, X(from)), TOP, Math.min(W - RIGHT, X(to)) - Math.max(LEFT, X(from)), H - TOP - BOTTOM);
    g.lineWidth = 1; g.fillStyle = ink.soft;
    const [rise, levels, power] = ticks(this.low, this.high, Math.max(2, H / 34));
    g.textAlign = "right"; g.textBaseline = "middle";
    for (const v of levels) {
      g.strokeStyle = Math.abs(v) < 1e-9 * rise ? ink.zero : ink.line;
      g.beginPath(); g.moveTo(LEFT, Y(v)); g.lineTo(W - RIGHT, Y(v)); g.stroke();
      g.fillText(label(v, rise, power), LEFT - 7, Y(v));
    }
    g.textBaseline = "alphabetic";
    this.title.textContent = this.heading(power);
    const [every, times, tens] = D.dates ? dates(a, b, Math.max(2, (W - LEFT) / 90)) : ticks(a, b, Math.max(2, (W - LEFT) / 90));
    g.textAlign = "center";
    for (const t of times) {
      if (X(t) < LEFT - 1 || X(t) > W - RIGHT + 1) continue;
      g.strokeStyle = ink.line; g.beginPath(); g.moveTo(X(t), H - BOTTOM); g.lineTo(X(t), H - BOTTOM + 4); g.stroke();
      const text = D.dates ? day(t).slice(0, every) : label(t, every, tens), half = g.measureText(text).width / 2;
      g.fillText(text, Math.min(X(t), W - half - 1), H - BOTTOM + 16);
    }
    g.fillText(D.dates ? "recorded" : `time in ${tens ? `10${raised(tens)} s` : "s"}`, LEFT + (W - LEFT - RIGHT) / 2, H - 4);
  }

  line(g, W, curve, line, run, values, first, end) {
    const { X, Y } = this, time = run.time;
    g.strokeStyle = colour(curve.colour); g.lineWidth = line.dash ? 1.3 : 1.6; g.setLineDash(DASHES[line.dash % 4]);
    g.beginPath();
    let pen = false;
    const to = (x, y) => { if (pen) g.lineTo(x, y); else { g.moveTo(x, y); pen = true; } };
    const steps = run.told.get(line.name).steps;
    if (end - first < 3 * W) {
      for (let k = first; k <= end; k++) {
        const v = values[k];
        if (!Number.isFinite(v)) { pen = false; continue; }
        if (steps && pen) g.lineTo(X(time[k]), Y(values[k - 1]));
        to(X(time[k]), Y(v));
      }
    } else {  // least and greatest of each pixel, in their order
      let pixel = -1, k = first;
      while (k <= end) {
        pixel = Math.floor(X(time[k]));
        let low = Infinity, high = -Infinity, rising = true, any = false, gap = false;
        for (; k <= end && Math.floor(X(time[k])) === pixel; k++) {
          const v = values[k];
          if (!Number.isFinite(v)) { gap = true; continue; }
          any = true;
          if (v < low) { low = v; rising = false; }
          if (v > high) { high = v; rising = true; }
        }
        if (!any) { pen = false; continue; }
        to(pixel + 0.5, Y(rising ? low : high));
        if (high > low) to(pixel + 0.5, Y(rising ? high : low));
        if (gap) pen = false;
      }
    }
    g.stroke(); g.setLineDash([]);
    const bounds = !curve.quiet && run.bounds(line.name);
    if (!bounds) return;
    g.lineWidth = 1; g.fillStyle = colour(curve.colour);
    for (let k = first; k <= end; k++) {
      if (!Number.isFinite(values[k])) continue;
      g.beginPath(); g.moveTo(X(time[k]), Y(bounds[0][k])); g.lineTo(X(time[k]), Y(bounds[1][k])); g.stroke();
      g.beginPath(); g.arc(X(time[k]), Y(values[k]), 2.2, 0, 7); g.fill();
    }
  }

  mark() {  // where the time is, where the pointer is, and what the curves are there
    const [g, W, H] = fit(this.over), ink = theme(), [a, b] = this.board.view, { X, Y } = this;
    const hover = this.board.hover, t = hover ?? this.board.time;
    const rule = (at, tint, dash) => { if (at < a || at > b) return; g.strokeStyle = tint; g.setLineDash(dash); g.lineWidth = 1; g.beginPath(); g.moveTo(X(at), TOP); g.lineTo(X(at), H - BOTTOM); g.stroke(); g.setLineDash([]); };
    if (!D.dates) rule(this.board.time, ink.ink, []);
    if (hover !== null) rule(hover, ink.soft, [3, 3]);
    if (this.board.drag) {
      const [p, q] = this.board.drag.map(X);
      g.fillStyle = ink.soft + "33"; g.fillRect(Math.min(p, q), TOP, Math.abs(q - p), H - TOP - BOTTOM);
    }
    let near = null;
    for (const curve of this.curves) for (const line of curve.lines) {
      const run = runs[line.run], k = D.dates ? run.near(line.name, t) : -1;
      const at = k < 0 ? t : run.time[k], v = run.at(line.name, at);
      if (!Number.isFinite(v) || at < a || at > b) continue;
      const y = Math.max(TOP, Math.min(H - BOTTOM, Y(v)));
      if (!curve.quiet) { g.fillStyle = colour(curve.colour); g.beginPath(); g.arc(X(at), y, 3.2, 0, 7); g.fill(); }
      if (this.pointer !== undefined && (!near || Math.abs(y - this.pointer) < Math.abs(near.y - this.pointer))) near = { curve, line, v, y, k, at };
    }
    for (const [line, value] of this.values) {
      const run = runs[line.run], v = run.at(line.name, D.dates ? run.time[run.near(line.name, t)] : t);
      value.textContent = `${number(v)}${this.unit && Number.isFinite(v) ? " " + unit(this.unit) : ""}`;
    }
    if (near && hover !== null) this.tip(g, W, X(near.at), near, ink);
  }

  tip(g, W, x, near, ink) {
    const of = runs.length > 1 && !D.choices ? ` · ${runs[near.line.run].label}` : "";
    const ends = near.k < 0 ? null : runs[near.line.run].bounds(near.line.name)?.map(x => number(x[near.k]));
    const when = D.dates ? `${ends ? ` (${ends.join(" to ")})` : ""} on ${day(near.at)}` : ` at ${number(this.board.hover, 5)} s`;
    const rows = [`${near.curve.label}${of}`, `${number(near.v, 5)} ${unit(this.unit)}${when}`];
    const longest = Math.max(120, W - LEFT - RIGHT - 30);
    const cut = text => { while (g.measureText(text).width > longest) text = "…" + text.slice(2); return text; };
    rows[0] = cut(rows[0]);
    const width = Math.max(...rows.map(row => g.measureText(row).width)) + 16, left = x + 12 + width > W ? Math.max(2, x - 12 - width) : x + 12;
    const top = Math.max(TOP, Math.min(this.H - BOTTOM - 40, near.y - 46));
    g.fillStyle = ink.paper + "f0"; g.strokeStyle = colour(near.curve.colour); g.lineWidth = 1;
    g.beginPath(); g.rect(left, top, width, 38); g.fill(); g.stroke();
    g.fillStyle = ink.ink; g.textAlign = "left"; g.fillText(rows[0], left + 8, top + 15); g.fillText(rows[1], left + 8, top + 31);
  }

  touch() {
    const plot = this.plot, board = this.board, fingers = new Map();
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
      this.pointer = event.clientY - box.top;
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
    plot.onpointerleave = () => { this.pointer = undefined; if (!from) board.point(null); };
    plot.ondblclick = () => board.show(BEGIN, END);
    plot.addEventListener("wheel", event => {
      if (!event.ctrlKey && !event.shiftKey) return;  // the page scrolls
      event.preventDefault();
      const [a, b] = board.view, t = when(event), turned = event.deltaY || event.deltaX;
      if (event.shiftKey) { const by = Math.sign(turned) * 0.1 * (b - a); board.show(a + by, b + by); }
      else { const share = Math.exp(Math.max(-1, Math.min(1, turned / 200))); board.show(t - (t - a) * share, t + (b - t) * share); }
    }, { passive: false });
  }
}

function ticks(low, high, count) {  // their distance, the ticks, and the power of ten that is taken out of their labels
  const raw = (high - low) / count, ten = 10 ** Math.floor(Math.log10(raw)), step = ten * ([1, 2, 5].find(m => m * ten >= raw * 0.999) || 10);
  const all = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step && all.length < 60; k++) all.push(k * step);
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
