// Figures over whatever their axes say: lines, points, bands and maps, each plot with a zoom of its own or one that it shares.

const FOOT = 22;  // below a plot, whose label of x stands under it as words
const numbers = (D.numbers || []).map(text => decode(text, Float64Array));
const words = (axis, power = 0) => { const of = [power ? `10${raised(power)}` : "", unit(axis.unit || "")].filter(Boolean).join(" "); return of ? `${axis.label} in ${of}` : axis.label; };
const amount = (axis, v) => axis.names ? axis.names[Math.round(v)] ?? "" : `${number(v)}${axis.unit ? ` ${unit(axis.unit)}` : ""}`;

const RAMPS = {  // from little to much; much stands out from the paper
  light: [[255, 236, 179], [253, 160, 72], [204, 52, 60], [92, 20, 70]],
  dark: [[70, 32, 78], [180, 52, 72], [244, 140, 70], [255, 230, 160]],
};
function ramp(share) {
  const all = RAMPS[dark.matches ? "dark" : "light"], at = Math.max(0, Math.min(0.9999, share)) * (all.length - 1), k = Math.floor(at);
  return `rgb(${all[k].map((c, i) => Math.round(c + (at - k) * (all[k + 1][i] - c))).join(" ")})`;
}
const shareOf = (scale, v) => {
  const place = scale.log ? Math.log : x => x;
  return scale.high > scale.low ? (place(v) - place(scale.low)) / (place(scale.high) - place(scale.low)) : 0.5;
};

function fields(values) {  // from where to where each of rising values stands for all
  const middle = k => (values[k] + values[k + 1]) / 2, last = values.length - 1;
  return [...values].map((v, k) => [k ? middle(k - 1) : v - (middle(0) - v), k < last ? middle(k) : v + (v - middle(k - 1))]);
}

class View {  // the stretch of x that plots have in common, and where a pointer or a key is
  constructor() { this.plots = []; this.hover = null; this.kept = null; this.drag = null; }
  add(plot) {
    this.plots.push(plot);
    this.ends = [Math.min(...this.plots.map(one => one.ends[0])), Math.max(...this.plots.map(one => one.ends[1]))];
    this.view = [...this.ends];
  }
  show(a, b) {
    const [low, high] = this.ends, span = Math.max((high - low) * 1e-5, Math.min(high - low, b - a));
    a = Math.max(low, Math.min(high - span, a));
    this.view = [a, a + span];
    for (const plot of this.plots) plot.draw();
  }
  all() { this.show(...this.ends); }
  zoom(share) {
    const [a, b] = this.view, middle = this.kept !== null && this.kept >= a && this.kept <= b ? this.kept : (a + b) / 2;
    this.show(middle - (middle - a) * share, middle + (b - middle) * share);
  }
  seek(x) {  // kept when the pointer is gone
    for (const plot of this.plots) plot.height = plot.pointer;
    this.kept = x; this.point(x);
  }
  step(share) {
    const [a, b] = this.view, x = Math.max(this.ends[0], Math.min(this.ends[1], (this.kept ?? (a + b) / 2) + share * (b - a)));
    if (x < a || x > b) this.show(x < a ? x : x - (b - a), x < a ? x + (b - a) : x);
    this.kept = x; this.point(null);
  }
  point(x) { this.hover = x; for (const plot of this.plots) plot.mark(); }
}

