"""Plants of five domains (domains.py) that only the tests know, beside FMUs that lack something of them; what hides is drawn at random.

Nature is integrated by scipy's odeint (LSODA) row by row, in the units of its own balances (W, m3/s, V, N); what hides
acts there, between the FMUs' inputs and the states. The FMUs are native (tests/native), one is of pythonfmu; they know
numbers of the kind of nature's, 20 % off, and nothing of what hides.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.integrate import odeint

# benchmarks read this file, too: by another name, and without the folder of its neighbour
sys.path += [str(Path(__file__).parent), str(Path(__file__).parents[2] / "native")]

from domains import DOMAINS, PYTHON, Domain

ROWS = 500
NOISE = 0.005  # of a sensor, over its spread; the command as it is recorded has a fifth of it
PIECES = 40  # of a row, in which a sensor that lags follows what it senses
OFF = 0.2  # by which the FMUs' numbers differ from nature's, at most


# --- what may hide ------------------------------------------------------------------------------------------------------


def _w(v, width):
    return np.tanh(v / width)


LAWS: dict[str, Callable] = {
    # of x, and of its size as the plant has it with nothing hidden; all of the size of 1 there
    "quadratic": lambda x, size: (x / size) ** 2,
    "drag": lambda x, size: x * abs(x) / size**2,
    "cubic": lambda x, size: (x / size) ** 3,
    "power": lambda x, size: np.copysign((abs(x) / size) ** 4.0, x),
    "square root": lambda x, size: np.copysign((abs(x) / size) ** 0.5, x),
    "Coulomb": lambda x, size: _w(x, 0.03 * size),
    "Stribeck": lambda x, size: (0.6 + 0.8 * np.exp(-((x / (0.2 * size)) ** 2))) * _w(x, 0.03 * size),
    "dead band": lambda x, size: np.copysign(max(abs(x) - 0.5 * size, 0.0) / size * 3.0, x),
    "limit": lambda x, size: max(x - 0.5 * size, 0.0) / size * 3.0,
}
OUTSIDE: dict[str, Callable] = {
    "bump": lambda x, size: np.exp(-(((x - 0.35 * size) / (0.2 * size)) ** 2)),
    "ripple": lambda x, size: np.sin(7.0 * x / size + 0.6) * (x / size),
    "steps": lambda x, size: 0.5 * (_w(x - 0.55 * size, 0.05 * size) - _w(x - 0.25 * size, 0.05 * size)),
}
SAME_LAW = {
    "power": {"power", "cubic"},
    "drag": {"drag", "quadratic"},
    "quadratic": {"quadratic", "drag"},
    "Stribeck": {"Stribeck"},
}
"""Names that are as right: of what has one sign a drag is quadratic; of a power between third and fifth cubic is no worse a word."""
STATES = ("first order", "Dahl")
PATHS = (
    "offset", "scale", "delay", "lag", "dead zone", "saturation", "rate limit", "quantisation", "sign",
)  # fmt: skip
LINEAR = ("offset", "scale", "delay", "lag", "sign")
"""Of these nobody can tell whether they lie before a linear body or behind it."""
DRAWS = {
    **{f"law: {name}": "law" for name in (*LAWS, *STATES)},
    "law: overflow": "law",
    "law: leak": "law",
    **{f"path: {name}": "path" for name in PATHS},
    "parameter": "parameter",
    "event": "event",
    **{f"outside: {name}": "outside" for name in OUTSIDE},
}
"""Everything that hides, and of which kind it is."""


@dataclass
class Hidden:
    """What hides in a plant: nature's numbers, and the changes it makes. Nothing by default."""

    p: dict[str, float]
    place: str = ""
    over: str = ""
    law: Callable | None = None  # of x: what is added before the input, or a pair of a state's rate and what it adds
    state: Callable | None = None  # z' of (x, x', z)
    path: Callable | None = None  # of all of a signal, at `place`
    follows: Callable | None = None  # instead, of (y, signal, s): where y is after so long, the signal held
    span: tuple[float, float] = (0.0, np.inf)
    also: tuple[str, float] = ("", 0.0)  # where what is taken away comes out, and the share of it
    amount: float = 1.0


