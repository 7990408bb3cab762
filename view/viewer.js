// The page's parts joined: what moves, the curves, the time they share, what is picked, and keys.

class Board {
  constructor(parent) {
    this.time = D.dates ? END : BEGIN; this.view = [BEGIN, END > BEGIN ? END : BEGIN + 1]; this.hover = null; this.drag = null;
    this.playing = false; this.last = 0;
    this.picked = []; this.panels = new Map();
    const stages = make("div", { className: "stages" });
    this.stages = (D.stages || []).map(told => new Stage(told, stages));
    if (this.stages.length) parent.append(stages);
    const board = make("div", { className: "board" }), curves = make("div", { className: "curves" });
    this.curves = curves;
    if (D.choices) this.choice = D.choices.at(-1);
    else { board.classList.add("picks"); board.append(this.picker()); }
    board.append(curves);
    parent.append(this.bar(), board);
    for (const name of D.picked || []) this.pick(name, true, false);
    this.arrange();
  }

  // --- the time ---------------------------------------------------------------------------------------------------

  bar() {
    const span = END - BEGIN;
    this.play = make("button", { className: "play", ariaLabel: "Play or pause", onclick: () => this.start(!this.playing) }, make("span", {}, "▶"), make("span", { className: "word" }, " Play"));
    this.slider = make("input", { type: "range", min: 0, max: 1000, step: 1, value: 0, ariaLabel: "Time", oninput: () => { this.start(false); this.seek(BEGIN + span * this.slider.value / 1000); } });
    this.clock = make("output", {});
    const speeds = [], usual = span / 30 > 1 ? span / 30 : span < 2 ? span / 4 : 1;
    for (let power = -4; power <= 4; power++) for (const m of [1, 2, 5]) { const s = m * 10 ** power; if (s >= span / 200 / 5 && s <= Math.max(span / 1.5, 2 * usual)) speeds.push(s); }
    this.rate = speeds.reduce((best, s) => Math.abs(Math.log(s / usual)) < Math.abs(Math.log(best / usual)) ? s : best, speeds[0] || 1);
    const pace = make("select", { ariaLabel: "Speed of playing", title: "speed of playing, of real time" });
    for (const s of speeds.length ? speeds : [1]) pace.append(make("option", { value: s, selected: s === this.rate }, `${number(s)} ×`));
    pace.onchange = () => { this.rate = Number(pace.value); };
    const zoom = make("span", { className: "group", role: "group", ariaLabel: "Zoom" },
      make("button", { onclick: () => this.zoom(2), ariaLabel: "See more time", title: "see more time (-)" }, "−"),
      make("button", { onclick: () => this.zoom(0.5), ariaLabel: "See less time", title: "see less time (+)" }, "+"),
      make("button", { onclick: () => this.all(), ariaLabel: "See all of the time", title: "all of the time (0)" }, "all"));
    const played = D.dates ? [] : [this.play, this.slider, this.clock, make("label", { className: "speed" }, pace)];
    const bar = make("div", { className: "bar" }, ...played, zoom);
    if (D.choices && D.choices.length > 1) {
      const group = make("span", { className: "group", role: "group", ariaLabel: "Curves" });
      for (const choice of D.choices) group.append(make("button", { ariaPressed: String(choice === this.choice), onclick: event => {
        this.choice = choice;
        for (const button of group.children) button.ariaPressed = String(button === event.currentTarget);
        this.arrange();
      } }, choice.label));
      bar.append(group);
    }
    return bar;
  }

  start(on) {
    if (on === this.playing || D.dates) return;
    this.playing = on; this.last = 0; [this.play.firstChild.textContent, this.play.lastChild.textContent] = on ? ["❚❚", " Pause"] : ["▶", " Play"];
    if (on) { if (this.time >= END) this.time = BEGIN; requestAnimationFrame(stamp => this.tick(stamp)); }
  }

