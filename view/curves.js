// Curves over time. Those of one unit share a panel and its axis; a component has one colour, where an axis has one curve of it, a run one dash.

class Panel {  // of one unit, or of what its curves call their panel: {label, colour, unit, lines: [{run, name}], drop, panel, quiet: without an entry in the legend}
  constructor(parent, board) {
    this.board = board; this.curves = [];
    this.legend = make("ul", { className: "legend" });
    this.base = make("canvas", { role: "img" });
    this.over = make("canvas", { "aria-hidden": "true" });
    this.plot = make("div", { className: "plot" }, this.base, this.over);
    this.element = make("section", { className: "panel" }, this.legend, this.plot);
    parent.append(this.element);
    touch(this.plot, board, this);
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
    note(g, W, this.H, rows, x, near.y, colour(near.curve.colour), ink);
  }
}