@dataclass(frozen=True)
class Case:
    """A hidden case: what is right to be said of it, and what is recorded."""

    domain: Domain
    kind: str
    name: str
    hidden: Hidden
    right: tuple[set[str], set[str], str]  # laws, places, and the variable
    noise: dict[str, float]
    logs: tuple[pd.DataFrame, pd.DataFrame]
    beyond: dict[str, float] = field(default_factory=dict)  # of outputs, rms: what goes beyond what taught, and nobody can close


def commands(rng, domain: Domain) -> np.ndarray:
    """Levels held for a while, in stairs."""
    _, _, low, high = domain.command
    return np.repeat(rng.uniform(low, high, ROWS), rng.integers(8, 30, ROWS))[:ROWS]


def nature(domain: Domain, hidden: Hidden, u: np.ndarray, starts: dict[str, float]) -> np.ndarray:
    """States at all rows, (rows, states)."""
    inside = {name: place for group in domain.over.values() for name, place in group.items()}
    y, found, p = [starts[name] for name in domain.starts], [], hidden.p
    count, z = len(y), 0.0
    here = hidden.law is not None
    at = inside[hidden.over] if hidden.over else 0
    entry = domain.command[0]
    entered = hidden.place == entry
    if entered and hidden.path is not None:
        u = hidden.path(u)
    follows = hidden.follows if entered else None
    came = float(u[0])  # of the command, where it follows what is given
    for k, wanted in enumerate(u):
        found.append(y[:count])
        next_to_come = follows(came, wanted, domain.step) if follows else wanted
        held = domain.sampled(y, next_to_come, p) if domain.sampled else wanted  # what it is given goes on with it, once a row

        def rates(y, t, held=held, came=came, wanted=wanted, since=k * domain.step):
            x = y[at]
            given = follows(came, wanted, t - since) if follows and not domain.sampled else held
            acting = hidden.span[0] <= t < hidden.span[1]
            value = hidden.amount * hidden.law(x, y[-1]) if here and acting else 0.0

            def add(place):
                if place == hidden.place:
                    return value
                return -hidden.also[1] * value if place == hidden.also[0] else 0.0

            rate = domain.change(y, given, p, add)
            return [*rate, hidden.state(x, rate[at], y[-1]) if hidden.state else 0.0]

        ends = odeint(
            rates, [*y[:count], z], [k * domain.step, (k + 1) * domain.step], rtol=1e-8, atol=1e-9, hmax=domain.step / 4
        )[-1]
        y, z = list(ends[:count]), ends[-1]
        came = next_to_come
    return np.array(found)


def read(domain: Domain, hidden: Hidden, states: np.ndarray) -> dict[str, np.ndarray]:
    """What sensors make of them, by FMU variable."""
    seen = {name: states[:, place] for name, (_, place) in domain.outputs.items()}
    if hidden.path is not None and hidden.place in seen:
        seen[hidden.place] = hidden.path(seen[hidden.place])
    if hidden.follows is not None and hidden.place in seen:
        y = [s := (signal := seen[hidden.place])[0]]
        for end in signal[1:]:
            now = y[-1]
            for share in (np.arange(PIECES) + 0.5) / PIECES:  # straight from row to row
                now = hidden.follows(now, s + (end - s) * share, domain.step / PIECES)
            y.append(now)
            s = end
        seen[hidden.place] = np.array(y)
    return seen


