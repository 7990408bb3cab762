"""What a load and a gear's friction ask for while the load is moved against its pull, against what the motor could give.

    F = max(P (t + mu) / (r t (1 - mu t)),  P / r + mu N0 sqrt(1 + t^2)) + b |w| + M_d,  P = M_c + m g d cos(phi) + b_l |w| / r
    |F| <= |M|,  else k_m |u| / R       (17): a motor that drives gives no more than at a standstill

A load that somebody balances by a spring asks for less than its weight, never for a thirtieth of it.
"""

from __future__ import annotations

import numpy as np

from selflock.fmus import laws
from selflock.fmus.effect_file import LAWS
from selflock.fmus.reducer import wedge

from ..rules import RULES
from .balances import CURRENT, KT, R, heaviest, input_speed, motor_volts
from .finding import Finding, Said
from .motions import RATIO, look_at_ratio, number
from .pieces import Pieces

MU, MU_REST, PRELOAD, PULL = "reducer.friction_kinetic", "reducer.friction_static", "reducer.preload", "load.constant_torque"
VISCOUS, DRAG, DAMPING = "reducer.viscous_damping", "reducer.drag_torque", "load.damping"
LIMITS = ("controller.voltage_min", "controller.voltage_max")
SLIPS = (
    ("load.arm", "mm", "m", 1e3), ("load.arm", "cm", "m", 1e2), ("load.mass", "g", "kg", 1e3), (MU, "percent", "", 1e2),
    (PULL, "mN.m", "N.m", 1e3), (DAMPING, "mN.m.s/rad", "N.m.s/rad", 1e3), (VISCOUS, "mN.m.s/rad", "N.m.s/rad", 1e3), (DRAG, "mN.m", "N.m", 1e3),
)  # fmt: skip


def lifting(pieces: Pieces, said: Said, suspects: set[str]) -> list[Finding]:
    """A contradiction, or a remark, where the rig asks for more than there was. suspects: signals that are wrong already."""
    given, motion = _most(pieces, said, suspects), input_speed(pieces, said, suspects)
    if given is None or motion is None or RATIO in suspects or PULL in said.rig.uncertain:
        return []
    (name, had), (w_name, w) = given, motion
    slows = np.zeros(len(w), bool)
    if said.rig.kind != "steady":
        w, had = pieces.smooth(w), pieces.smooth(had)
        slows = pieces.slope(w) * w < 0.0  # where it loses speed its inertia lifts, too
    moves = np.isfinite(had) & ~slows & (abs(w) > RULES.data.surely * np.nanmax(abs(w)))
    hangs = _leans(pieces, said, suspects)
    if len(hangs) > 1 and name not in LIMITS and not _drives(had * np.sign(w), moves):
        return []  # a motor that is off while its load falls
    had, cases = abs(had), []
    for leans in hangs:
        asked = _asked(said, leans, w)
        lifts = moves & (asked > 0.0)
        if lifts.sum() >= RULES.data.fewest_pieces:
            cases.append((float(np.sum(asked[lifts])), max(float(np.sum(had[lifts])), 1e-300), leans, lifts))
    if not cases:
        return []
    total, most, leans, lifts = min(cases, key=lambda case: case[0] / case[1])  # however its arm hangs, where nobody tells
    gross = total > RULES.data.gross_beside * most
    if total < RULES.data.gross * most or not (gross or name not in LIMITS or said.given(name)):
        return []
    slips = [
        f"{said.prefix}{full} may be in {unit}: {least(said, full) / times:.4g} {right} would do".replace("  ", " ")
        for full, unit, right, times in SLIPS
        if least(said, full)
        and (full == MU or least(said, MU) <= 1.0)  # which no pair of materials has
        and (left := float(np.nansum(_asked(said, leans, w, full, times)[lifts]))) < RULES.data.gross * most
        and most < RULES.data.gross_beside * left
    ]
    if said.value(RATIO) < 1.0:
        slips = [f"look at {look_at_ratio(said)}", *slips]
    of = f"the torque of {said(name)}" if name in ("motor.torque", CURRENT) else f"what the motor can give with {said(name)}"
    assumed = f" = {said.value(name):g} V, which was assumed" if name in LIMITS and not said.given(name) else ""
    look = f"look at load.mass (kg), load.arm (m), load.constant_torque (N.m), reducer.friction_kinetic (1), the gear's ratio and the unit of {said(name)}"
    text = f"to move the load as {said(w_name)} does, the rig asks for {number(total / most)} times {of}{assumed}: {'; or '.join(slips) or look}"
    return [Finding(f"{text}.", gross, (name, "load.mass", "load.arm", MU))]


def frictions(said: Said) -> list[Finding]:
    """What no pair of materials has: a coefficient beyond 1, or one at rest that is another thing than the one in motion."""
    found = []
    for name in (MU, MU_REST):
        if (value := least(said, name)) > 1.0:
            text = f"{said.prefix}{name} = {value:g} is beyond 1, and gears have some hundredths: in percent? Write {value / 100.0:g}"
            found.append(Finding(f"{text}.", False, (name,)))
    rest, moving = least(said, MU_REST), max(said.ends(MU))
    if not found and moving and rest > RULES.data.gross_beside * moving:
        text = f"{said.prefix}{MU_REST} = {rest:g} is {number(rest / moving)} times {said.prefix}{MU} = {moving:g}"
        found.append(Finding(f"{text}: one of them may be in percent.", False, (MU_REST, MU)))
    return found