class Plot {
  constructor(told, view, parent) {
    this.told = told; this.board = view;
    this.marks = told.marks.map(mark => {
      const made = { ...mark };
      for (const key of ["x", "y", "low", "high", "by"]) if (key in mark) made[key] = numbers[mark[key]];
      return made;
    });
    this.ends = this.reach();
    this.head = make("p", { className: "axis" });
    this.back = make("button", { className: "back", title: "all of it (0)", onclick: () => view.all() }, "all");
    this.base = make("canvas", { role: "img" });
    this.over = make("canvas", { "aria-hidden": "true" });
    this.plot = make("div", { className: "plot", tabIndex: 0 }, this.base, this.over);
    this.foot = make("p", { className: "foot" });
    parent.append(make("section", { className: "panel" }, make("div", { className: "top" }, this.head, this.back), this.plot, this.foot, ...this.scale()));
    const of = [...new Set(told.marks.map(mark => mark.label).filter(Boolean))].join(", ");
    this.base.setAttribute("aria-label", `${told.title ? `${told.title}: ` : ""}${words(told.y)} over ${words(told.x)}${of ? `: ${of}` : ""}`);
    touch(this.plot, view, this);
    this.plot.onkeydown = event => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const keys = { "+": () => view.zoom(0.5), "=": () => view.zoom(0.5), "-": () => view.zoom(2), 0: () => view.all(),
        ArrowLeft: () => view.step(event.shiftKey ? -0.1 : -0.01), ArrowRight: () => view.step(event.shiftKey ? 0.1 : 0.01),
        Escape: () => { view.kept = null; view.point(null); } };
      if (keys[event.key]) { event.preventDefault(); event.stopPropagation(); keys[event.key](); }
    };
  }

  reach() {  // of x, of all that is drawn
    let low = Infinity, high = -Infinity;
    const dots = this.marks.some(mark => mark.kind === "points"), map = this.marks.find(mark => mark.kind === "field");
    if (map) return [fields(map.x)[0][0], fields(map.x).at(-1)[1]];
    for (const mark of this.marks) if (mark.x) for (const v of mark.x) { if (v < low) low = v; if (v > high) high = v; }
    if (!(low <= high)) return [0, 1];
    const room = (high > low ? high - low : Math.abs(high) || 1) * (dots || high === low ? 0.03 : 0);
    return this.told.x.names ? [-0.5, this.told.x.names.length - 0.5] : [low - room, high + room];
  }

  scale() {  // what the colours of points or of a map say
    const { scale } = this.told;
    if (!scale) return [];
    this.strip = make("span", { className: "strip" });
    return [make("p", { className: "scale" }, `${words(scale)}: ${number(scale.low)} `, this.strip, ` ${number(scale.high)}`)];
  }

  draw() {
    const [g, W, H] = fit(this.base), ink = theme(), [a, b] = this.board.view, { x, y } = this.told;
    this.W = W; this.H = H;
    this.back.style.visibility = a > this.board.ends[0] || b < this.board.ends[1] ? "visible" : "hidden";
    if (this.strip) this.strip.style.background = `linear-gradient(90deg, ${[0, 0.33, 0.67, 1].map(ramp).join(", ")})`;
    let low = y.from ?? Infinity, high = y.to ?? -Infinity;
    const map = this.marks.find(mark => mark.kind === "field");
    if (map) [low, high] = [fields(map.y)[0][0], fields(map.y).at(-1)[1]];
    const since = y.since < b ? Math.max(a, y.since) : a;
    if (!map) for (const mark of this.marks) {
      if (mark.along === "y") { low = Math.min(low, mark.at); high = Math.max(high, mark.at); }
      if (mark.x) for (const values of [mark.y, mark.low, mark.high]) if (values) for (let k = 0; k < values.length; k++) {
        if (mark.x[k] < since || mark.x[k] > b) continue;
        if (values[k] < low) low = values[k]; if (values[k] > high) high = values[k];
      }
    }
    if (!(low <= high)) { low = -1; high = 1; }
    const room = map ? 0 : high > low ? 0.06 * (high - low) : Math.max(0.05 * Math.abs(high), 1e-9);
    this.low = low - (y.from === low ? 0 : room); this.high = high + room + (this.marks.some(mark => mark.kind === "window") ? 0.1 * (high - low) : 0);  // for their names
    this.X = v => LEFT + (W - LEFT - RIGHT) * (v - a) / (b - a);
    this.Y = v => TOP + (H - TOP - FOOT) * (this.high - v) / (this.high - this.low);
    for (const mark of this.marks) if (mark.kind === "window") this.window(g, mark, ink);
    this.axes(g, W, H, ink, a, b);
    g.save(); g.beginPath(); g.rect(LEFT, TOP - 2, W - LEFT - RIGHT, H - TOP - FOOT + 4); g.clip();
    g.lineJoin = "round";
    for (const mark of this.marks) if (mark.kind !== "window") this[mark.kind](g, mark, ink);
    g.restore();
    this.mark();
  }

  axes(g, W, H, ink, a, b) {
    const { X, Y } = this, { x, y, title } = this.told;
    g.lineWidth = 1; g.fillStyle = ink.soft; g.textAlign = "right"; g.textBaseline = "middle";
    const [rise, levels, power] = ticks(this.low, this.high, Math.max(2, H / 34));
    for (const v of levels) {
      g.strokeStyle = Math.abs(v) < 1e-9 * rise ? ink.zero : ink.line;
      g.beginPath(); g.moveTo(LEFT, Y(v)); g.lineTo(W - RIGHT, Y(v)); g.stroke();
      g.fillText(label(v, rise, power), LEFT - 7, Y(v));
    }
    g.textBaseline = "alphabetic"; g.textAlign = "center";
    this.head.replaceChildren(...(title ? [make("b", {}, `${title}:`), " "] : []), words(y, power));
    const tick = (at, text) => {
      g.strokeStyle = ink.line; g.beginPath(); g.moveTo(X(at), H - FOOT); g.lineTo(X(at), H - FOOT + 4); g.stroke();
      g.fillText(text, Math.min(X(at), W - g.measureText(text).width / 2 - 1), H - FOOT + 17);
    };
    if (x.names) {  // words where they have room, else numbers and what these are
      const room = (W - LEFT - RIGHT) / (b - a) - 8, plain = x.names.every(name => g.measureText(name).width < room);
      const every = Math.ceil(18 / (room + 8));
      x.names.forEach((name, k) => { if (k >= a && k <= b && (plain || k % every === 0)) tick(k, plain ? name : String(k + 1)); });
      this.foot.textContent = plain ? x.label : `${x.label}: ${x.names.map((name, k) => `${k + 1} ${name}`).join(", ")}`;
    } else {
      const [every, places, tens] = ticks(a, b, Math.max(2, (W - LEFT) / 80));
      for (const at of places) tick(at, label(at, every, tens));
      this.foot.textContent = words(x, tens);
    }
  }

  // --- the kinds of marks -------------------------------------------------------------------------------------------

  line(g, mark) {
    const { X, Y } = this;
    g.strokeStyle = g.fillStyle = colour(mark.colour); g.lineWidth = mark.thin ? 1 : 1.6; g.globalAlpha = mark.faint ? 0.35 : 1; g.setLineDash(DASHES[mark.dash || 0]);
    g.beginPath();
    let pen = false;
    for (let k = 0; k < mark.x.length; k++) {
      const px = X(mark.x[k]), py = Y(mark.y[k]);
      if (!Number.isFinite(px + py)) { pen = false; continue; }
      if (pen) g.lineTo(px, py); else g.moveTo(px, py);
      pen = true;
    }
    g.stroke(); g.setLineDash([]);
    if (mark.dots) this.points(g, { ...mark, size: 2.2 });
    g.globalAlpha = 1;
  }

  points(g, mark) {
    const { X, Y } = this, { scale } = this.told;
    for (let k = 0; k < mark.x.length; k++) {
      if (!Number.isFinite(mark.y[k])) continue;
      g.fillStyle = g.strokeStyle = mark.by ? ramp(shareOf(scale, mark.by[k])) : colour(mark.colour);
      if (mark.low) { g.lineWidth = 1; g.beginPath(); g.moveTo(X(mark.x[k]), Y(mark.low[k])); g.lineTo(X(mark.x[k]), Y(mark.high[k])); g.stroke(); }
      g.beginPath(); g.arc(X(mark.x[k]), Y(mark.y[k]), mark.size || 3, 0, 7); g.fill();
      if (mark.ring) { g.strokeStyle = theme().ink; g.lineWidth = 1.3; g.stroke(); }
    }
  }

  band(g, mark) {
    const { X, Y } = this, count = mark.x.length;
    g.fillStyle = colour(mark.colour); g.globalAlpha = 0.22;
    g.beginPath();
    for (let k = 0; k < count; k++) g.lineTo(X(mark.x[k]), Y(mark.low[k]));
    for (let k = count - 1; k >= 0; k--) g.lineTo(X(mark.x[k]), Y(mark.high[k]));
    g.fill(); g.globalAlpha = 1;
  }

  rule(g, mark) {
    const { X, Y, W, H } = this;
    g.strokeStyle = colour(mark.colour); g.lineWidth = 1.2; g.setLineDash(DASHES[mark.dash ?? 2]);
    g.beginPath();
    if (mark.along === "y") { g.moveTo(LEFT, Y(mark.at)); g.lineTo(W - RIGHT, Y(mark.at)); } else { g.moveTo(X(mark.at), TOP); g.lineTo(X(mark.at), H - FOOT); }
    g.stroke(); g.setLineDash([]);
  }

  window(g, mark, ink) {
    const { X, W, H } = this, left = Math.max(LEFT, X(mark.from)), wide = Math.min(W - RIGHT, X(mark.to)) - left;
    if (wide <= 0) return;
    g.fillStyle = ink.shade; g.fillRect(left, TOP, wide, H - TOP - FOOT);
    g.fillStyle = ink.soft; g.textAlign = "center";
    if (g.measureText(mark.name).width < wide - 4) g.fillText(mark.name, left + wide / 2, TOP + 12);
  }

  field(g, mark) {  // colour around each value: x the faster
    const { X, Y } = this, { scale } = this.told;
    const across = fields(mark.x), up = fields(mark.y);
    up.forEach(([bottom, top], j) => across.forEach(([left, right], i) => {
      const v = mark.by[j * across.length + i];
      if (!Number.isFinite(v)) return;
      g.fillStyle = ramp(shareOf(scale, v));
      g.fillRect(X(left), Y(top), X(right) - X(left) + 0.6, Y(bottom) - Y(top) + 0.6);
    }));
  }

  // --- what is at the pointer ----------------------------------------------------------------------------------------

  mark() {
    const [g, W, H] = fit(this.over), ink = theme(), [a, b] = this.board.view, { X } = this, { hover, kept, drag } = this.board;
    const at = hover ?? kept;
    if (drag) {
      const [p, q] = drag.map(X);
      g.fillStyle = ink.soft + "33"; g.fillRect(Math.min(p, q), TOP, Math.abs(q - p), H - TOP - FOOT);
    }
    if (at === null || at < a || at > b) return;
    g.strokeStyle = ink.soft; g.setLineDash([3, 3]); g.lineWidth = 1;
    g.beginPath(); g.moveTo(X(at), TOP); g.lineTo(X(at), H - FOOT); g.stroke(); g.setLineDash([]);
    const y = hover === null ? this.height : this.pointer;
    const near = this.near(X(at), y);
    if (!near || (y === undefined && hover !== null)) return;  // the pointer is in another plot
    g.fillStyle = near.tint; g.beginPath(); g.arc(near.px, near.py, 4, 0, 7); g.fill();
    note(g, W, H, [[near.mark.label, near.what].filter(Boolean).join(", "), near.where], near.px, near.py, near.tint, ink);
  }

  near(px, py) {  // what is drawn nearest to a pixel
    const { X, Y } = this, { x, y, scale } = this.told, [a, b] = this.board.view;
    let best = null;
    const offer = (far, mark, k, where, what, at, tint) => { if (!best || far < best.far) best = { far, mark, k, where, what, px: at[0], py: at[1], tint }; };
    for (const mark of this.marks) {
      if (mark.kind === "field") {
        const closest = (values, P, p) => values.reduce((k, v, i) => Math.abs(P(v) - p) < Math.abs(P(values[k]) - p) ? i : k, 0);
        const i = closest(mark.x, X, px), j = closest(mark.y, Y, py ?? this.H / 2), v = mark.by[j * mark.x.length + i];
        offer(30, mark, i, `${x.label} ${amount(x, mark.x[i])}, ${y.label} ${amount(y, mark.y[j])}`, amount(scale, v), [X(mark.x[i]), Y(mark.y[j])], ink());
        continue;
      }
      if (!mark.x || mark.faint || mark.kind === "band") continue;
      let k = -1, least = Infinity;
      for (let i = 0; i < mark.x.length; i++) {
        if (!(mark.x[i] >= a && mark.x[i] <= b) || !Number.isFinite(mark.y[i])) continue;
        const dx = X(mark.x[i]) - px, far = mark.kind === "line" || py === undefined ? Math.abs(dx) : Math.hypot(dx, Y(mark.y[i]) - py);
        if (far < least) { least = far; k = i; }
      }
      if (k < 0) continue;
      const at = [X(mark.x[k]), Math.max(TOP, Math.min(this.H - FOOT, Y(mark.y[k])))];
      const ends = mark.low ? ` (${number(mark.low[k])} to ${number(mark.high[k])})` : "", shade = mark.by ? `, ${scale.label} ${amount(scale, mark.by[k])}` : "";
      offer(Math.hypot(at[0] - px, py === undefined ? 0 : at[1] - py), mark, k, `${amount(y, mark.y[k])}${ends} at ${amount(x, mark.x[k])}${shade}`, "", at, mark.by ? ink() : colour(mark.colour));
    }
    return best;
  }
}