def hide(name: str, seed: int, domain: str = "") -> Case:
    """The case of a seed: what hides (of DRAWS, or "none"), in which domain, how strongly, beside which noise."""
    rng = np.random.default_rng([seed, *name.encode()])
    strength = float(np.exp(rng.uniform(*np.log((4.0, 40.0)))))
    for _ in range(50):
        d = DOMAINS[domain or str(rng.choice(list(DOMAINS)))]
        about = lambda values: {n: v * rng.uniform(1.0 - OFF, 1.0 + OFF) for n, v in values.items()}
        p = about(d.free) | d.known
        plain = Hidden(p)
        runs = [(commands(rng, d), about(d.starts)) for _ in range(2)]
        sound = [nature(d, plain, *run) for run in runs]
        seen = [read(d, plain, states) for states in sound]
        noise = {n: NOISE * float(np.std(np.concatenate([one[n] for one in seen]))) for n in d.outputs}
        made = _made(name, rng, d, plain, runs, np.concatenate(sound), seen)
        if made is None:
            continue
        hidden, right, judged = made
        far = lambda h: _far(d, h, runs[0], seen[0], noise)
        if hidden.law is not None:
            for _ in range(4):
                hidden.amount *= strength / max(far(hidden), 1e-9)
        if not 2.0 < far(hidden) < 400.0 and name != "none":
            continue
        logs = [_log(rng, d, h, run, noise) for h, run in zip((hidden, judged or hidden), runs)]
        beyond = _beyond(d, hidden, runs) if DRAWS.get(name) == "outside" else {}
        return Case(d, DRAWS.get(name, "none"), name, hidden, right, noise, tuple(logs), beyond)
    raise AssertionError(f"{name}, seed {seed}: nothing that shows was drawn")


def _far(d, hidden, run, seen, noise) -> float:
    """How far what hides moves what is recorded, over its noise, where it moves most."""
    changed = read(d, hidden, nature(d, hidden, *run))
    return max(float(np.sqrt(np.mean((changed[n] - seen[n]) ** 2))) / noise[n] for n in noise)


def _beyond(d: Domain, hidden: Hidden, runs) -> dict[str, float]:
    """What is left of the run that judges where the law stays as at the ends of what taught: of an unknown law nobody knows more."""
    over = {name: place for group in d.over.values() for name, place in group.items()}[hidden.over]
    taught, judges = (nature(d, hidden, *run) for run in runs)
    low, high = taught[:, over].min(), taught[:, over].max()
    held = replace(hidden, law=lambda x, z: hidden.law(min(max(x, low), high), z))
    left = nature(d, held, *runs[1]) - judges
    return {name: float(np.sqrt(np.mean(left[:, place] ** 2))) for name, (_, place) in d.outputs.items()}


def _log(rng, d: Domain, hidden: Hidden, run, noise) -> pd.DataFrame:
    u, starts = run
    seen = read(d, hidden, nature(d, hidden, u, starts))
    columns = {"time": d.step * np.arange(ROWS), d.command[1]: u + 0.2 * NOISE * np.std(u) * rng.standard_normal(ROWS)}
    for name, (column, _) in d.outputs.items():
        columns[column] = seen[name] + noise[name] * rng.standard_normal(ROWS)
    return pd.DataFrame(columns)


def _made(name, rng, d: Domain, plain: Hidden, runs, states, seen):
    """What hides, what is right to say of it, and what hides in the log that judges where that is something else."""
    kind, _, what = name.partition(": ")
    if name == "none":
        return plain, (set(), set(), ""), None
    place = str(rng.choice(list(d.over)))
    over = str(rng.choice(list(d.over[place])))
    x = states[:, {n: k for group in d.over.values() for n, k in group.items()}[over]]
    size = float(abs(x).max())
    sign = float(rng.choice([-1.0, 1.0])) if d.name == "electrical" and kind != "law" else -1.0
    if what == "overflow":
        if d.name != "hydraulic":
            return None
        level = float(np.quantile(x := states[:, 0], 0.6))
        made = replace(plain, place="upper.inflow", over="upper.level", amount=-1.0, also=("lower.inflow", 0.3))
        made.law = lambda x, z: max(x - level, 0.0)
        return made, ({"overflow"}, {"upper.inflow"}, "upper.level"), None
    if what == "leak":
        if d.name != "hydraulic":
            return None
        made = replace(plain, place="upper.inflow", over="upper.level", amount=-1.0, law=lambda x, z: max(x, 0.0) ** 0.5)
        return made, ({"square root"}, {"upper.inflow"}, "upper.level"), None
    if kind == "outside" or what in LAWS:
        if d.name == "hydraulic" and what in ("Coulomb", "Stribeck", "dead band", "square root"):
            return None  # a level has one sign, and an outlet is a square root
        f = (OUTSIDE | LAWS)[what]
        made = replace(plain, place=place, over=over, amount=sign, law=lambda x, z: f(x, size))
        return made, (SAME_LAW.get(what, {what}) if kind == "law" else {"table"}, {place}, over), None
    if what == "first order":
        late = float(rng.uniform(20.0, 60.0)) * d.step
        made = replace(plain, place=place, over=over, amount=sign, law=lambda x, z: z, state=lambda x, v, z: (x - z) / late)
        return made, ({what}, {place}, over), None
    if what == "Dahl":
        width = 0.2 * size
        made = replace(plain, place=place, over=over, amount=-1.0, law=lambda x, z: z)
        made.state = lambda x, v, z: (v - abs(v) * z) / width
        return made, ({what, "LuGre", "Bouc-Wen"}, {place}, over), None
    if kind == "path":
        return _path(what, rng, d, plain, runs, seen)
    if name == "event":
        end = ROWS * d.step
        since = float(rng.uniform(0.1, 0.5)) * end
        span = since, since + float(rng.uniform(0.15, 0.4)) * end
        return replace(plain, place=place, amount=sign, law=lambda x, z: 1.0, span=span), ({"event"}, d.among(place), ""), plain
    if name == "parameter":
        number = str(rng.choice(list(d.known)))
        p = plain.p | {number: plain.p[number] * float(rng.choice([0.5, 0.65, 1.5, 2.0]))}
        return replace(plain, p=p), ({"parameter"}, {number}, ""), None
    return None


