"use strict";
// D: what the page carries (selflock/view/shown.py says what is in it). Here: its runs, and how numbers and units are written.

function decode(text, Kind) {
  const characters = atob(text), bytes = new Uint8Array(characters.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = characters.charCodeAt(i);
  return new Kind(bytes.buffer);
}

class Run {
  constructor(told) {
    this.label = told.label;
    this.time = decode(told.time, Float64Array);
    this.told = new Map(told.columns.map(column => [column.name, column]));
    this.kept = new Map();
    this.found = 0;
  }
  has(name) { return this.told.has(name); }
  bounds(name) {  // of its intervals, where it has some
    const one = this.told.get(name);
    if (one.low && !one.ends) one.ends = [decode(one.low, Float32Array), decode(one.high, Float32Array)];
    return one.ends;
  }
  values(name) {
    if (!this.kept.has(name)) {
      const one = this.told.get(name);
      this.kept.set(name, "same" in one ? new Float32Array(this.time.length).fill(one.same) : decode(one.values, Float32Array));
    }
    return this.kept.get(name);
  }
  place(t) {  // the last row that is not later
    const time = this.time;
    let k = this.found;
    if (!(time[k] <= t && (k + 1 >= time.length || t < time[k + 1]))) {
      let low = 0, high = time.length - 1;
      while (low < high) { const middle = (low + high + 1) >> 1; if (time[middle] <= t) low = middle; else high = middle - 1; }
      k = low;
    }
    return this.found = k;
  }
  near(name, t) {  // the row nearest to a time that has a value, -1 where there is none
    const values = this.values(name), time = this.time;
    let best = -1;
    for (let k = 0; k < time.length; k++) if (Number.isFinite(values[k]) && (best < 0 || Math.abs(time[k] - t) < Math.abs(time[best] - t))) best = k;
    return best;
  }
  at(name, t) {
    const values = this.values(name), time = this.time, last = time.length - 1;
    if (t < time[0] || t > time[last]) return NaN;
    const k = this.place(t);
    if (k >= last || this.told.get(name).steps) return values[k];
    const span = time[k + 1] - time[k], share = span > 0 ? (t - time[k]) / span : 0;
    return share > 0 ? values[k] + share * (values[k + 1] - values[k]) : values[k];
  }
  held(name, t) { return this.at(name, Math.min(Math.max(t, this.time[0]), this.time[this.time.length - 1])); }
}

const runs = (D.runs || []).map(told => new Run(told));
const BEGIN = Math.min(...runs.map(run => run.time[0])), END = Math.max(...runs.map(run => run.time[run.time.length - 1]));

const RAISED = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };
const raised = digits => [...String(digits)].map(d => RAISED[d] || "").join("");

function unit(text) {  // N.m/s2 as N·m/s²
  return text === "Ohm" ? "Ω" : text.replace(/\./g, "·").replace(/([A-Za-z])(-?\d+)/g, (_, letter, power) => letter + raised(power));
}

function number(v, digits = 4) {
  if (!Number.isFinite(v)) return "–";
  const size = Math.abs(v);
  if (size !== 0 && (size >= 1e6 || size < 1e-3)) {
    const [mantissa, power] = v.toExponential(Math.max(0, digits - 2)).split("e");
    return `${mantissa.replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "").replace("-", "−")}·10${raised(Number(power))}`;
  }
  const text = size >= 10 ** (digits - 1) ? String(Math.round(v)) : v.toPrecision(digits).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "");
  return text.replace("-", "−");
}

const QUANTITY = {
  "N.m": "torque", N: "force", A: "current", V: "voltage", W: "power", J: "energy", rad: "angle", deg: "angle", "rad/s": "speed", "1/min": "speed",
  "rpm": "speed", "rad/s2": "acceleration", m: "length", "m/s": "speed", "m/s2": "acceleration", s: "time", K: "temperature", degC: "temperature", Pa: "pressure", "": "no unit",
};
const axis = (text, power = 0) => {  // what stands over an axis, whose labels are in that power of ten
  const of = [power ? `10${raised(power)}` : "", unit(text)].filter(Boolean).join(" ");
  return text && text in QUANTITY ? `${QUANTITY[text]} in ${of}` : of || "no unit";
};

const day = t => new Date(1000 * t).toISOString().slice(0, 10);
const seconds = t => D.dates ? day(t) : `${t.toFixed(END - BEGIN >= 1000 ? 1 : END - BEGIN >= 1 ? 2 : Math.min(12, Math.ceil(3 - Math.log10(END - BEGIN || 1))))} s`;

const dark = matchMedia("(prefers-color-scheme: dark)");
const PALETTES = {
  light: ["#1f6fb2", "#c2571a", "#24804e", "#8a4fb5", "#b3261e", "#0f8797", "#8f6b00", "#bf3f8b"],
  dark: ["#6cb2f0", "#f0955a", "#6bcf95", "#c49bea", "#f2817a", "#5fd0dd", "#dcb84a", "#f08cc6"],
};
const THEMES = {
  light: { ink: "#20262e", soft: "#5b6570", line: "#e3e7eb", zero: "#9aa3ad", paper: "#ffffff", shade: "#eef2f5", ground: "#d7dde2", edge: "#8b95a0", body: "#d5dce3", ends: ["#6b7580", "#7a5ea8", "#1f7f93"] },
  dark: { ink: "#e4e8ec", soft: "#9aa5b1", line: "#2b333c", zero: "#5b6570", paper: "#14181d", shade: "#222932", ground: "#2c353f", edge: "#6b7785", body: "#3a4653", ends: ["#93a0ad", "#b79be0", "#56bccf"] },
};
const theme = () => THEMES[dark.matches ? "dark" : "light"];
const colour = number => {  // of a palette by its number, of the theme by its name, or as it is
  const all = PALETTES[dark.matches ? "dark" : "light"];
  return typeof number === "string" ? theme()[number] || number : all[number % all.length];
};
const DASHES = [[], [7, 5], [2, 4], [10, 4, 2, 4]];  // of the first run, the second, …
function sample(dash, tint) {  // the same as a background
  let at = 0;
  const stops = DASHES[dash % 4].flatMap((length, k) => { const from = at; at += length; return [`${k % 2 ? "transparent" : tint} ${from}px ${at}px`]; });
  return stops.length ? `repeating-linear-gradient(90deg, ${stops.join(", ")})` : tint;
}
const FONT = "12px system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif";

function fit(canvas) {  // its context in CSS pixels, and its size
  const ratio = window.devicePixelRatio || 1, box = canvas.getBoundingClientRect();
  const width = Math.max(1, Math.round(box.width * ratio)), height = Math.max(1, Math.round(box.height * ratio));
  if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, box.width, box.height);
  g.font = FONT;
  return [g, box.width, box.height];
}

function make(tag, inside, ...content) {  // an element; what is text stays text
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(inside || {})) key in element ? element[key] = value : element.setAttribute(key, value);
  element.append(...content);
  return element;
}