  tick(stamp) {
    if (!this.playing) return;
    let t = this.time + (this.last ? this.rate * (stamp - this.last) / 1000 : 0);
    this.last = stamp;
    if (t >= END) { t = D.again ? BEGIN : END; if (!D.again) this.start(false); }
    this.seek(t);
    if (this.playing) requestAnimationFrame(next => this.tick(next));
  }

  seek(t) {
    this.time = Math.max(BEGIN, Math.min(END, t));
    const [a, b] = this.view;
    if (this.time < a || this.time > b) { const from = Math.max(BEGIN, Math.min(END - (b - a), this.time)); this.show(from, from + b - a); }
    this.now();
  }

  now() {  // draw what depends on the time alone
    for (const stage of this.stages) stage.draw(this.time);
    for (const panel of this.panels.values()) panel.mark();
    if (END > BEGIN) this.slider.value = 1000 * (this.time - BEGIN) / (END - BEGIN);
    this.clock.textContent = seconds(this.time);
    this.slider.setAttribute("aria-valuetext", this.clock.textContent);
  }

  point(t) { this.hover = t; for (const panel of this.panels.values()) panel.mark(); }

  show(a, b) {
    const least = Math.max((END - BEGIN) * 1e-6, 1e-12), span = Math.max(least, Math.min(END - BEGIN || 1, b - a));
    a = Math.max(BEGIN, Math.min(END - span, a));
    this.view = [a, a + span];
    for (const panel of this.panels.values()) panel.draw();
  }

  all() { this.show(BEGIN, END); }

  zoom(share) {
    const [a, b] = this.view, middle = this.time >= a && this.time <= b ? this.time : (a + b) / 2;
    this.show(middle - (middle - a) * share, middle + (b - middle) * share);
  }

  // --- what is seen -----------------------------------------------------------------------------------------------

  pick(name, on, draw = true) {
    const known = this.picked.findIndex(one => one.name === name);
    if (on && known < 0 && runs.some(run => run.has(name))) {
      const used = new Set(this.picked.map(one => one.colour));
      let free = 0;
      while (used.has(free) && free < this.picked.length) free++;
      const owner = text => text.slice(0, text.lastIndexOf(".")), unit = text => runs.find(run => run.has(text)).told.get(text).unit;
      const beside = new Set(this.picked.filter(one => unit(one.name) === unit(name)).map(one => one.colour));  // on the same axis
      const mine = this.picked.find(one => owner(name) && owner(one.name) === owner(name) && !beside.has(one.colour));
      this.picked.push({ name, colour: mine ? mine.colour : free });  // a component keeps its colour from axis to axis
    } else if (!on && known >= 0) this.picked.splice(known, 1);
    const box = this.boxes && this.boxes.get(name);
    if (box) box.checked = on;
    if (draw) this.arrange();
  }

  wanted() {
    if (D.choices) return this.choice.curves.map(one => ({ ...one, unit: runs[one.run].told.get(one.name).unit, lines: [{ run: one.run, name: one.name, dash: 0 }] }));
    return this.picked.flatMap(({ name, colour }) => {
      const by = new Map();  // a name may have units that are none of each other: an axis each
      runs.forEach((run, k) => { if (run.has(name)) { const of = run.told.get(name).unit; by.set(of, [...(by.get(of) || []), { run: k, name, dash: k }]); } });
      return [...by].map(([unit, lines]) => ({ label: name, colour, unit, lines, drop: () => this.pick(name, false) }));
    });
  }

  arrange() {
    const by = new Map();
    for (const curve of this.wanted()) { const key = curve.panel ?? curve.unit; by.set(key, [...(by.get(key) || []), curve]); }
    for (const [key, panel] of this.panels) if (!by.has(key)) { panel.element.remove(); this.panels.delete(key); }
    for (const [key, list] of by) {
      if (!this.panels.has(key)) this.panels.set(key, new Panel(this.curves, this));
      this.panels.get(key).set(list);
    }
    this.none?.remove();
    if (!by.size) this.curves.append(this.none = make("p", { className: "empty" }, "No curve is picked: choose some by their names."));
    if (this.count) this.count.textContent = `${this.picked.length} of ${this.boxes.size} curves`;
    this.redraw();
  }