def _path(what, rng, d: Domain, plain: Hidden, runs, seen):
    """A path: of the command, or of a sensor that nothing else listens to."""
    listened = d.name in ("mechanical",)
    places = [d.command[0]] + ([] if listened else list(d.outputs))
    place = str(rng.choice(places))
    signal = np.concatenate([u for u, _ in runs] if place == d.command[0] else [one[place] for one in seen])
    spread, size, step = float(np.std(signal)), float(abs(signal).max()), d.step
    rows = int(rng.integers(3, 12))
    hold = lambda s, n: np.concatenate([s[:1].repeat(n), s[:-n]])
    part = float(rng.uniform(0.1, 0.4))
    high, low = float(np.quantile(signal, 0.85 - part)), part * size * 0.6

    follows = {
        "lag": lambda y, s, dt: s + (y - s) * np.exp(-dt / (rows * step)),
        "rate limit": lambda y, s, dt: y + min(max(s - y, -most * dt), most * dt),
    }.get(what)
    most = 1.5 * spread / (rows * step)
    made = {
        "offset": lambda s: s + part * spread,
        "scale": lambda s: (1.0 + part) * s,
        "delay": lambda s: hold(s, rows),
        "dead zone": lambda s: np.sign(s) * np.maximum(abs(s) - low, 0.0),
        "saturation": lambda s: np.minimum(s, high),
        "quantisation": lambda s: np.round(s / (2.0 * part * spread)) * 2.0 * part * spread,
        "sign": lambda s: -s,
    }.get(what)
    if what in ("sign", "dead zone") and d.name == "hydraulic":
        return None  # what flows and stands there has one sign
    names = {"offset": {"offset", "constant"}, "saturation": {"saturation (high)"}}.get(what, {what})
    places = (d.among(place) if what in LINEAR else {place}) | {f"recorded {place}"}
    return replace(plain, place=place, path=made, follows=follows), (names, places, ""), None


# --- what is given to the diagnosis ----------------------------------------------------------------------------------------


def built(fmus, folder: Path) -> None:
    """The FMUs, in a folder."""
    from pack import pack

    for name in fmus:
        if name in PYTHON:
            (folder / f"{name}.py").write_text(PYTHON[name])
            command = [sys.executable, "-m", "pythonfmu", "build", "-f", f"{name}.py", "-d", "."]
            subprocess.run(command, cwd=folder, check=True, capture_output=True)
        else:
            pack(name, folder)


