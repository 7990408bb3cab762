"""What a load and a gear's friction ask for while the load is moved against its pull, against what the motor could give.

    F = max(P (t + mu) / (r t (1 - mu t)),  P / r + mu N0 sqrt(1 + t^2)),  P = M_c + m g d cos(phi)
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
from .motions import RATIO, number
from .pieces import Pieces

MU, PRELOAD, PULL = "reducer.friction_kinetic", "reducer.preload", "load.constant_torque"
LIMITS = ("controller.voltage_min", "controller.voltage_max")
SLIPS = (("load.arm", "mm", "m", 1e3), ("load.arm", "cm", "m", 1e2), ("load.mass", "g", "kg", 1e3), (MU, "percent", "", 1e2))


def lifting(pieces: Pieces, said: Said, suspects: set[str]) -> list[Finding]:
    """A contradiction, or a remark, where the rig asks for more than there was. suspects: signals that are wrong already."""
    given, motion = _most(pieces, said, suspects), input_speed(pieces, said, suspects)
    if given is None or motion is None or RATIO in suspects or PULL in said.rig.uncertain:
        return []
    (name, had), (w_name, w) = given, motion
    pull = _pull(pieces, said, suspects)
    if pull is None:
        return []
    if said.rig.kind != "steady":
        # where it loses speed its inertia lifts, too
        w, had, pull = pieces.smooth(w), pieces.smooth(had), np.where(pieces.slope(w) * w >= 0.0, pull, np.nan)
    asked = _asked(said, np.where(pull * w >= 0.0, abs(pull), np.nan))
    lifts = np.isfinite(asked) & np.isfinite(had) & (asked > 0.0) & (abs(w) > RULES.data.surely * np.nanmax(abs(w)))
    if lifts.sum() < RULES.data.fewest_pieces:
        return []
    total, most = float(np.sum(asked[lifts])), max(float(np.sum(had[lifts])), 1e-300)
    if total < RULES.data.gross * most:
        return []
    slips = [
        f"{said.prefix}{full} may be in {unit}: {said.value(full) / times:.4g} {right} would do".replace("  ", " ")
        for full, unit, right, times in SLIPS
        if said.given(full)
        and (left := float(np.sum(_asked(said, abs(pull[lifts]), full, times)))) < RULES.data.gross * most
        and most < RULES.data.gross_beside * left
    ]
    of = f"the torque of {said(name)}" if name in ("motor.torque", CURRENT) else f"what the motor can give with {said(name)}"
    look = f"look at load.mass (kg), load.arm (m), load.constant_torque (N.m), reducer.friction_kinetic (1), the gear's ratio and the unit of {said(name)}"
    text = f"to lift the load as {said(w_name)} does, the rig asks for {number(total / most)} times {of}: {'; or '.join(slips) or look}"
    return [Finding(f"{text}.", total > RULES.data.gross_beside * most, (name, "load.mass", "load.arm", MU))]


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


def _asked(said: Said, pull: np.ndarray, slipped: str = "", times: float = 1.0) -> np.ndarray:
    """Torque at the input shaft under a pull against the motion, N.m, at least; or with one parameter `times` smaller."""
    ratio = said.value(RATIO)
    t = wedge.wedge_tangent(ratio, said.value("reducer.wedge_angle"))
    mu = min(said.ends(MU)) / (times if slipped == MU else 1.0)
    if slipped.startswith("load."):
        pull = pull / times
    slope = wedge.driving_slope(min(mu, 0.5 / t), t, ratio)  # which grows with mu, up to a gear that jams
    return np.maximum(pull * slope, pull / ratio + wedge.preload_torque(mu, min(said.ends(PRELOAD)), t))


def _pull(pieces: Pieces, said: Said, suspects: set[str]) -> np.ndarray | None:
    """N.m by which the load pulls against positive motion; None where its weight pulls at an angle that nobody tells."""
    pull = np.full(len(pieces.lasting), said.value(PULL))
    if not heaviest(said):
        return pull
    if not pieces.has("load.angle") or "load.angle" in suspects:
        return None
    return pull + heaviest(said) * np.cos(pieces.mean("load.angle") + said.value("load.arm_angle"))


def _most(pieces: Pieces, said: Said, suspects: set[str]) -> tuple[str, np.ndarray] | None:
    """What tells it, and the most torque that the motor gave or could give, N.m, without a sign."""
    if pieces.has("motor.torque") and "motor.torque" not in suspects:
        return "motor.torque", abs(pieces.mean("motor.torque"))
    if not said.given(KT) or suspects & {KT, R}:
        return None
    constant = max(said.ends(KT))
    if pieces.has(CURRENT) and CURRENT not in suspects:
        return CURRENT, constant * abs(pieces.mean(CURRENT))
    if not said.given(R) or not (least := min(said.ends(R))):
        return None
    told = motor_volts(pieces, said)
    if told is not None:
        return None if told[0] in suspects else (told[0], constant * abs(told[1]) / least)
    if pieces.has("motor.duty") or not all(said.given(name) for name in LIMITS):  # the limits of a duty are no voltage
        return None
    return LIMITS[1], np.full(len(pieces.lasting), constant * max(abs(said.value(name)) for name in LIMITS) / least)
