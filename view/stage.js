// Moving pictures: shapes that columns move (selflock/master/about.py says how), several runs over each other.

class Stage {
  constructor(told, parent) {
    this.told = told;
    this.canvas = make("canvas", { role: "img", "aria-label": `Moving picture of ${told.label}` });
    const box = make("div", { className: "stage" }, this.canvas);
    if (told.of.length > 1) box.append(make("div", { className: "runs" }, ...told.of.map(one =>
      make("div", {}, `${["solid", "dashed", "dotted", "dash-dot"][one.run % 4]}: ${runs[one.run].label}`))));
    parent.append(box);
  }

  draw(t) {
    const [g, W, H] = fit(this.canvas), ink = theme(), first = this.told.of[0], run = runs[first.run];
    const tall = first.height, scale = Math.min(W / first.width, (H - 26) / tall);
    const x0 = first.follow.length ? run.held(first.follow[0], t) : first.middle;
    const level = first.ground ? this.level(first.ground, x0, 0.36 * first.width) : first.floor;
    const base = first.follow.length ? H - 30 - first.below * scale : H - 24;
    const X = x => W / 2 + (x - x0) * scale, Y = y => base - (y - level) * scale;
    if (first.ground) this.ground(g, first.ground, X, Y, W, H, x0, scale, ink, true);
    for (const one of this.told.of.slice(1)) if (one.ground) this.ground(g, one.ground, X, Y, W, H, x0, scale, ink, false);
    g.lineJoin = g.lineCap = "round";
    for (const one of [...this.told.of].reverse()) this.shapes(g, one, t, X, Y, scale, ink);
    g.textAlign = "left"; g.fillStyle = ink.ink; g.font = "600 15px system-ui, sans-serif";
    g.fillText(seconds(t), 14, 26);
    const phase = (D.phases || []).find(p => t < p[1]) || (D.phases || []).at(-1);
    if (phase) { g.font = "13px system-ui, sans-serif"; g.fillStyle = ink.soft; g.fillText(phase[2], 14, 46); }
  }

  level(ground, x0, reach) {  // mean height of the ground about here: the eye goes smoothly over stairs
    let sum = 0;
    for (let k = -8; k <= 8; k++) sum += height(ground, x0 + reach * k / 8);
    return sum / 17;
  }

  ground(g, points, X, Y, W, H, x0, scale, ink, solid) {
    const left = x0 - W / scale, right = x0 + W / scale;
    const near = points.filter(p => p[0] > left && p[0] < right);
    const line = [[left, height(points, left)], ...near, [right, height(points, right)]];
    g.beginPath();
    line.forEach(([x, y], k) => k ? g.lineTo(X(x), Y(y)) : g.moveTo(X(x), Y(y)));
    g.strokeStyle = ink.edge; g.lineWidth = 1.2; g.setLineDash(solid ? [] : DASHES[1]); g.stroke(); g.setLineDash([]);
    if (!solid) return;
    g.lineTo(X(right), H + 5); g.lineTo(X(left), H + 5); g.closePath(); g.fillStyle = ink.ground; g.fill();
    if (!this.told.of[0].follow.length) return;
    g.fillStyle = ink.soft; g.strokeStyle = ink.edge; g.textAlign = "center"; g.font = FONT; g.lineWidth = 1;
    const every = scale > 150 ? 0.25 : 0.5;
    for (let k = Math.ceil((x0 - W / 2 / scale) / every); k * every < x0 + W / 2 / scale; k++) {
      const px = X(k * every), labelled = Math.abs(k * every * 2 % 1) < 1e-9;
      g.beginPath(); g.moveTo(px, H - 20); g.lineTo(px, H - 20 + (labelled ? 5 : 3)); g.stroke();
      if (labelled && px > 22 && px < W - 22) g.fillText(`${(k * every).toFixed(1).replace("-", "−")} m`, px, H - 3);
    }
  }