def write(case: Case, folder: Path) -> tuple[Path, Path, Path]:
    """rig.toml, train.csv, test.csv and all that the rig names, in a folder."""
    d = case.domain
    built(d.fmus, folder)
    run = f"[run]\nstop = {ROWS * d.step}\nstep = {d.step / d.parts!r}\nopen_inputs = true\n"
    (folder / "system.toml").write_text(run + _tables(d.system))
    columns = [(d.command[0], d.command[1]), *((name, column) for name, (column, _) in d.outputs.items())]
    free = [f'"{n}" = {{ start = {v}, low = {0.2 * v}, high = {5.0 * v} }}' for n, v in d.free.items()]
    for n, v in d.starts.items():
        wide = 5.0 * max(abs(v), 0.2)
        low = 0.0 if d.name == "hydraulic" else -wide
        free.append(f'"{n}" = {{ start = {v}, low = {low}, high = {wide}, each_run = true }}')
    known = [f'"{n}" = {v}' for n, v in d.known.items()]
    text = ["[rig]", 'system = "system.toml"', f"step = {d.step / d.parts!r}", 'inputs = "held"', "", "[columns]"]
    text += [f'"{n}" = "{c}"' for n, c in columns] + ["", "[calibrate]", *free, "", "[parameters]", *known]
    paths = folder / "rig.toml", folder / "train.csv", folder / "test.csv"
    paths[0].write_text("\n".join(text) + "\n")
    for path, log in zip(paths[1:], case.logs):
        log.to_csv(path, index=False)
    return paths


def _tables(text: str) -> str:
    """[components] as short as they are above, as the tables that a system file has."""
    head, _, links = text.partition("[connections]")
    parts = [line.split(" = ") for line in head.splitlines() if " = " in line]
    return "".join(f"\n[components.{n}]\nfmu = {path}\n" for n, path in parts) + "\n[connections]" + links


def judged(case: Case, result) -> dict:
    """Whether an answer is right, what it says, and how much of what could be closed is closed."""
    names, places, over = case.right
    first = result.causes[0] if result.causes else None
    said = [cause.label for cause in result.causes]
    off = {e.name: (e.before, e.after) for e in result.errors}
    if case.name == "event":
        off = {e.name: (e.taught_before, e.taught_after) for e in result.errors}
    ratio = max((before or 0.0) / case.noise[n] for n, (before, _) in off.items())
    shows = max(off, key=lambda n: (off[n][0] or 0.0) / case.noise[n])
    before, after = (float(e or np.inf) for e in off[shows])
    floor = case.noise[shows]
    share = lambda rest: 1.0 - (after**2 - rest) / max(before**2 - rest, 1e-300)
    closed, of_reach = share(floor**2), share(floor**2 + case.beyond.get(shows, 0.0) ** 2)
    if case.kind == "none":
        right = result.verdict == "none"
    elif case.kind == "outside":
        right = first is not None and first.kind == "curve" and first.over == over and first.place in places
    else:
        there = (
            first is not None
            and {first.place, first.label, f"recorded {first.place}" if first.where == "read" else first.place} & places
        )
        right = first is not None and first.law in names and bool(there) and first.over == over
    beside, same = (list(first.beside), list(first.same)) if first else ([], [])
    told = bool({*same} & labels(case))
    good = case.kind != "outside" or bool(result.verdict == "unknown" and closed >= 0.7)
    curve = case.kind == "outside" and result.verdict == "unknown" and bool(right or told)
    return {
        "verdict": result.verdict, "answers": said, "right": bool(good and (right or told)), "first": bool(good and right),
        "ratio": [ratio], "closed": closed, "of_reach": of_reach, "curve": curve, "alike": good and not (right or told) and bool({*beside} & labels(case)),
        "beside": beside, "same": same,
    }  # fmt: skip


def labels(case: Case) -> set[str]:
    """The right names, as they are told beside one that the logs cannot tell from them."""
    names, places, over = case.right
    if case.kind == "parameter":
        return places
    if case.kind == "outside":
        names = {"curve", "fine curve"}
    of = f" of {over}" if over else ""
    if "overflow" in names:
        return {f"overflow{of}: from {place} on to {case.hidden.also[0]}" for place in places}
    return {f"{law}{of} on {place}" for law in names for place in places}