const ink = () => theme().ink;

const figures = [...document.querySelectorAll("[data-figure]")].map(element => {
  const told = D.figures[element.dataset.figure], views = new Map(), plots = [], legend = make("ul", { className: "legend" });
  const grid = make("div", { className: "plots" });
  grid.style.setProperty("--least", `${told.least}px`);
  for (const one of told.plots) {
    const key = one.shares ?? plots.length;
    if (!views.has(key)) views.set(key, new View());
    const plot = new Plot(one, views.get(key), grid);
    views.get(key).add(plot); plots.push(plot);
  }
  const marks = new Map(told.plots.flatMap(one => one.marks).filter(mark => mark.label && mark.kind !== "field").map(mark => [mark.label, mark]));
  const draw = () => {
    legend.replaceChildren(...[...marks.values()].map(mark => {
      const sign = make("span", { className: `mark ${mark.kind}` });
      sign.style.background = mark.by ? ramp(0.5) : sample(mark.kind === "rule" ? mark.dash ?? 2 : mark.dash || 0, colour(mark.colour));
      if (mark.ring) sign.classList.add("ring");
      return make("li", {}, make("span", { className: "pair" }, sign), mark.label);
    }));
    for (const plot of plots) plot.draw();
  };
  element.replaceChildren(...(marks.size > 1 ? [legend] : []), grid);
  let width = 0;
  new ResizeObserver(() => { const now = element.getBoundingClientRect().width; if (now !== width) { width = now; draw(); } }).observe(element);
  dark.addEventListener("change", draw);
  draw();
  return { plots, views: [...views.values()] };
});