  shapes(g, one, t, X, Y, scale, ink) {
    const run = runs[one.run], ghost = one !== this.told.of[0], value = name => run.held(name, t);
    const sum = by => Object.entries(by).reduce((total, [name, factor]) => total + factor * value(name), 0);
    g.globalAlpha = ghost ? 0.75 : 1; g.setLineDash(DASHES[one.run % 4]);
    for (const shape of one.shapes) {
      let x = 0, y = 0, c = 1, s = 0;
      for (const move of shape.moves) {
        if (move.place) { x = value(move.place[0]); y = value(move.place[1]); }
        if (move.shift) { const [a, b] = move.shift; x += c * a - s * b; y += s * a + c * b; }
        if (move.turn) { const a = Math.atan2(s, c) + sum(move.turn) + (move.plus || 0); c = Math.cos(a); s = Math.sin(a); }
      }
      const at = ([a, b]) => [X(x + c * a - s * b), Y(y + s * a + c * b)];
      const tint = ink.ends[shape.colour % ink.ends.length], style = shape.style;
      const trace = (points, closed) => { g.beginPath(); points.forEach((p, k) => k ? g.lineTo(...at(p)) : g.moveTo(...at(p))); if (closed) g.closePath(); };
      if (style === "track") {
        trace(shape.points, true);
        if (!ghost) { g.fillStyle = ink.paper + "d0"; g.fill(); }
        g.strokeStyle = ink.ink; g.lineWidth = Math.max(1, 0.008 * scale); g.lineCap = "butt";
        if (ghost || !shape.runs || shape.runs.pitch * scale < 3) g.stroke();
        else for (const [p, q] of shoes(shape, sum(shape.runs.by) * shape.runs.per)) { g.beginPath(); g.moveTo(...at(p)); g.lineTo(...at(q)); g.stroke(); }
        g.lineCap = "round";
      } else if (style === "wheel" || style === "mass") {
        const axle = shape.points[0], rim = shape.points.slice(1), spokes = style === "wheel" ? 3 : 0;
        trace(rim, true);
        if (style === "mass") { g.fillStyle = tint; if (!ghost) g.fill(); }
        for (let k = 0; k < spokes; k++) { g.moveTo(...at(axle)); g.lineTo(...at(rim[Math.round(k * (rim.length - 1) / spokes)])); }
        g.strokeStyle = tint; g.lineWidth = Math.max(1.2, 0.004 * scale); g.stroke();
      } else {
        trace(shape.points, shape.closed);
        const body = style === "body" || style === "fixed";
        if (body && !ghost) { g.fillStyle = ink.body; g.fill(); }
        g.strokeStyle = body ? ink.edge : tint; g.lineWidth = body ? 1.2 : ghost ? 2 : Math.max(2, 0.012 * scale * (one.thick || 1)); g.stroke();
      }
      if (shape.label && !ghost) { g.setLineDash([]); g.fillStyle = ink.soft; g.textAlign = "center"; g.font = FONT; wrapped(g, shape.label, ...at(shape.foot), shape.room * scale); g.setLineDash(DASHES[one.run % 4]); }
    }
    g.globalAlpha = 1; g.setLineDash([]);
  }
}

function height(ground, x) {
  let low = 0, high = ground.length - 1;
  if (x <= ground[0][0]) return ground[0][1];
  if (x >= ground[high][0]) return ground[high][1];
  while (high - low > 1) { const middle = (low + high) >> 1; if (ground[middle][0] <= x) low = middle; else high = middle; }
  const [ax, ay] = ground[low], [bx, by] = ground[high];
  return bx > ax ? ay + (by - ay) * (x - ax) / (bx - ax) : by;
}

function shoes(shape, travel) {  // pieces of the outline, a pitch apart, that run along it
  const points = shape.points, n = points.length;
  if (!shape.lengths) { shape.lengths = [0]; for (let k = 0; k < n; k++) { const p = points[k], q = points[(k + 1) % n]; shape.lengths.push(shape.lengths[k] + Math.hypot(q[0] - p[0], q[1] - p[1])); } }
  const total = shape.lengths[n], count = Math.max(1, Math.round(total / shape.runs.pitch)), step = total / count;
  const point = along => {
    along = ((along % total) + total) % total;
    let k = 0; while (k + 1 < n && shape.lengths[k + 1] <= along) k++;
    const share = (along - shape.lengths[k]) / (shape.lengths[k + 1] - shape.lengths[k] || 1), p = points[k], q = points[(k + 1) % n];
    return [p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])];
  };
  return Array.from({ length: count }, (_, k) => [point(travel + k * step), point(travel + (k + 0.78) * step)]);
}

function wrapped(g, text, x, y, room) {  // in lines no wider than that
  let line = "";
  for (const piece of text.split(/(?<=[._ ])/)) {
    if (line && g.measureText(line + piece).width > room) { g.fillText(line, x, y); y += 14; line = ""; }
    line += piece;
  }
  g.fillText(line, x, y);
}