  redraw() {
    for (const panel of this.panels.values()) panel.draw();
    this.now();
  }

  picker() {
    const names = new Map();
    for (const run of runs) for (const [name, told] of run.told) if (!names.has(name)) names.set(name, told.unit);
    const groups = new Map();
    for (const [name, of] of names) { const owner = name.slice(0, Math.max(0, name.lastIndexOf("."))); groups.set(owner, [...(groups.get(owner) || []), [name, of]]); }
    this.boxes = new Map();
    const list = make("div", { className: "list" }), rows = [];
    for (const [owner, members] of groups) {
      const inside = make("details", { open: groups.size === 1 }, make("summary", {}, owner || "variables"));
      for (const [name, of] of members) {
        const box = make("input", { type: "checkbox", onchange: () => this.pick(name, box.checked) });
        this.boxes.set(name, box);
        const row = make("label", {}, box, make("span", {}, name.slice(owner ? owner.length + 1 : 0)), make("span", { className: "unit" }, unit(of)));
        rows.push([name.toLowerCase(), row]);
        inside.append(row);
      }
      list.append(inside);
    }
    this.search = make("input", { type: "search", placeholder: "search, such as torque", ariaLabel: "Search for curves by name", oninput: () => {
      const words = this.search.value.toLowerCase().split(/\s+/).filter(Boolean);
      for (const [name, row] of rows) row.style.display = words.every(word => name.includes(word)) ? "" : "none";
      for (const inside of list.children) {
        const any = [...inside.querySelectorAll("label")].some(row => row.style.display !== "none");
        inside.style.display = any ? "" : "none";
        inside.open = groups.size === 1 || (words.length > 0 && any);
      }
    } });
    this.count = make("span", {});
    const all = make("details", { className: "picker", open: matchMedia("(min-width: 900px)").matches }, make("summary", {}, this.count), this.search, list);
    return all;
  }
}

const viewer = document.getElementById("viewer");
viewer.replaceChildren();
const board = new Board(viewer);

document.addEventListener("keydown", event => {
  const on = event.target, typing = on.matches("input[type=search], select, textarea"), pressing = on.matches("button, summary, a, input[type=checkbox]");
  if (event.ctrlKey || event.metaKey || event.altKey || typing) { if (event.key === "Escape") on.blur(); return; }
  const step = (board.view[1] - board.view[0]) * (event.shiftKey ? 0.1 : 0.01);
  const keys = {
    ArrowLeft: () => board.seek(board.time - step), ArrowRight: () => board.seek(board.time + step),
    Home: () => board.seek(BEGIN), End: () => board.seek(END),
    "+": () => board.zoom(0.5), "=": () => board.zoom(0.5), "-": () => board.zoom(2), 0: () => board.all(),
    "/": () => board.search?.focus(),
  };
  if (event.key === " " && !pressing) { event.preventDefault(); board.start(!board.playing); }
  else if (keys[event.key]) { event.preventDefault(); if (event.key.length > 1) board.start(false); keys[event.key](); }
});
for (const mark of document.querySelectorAll("[data-at]")) mark.onclick = () => { board.start(false); board.seek(Number(mark.dataset.at)); };

let width = 0;
new ResizeObserver(() => { const now = viewer.getBoundingClientRect().width; if (now !== width) { width = now; board.redraw(); } }).observe(viewer);
dark.addEventListener("change", () => board.arrange());
const asked = new URLSearchParams(location.search).get("t");
if (asked !== null && Number.isFinite(Number(asked))) board.seek(Number(asked));
else if (D.plays && !matchMedia("(prefers-reduced-motion: reduce)").matches) board.start(true);
