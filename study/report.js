// Draws the robot and the torque curves at the same instant. D: the data that the report carries.
const robot = document.getElementById("robot"), torque = document.getElementById("torque");
const seek = document.getElementById("seek"), play = document.getElementById("play"), now = document.getElementById("now");
let time = 0, mode = "dynamic", playing = false, last = 0;

function fit(canvas) {
  const ratio = window.devicePixelRatio || 1, box = canvas.getBoundingClientRect();
  canvas.width = Math.round(box.width * ratio); canvas.height = Math.round(box.height * ratio);
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  return [g, box.width, box.height];
}

function frame(t) {  // positions between the two nearest kept postures, in mm
  const at = Math.min(t / D.every, D.frames.length - 1), k = Math.min(Math.floor(at), D.frames.length - 2), w = at - k;
  return D.frames[k].map((a, i) => a + w * (D.frames[k + 1][i] - a));
}

function drawRobot() {
  const [g, W, H] = fit(robot), f = frame(time);
  const scale = Math.min(W / 1250, H / 520), ground = H - 46 * Math.max(scale, .5) - 8, X = x => W / 2 + x * scale, Y = y => ground - y * scale;
  g.clearRect(0, 0, W, H);
  g.fillStyle = "#d7dde2"; g.fillRect(0, ground, W, H - ground);
  g.strokeStyle = "#8b95a0"; g.lineWidth = 1; g.beginPath(); g.moveTo(0, ground); g.lineTo(W, ground); g.stroke();
  g.fillStyle = "#6a737d"; g.font = "12px system-ui, sans-serif"; g.textAlign = "center";
  const left = f[0] - W / 2 / scale, right = f[0] + W / 2 / scale;
  for (let x = Math.ceil(left / 250) * 250; x < right; x += 250) {
    const px = X(x - f[0]);
    g.beginPath(); g.moveTo(px, ground); g.lineTo(px, ground + (x % 500 ? 5 : 9)); g.stroke();
    if (x % 500 === 0) g.fillText((x / 1000).toFixed(1) + " m", px, ground + 23);
  }
  let i = 1;
  g.lineJoin = g.lineCap = "round";
  for (const line of D.lines) {
    g.strokeStyle = line.colour; g.lineWidth = Math.max(1, line.width * scale); g.beginPath();
    if (line.wheel) {
      const x = f[i], y = f[i + 1], dx = f[i + 2] - x, dy = f[i + 3] - y;
      g.arc(X(x), Y(y), Math.hypot(dx, dy) * scale, 0, 7);
      for (let k = 0; k < 3; k++) {  // spokes, so that one sees it turn
        const a = Math.atan2(dy, dx) + 2 * Math.PI * k / 3, r = Math.hypot(dx, dy);
        g.moveTo(X(x), Y(y)); g.lineTo(X(x + r * Math.cos(a)), Y(y + r * Math.sin(a)));
      }
    } else if (line.links) {  // a closed track of shoes
      for (let n = 0; n < line.n; n++) n ? g.lineTo(X(f[i + 2 * n]), Y(f[i + 2 * n + 1])) : g.moveTo(X(f[i]), Y(f[i + 1]));
      g.fillStyle = line.fill; g.fill(); g.beginPath(); g.lineCap = "butt";
      for (let n = 0; n + 1 < line.n; n += 2) { g.moveTo(X(f[i + 2 * n]), Y(f[i + 2 * n + 1])); g.lineTo(X(f[i + 2 * n + 2]), Y(f[i + 2 * n + 3])); }
    } else for (let n = 0; n < line.n; n++) n ? g.lineTo(X(f[i + 2 * n]), Y(f[i + 2 * n + 1])) : g.moveTo(X(f[i]), Y(f[i + 1]));
    i += 2 * line.n;
    if (line.fill && !line.links) { g.fillStyle = line.fill; g.fill(); }
    g.stroke(); g.lineCap = "round";
  }
  g.textAlign = "left"; g.fillStyle = "#20262e"; g.font = "600 15px system-ui, sans-serif";
  g.fillText(time.toFixed(2) + " s", 14, 26);
  const phase = D.phases.find(p => time < p[1]) || D.phases[D.phases.length - 1];
  g.font = "13px system-ui, sans-serif"; g.fillStyle = "#5b6570"; g.fillText(phase[2], 14, 46);
}