def leaning(said: Said) -> list[Finding]:
    """An arm that stands at more than a turn: degrees, most likely. A remark."""
    angle = said.value("load.arm_angle")
    if abs(angle) <= 2.0 * np.pi or not heaviest(said):
        return []
    text = f"{said.prefix}load.arm_angle = {angle:g} rad is more than a turn: degrees given as rad? Write {np.radians(angle):.6g}"
    return [Finding(f"{text}.", False, ("load.arm_angle",))]


def unloaded(seen: set[str], said: Said) -> list[Finding]:
    """A remark where the rig asks a gear at constant speeds for nothing, beside a torque or a current that was measured.

    Friction of a wedge goes with what it carries: without a load, a preload or what turns with difficulty by itself the balance is 0 at
    every speed, and no replay shows anything of it. seen: the signals that were logged.
    """
    measured = [name for name in ("motor.torque", "reducer.input_torque", CURRENT) if name in seen]
    if said.rig.kind != "steady" or not measured or "reducer.output_torque" in seen or _loads(said):
        return []
    mu = f" of reducer.friction_kinetic = {said.value(MU):g}"
    text = f"nothing that the rig says loads the gear, so that its torque is 0 at every speed whatever {said(measured[0])} was, and nothing{mu} can be seen"
    mend = "load.constant_torque (N.m), load.mass (kg) and load.arm (m), load.damping or reducer.preload (N.m), or a column for reducer.output_torque"
    return [Finding(f"{text}: give what it carries, {mend}.", False, (measured[0], PULL, "load.mass", PRELOAD))]


def _loads(said: Said) -> bool:
    """Whether a load or a gear asks for a torque at a constant speed, by a number that the rig gives; a load may be left open."""
    if heaviest(said) or any(any(said.ends(name)) for name in (PULL, PRELOAD, "load.damping", "load.mass")):
        return True
    own = {f"{part}.{p.name}" for part in ("reducer", "load") for p in laws.module(LAWS[part]).BASE}
    told = [name.removeprefix(said.prefix) for name, value in said.values.items() if value]
    return any(name.startswith(("reducer.", "load.")) and name not in own for name in told)  # an effect's


def least(said: Said, name: str) -> float:
    """What the rig says of a number at least, without its sign."""
    return min(abs(end) for end in said.ends(name))


def _asked(said: Said, leans: np.ndarray, w: np.ndarray, slipped: str = "", times: float = 1.0) -> np.ndarray:
    """Torque at the input shaft at least, N.m; nan where the load helps. leans: cosine of the arm's angle; one number `times` smaller."""
    given = lambda name: least(said, name) / (times if slipped == name else 1.0)
    ratio = said.value(RATIO)
    pull = np.sign(w) * (
        np.sign(said.value(PULL)) * given(PULL) + given("load.mass") * given("load.arm") * said.value("load.gravity") * leans
    )
    pull = np.where(pull >= 0.0, pull, np.nan) + given(DAMPING) * abs(w) / ratio
    t = wedge.wedge_tangent(ratio, said.value("reducer.wedge_angle"))
    slope = wedge.driving_slope(min(given(MU), 0.5 / t), t, ratio)  # which grows with mu, up to a gear that jams
    by_flanks = np.maximum(pull * slope, pull / ratio + wedge.preload_torque(given(MU), min(said.ends(PRELOAD)), t))
    return by_flanks + given(VISCOUS) * abs(w) + given(DRAG)


def _leans(pieces: Pieces, said: Said, suspects: set[str]) -> list[np.ndarray]:
    """The cosine of the arm's angle; where nobody tells where it hangs, from each twelfth of a turn on. [] where nothing does."""
    none = np.zeros(len(pieces.lasting))
    if not heaviest(said):
        return [none]
    if pieces.has("load.angle") and "load.angle" not in suspects:
        return [np.cos(pieces.mean("load.angle") + said.value("load.arm_angle"))]
    ratio = said.value(RATIO)
    for name, geared in (("load.speed", 1.0), ("reducer.input_angle", ratio), ("reducer.input_speed", ratio)):
        if pieces.has(name) and name not in suspects and said.rig.kind != "steady":
            turned = pieces.mean(name) if name.endswith("angle") else np.cumsum(np.nan_to_num(pieces.way(name)))
            return [np.cos(turned / geared + k * np.pi / 6.0) for k in range(12)]
    return []


def _drives(push: np.ndarray, moves: np.ndarray) -> bool:
    """Whether a motor gives more than it takes."""
    return float(np.sum(push[moves])) > RULES.data.told_share * float(np.sum(abs(push[moves])))


def _most(pieces: Pieces, said: Said, suspects: set[str]) -> tuple[str, np.ndarray] | None:
    """What tells it, and the most torque that the motor gave or could give, N.m; of limits without a sign."""
    if pieces.has("motor.torque") and "motor.torque" not in suspects:
        return "motor.torque", pieces.mean("motor.torque")
    if not said.given(KT) or suspects & {KT, R}:
        return None
    constant = max(said.ends(KT))
    if pieces.has(CURRENT) and CURRENT not in suspects:
        return CURRENT, constant * pieces.mean(CURRENT)
    if not said.given(R) or not (resistance := min(said.ends(R))):
        return None
    told = motor_volts(pieces, said)
    if told is not None:
        return None if told[0] in suspects else (told[0], constant * told[1] / resistance)
    asked = pieces.has("controller.angle_setpoint") or pieces.has("controller.speed_setpoint")
    if pieces.has("motor.duty") or not (asked or all(said.given(name) for name in LIMITS)):  # the limits of a duty are no voltage
        return None
    return LIMITS[1], np.full(len(pieces.lasting), constant * max(abs(said.value(name)) for name in LIMITS) / resistance)