function value(curve, t) {
  const at = Math.min(t / D.sample, curve.length - 1), k = Math.min(Math.floor(at), curve.length - 2);
  return curve[k] + (at - k) * (curve[k + 1] - curve[k]);
}

function drawTorque() {
  const [g, W, H] = fit(torque), curves = D.torque[mode], L = 52, R = 10, T = 12, B = 34;
  const low = D.range[0], high = D.range[1], X = t => L + (W - L - R) * t / D.duration, Y = v => T + (H - T - B) * (high - v) / (high - low);
  g.clearRect(0, 0, W, H); g.font = "12px system-ui, sans-serif";
  g.fillStyle = "#f0f3f5"; for (const [a, b] of D.windows) g.fillRect(X(a), T, X(b) - X(a), H - T - B);
  g.fillStyle = "#5b6570"; g.textAlign = "center";
  for (let t = 0; t <= D.duration; t += W < 500 ? 2 : 1) g.fillText(t, X(t), H - B + 16);
  g.fillText("time in s", X(D.duration / 2), H - 4);
  g.textAlign = "right"; g.lineWidth = 1;
  for (let v = Math.ceil(low / D.tick) * D.tick; v <= high; v += D.tick) {
    g.strokeStyle = Math.abs(v) < 1e-9 ? "#8b95a0" : "#e3e7eb"; g.beginPath(); g.moveTo(L, Y(v)); g.lineTo(W - R, Y(v)); g.stroke();
    g.fillText(v.toFixed(1), L - 6, Y(v) + 4);
  }
  g.save(); g.translate(12, T + (H - T - B) / 2); g.rotate(-Math.PI / 2); g.textAlign = "center"; g.fillText(H > 190 ? "torque in N·m" : "N·m", 0, 0); g.restore();
  g.save(); g.beginPath(); g.rect(L, T, W - L - R, H - T - B); g.clip();
  for (const [k, colour] of D.colours.entries()) {
    g.strokeStyle = colour; g.lineWidth = 1.4; g.lineJoin = "round"; g.beginPath();
    curves[k].forEach((v, n) => n ? g.lineTo(X(n * D.sample), Y(v)) : g.moveTo(X(0), Y(v)));
    g.stroke();
  }
  g.restore();
  g.strokeStyle = "#20262e"; g.lineWidth = 1; g.beginPath(); g.moveTo(X(time), T); g.lineTo(X(time), H - B); g.stroke();
  for (const [k, colour] of D.colours.entries()) {
    const v = value(curves[k], time);
    g.fillStyle = colour; g.beginPath(); g.arc(X(time), Math.max(T, Math.min(H - B, Y(v))), 3.5, 0, 7); g.fill();
    now.children[k].lastChild.textContent = ` ${v < 0 ? "−" : "\u2007"}${Math.abs(v).toFixed(3)} N·m`;
  }
}

function draw() { drawRobot(); drawTorque(); seek.value = 1000 * time / D.duration; }
function go(t) { time = Math.max(0, Math.min(D.duration, t)); draw(); }
function tick(stamp) {
  if (!playing) return;
  if (last) time += (stamp - last) / 1000;
  last = stamp;
  if (time >= D.duration) time = 0;
  draw(); requestAnimationFrame(tick);
}
function start(on) {
  playing = on; last = 0; play.textContent = on ? "❚❚ Pause" : "▶ Play";
  if (on) requestAnimationFrame(tick);
}

D.friction.forEach((mu, k) => {
  const item = document.createElement("span"), mark = document.createElement("i");
  mark.style.background = D.colours[k];
  item.append(mark, `μ = ${mu}`, document.createElement("span"));
  now.append(item);
});
play.onclick = () => start(!playing);
seek.oninput = () => { start(false); go(D.duration * seek.value / 1000); };
document.querySelectorAll("[data-mode]").forEach(button => button.onclick = () => {
  mode = button.dataset.mode;
  document.querySelectorAll("[data-mode]").forEach(b => b.setAttribute("aria-pressed", b === button));
  draw();
});
const drag = event => {
  const box = torque.getBoundingClientRect();
  start(false); go((event.clientX - box.left - 52) / (box.width - 62) * D.duration);
};
torque.onpointerdown = event => { torque.setPointerCapture(event.pointerId); drag(event); };
torque.onpointermove = event => { if (event.buttons) drag(event); };
addEventListener("resize", draw);
go(Number(new URLSearchParams(location.search).get("t")) || 0);
if (!location.search && !matchMedia("(prefers-reduced-motion: reduce)").matches) start(true);
