"""A motor's torque against what its current, or its voltage, lets it give.

M = k_m i,   |M| <= k_m (|u| + |k_e w|) / R        (17), and (16) where no current was measured
"""

from __future__ import annotations

import numpy as np

from ..rules import RULES
from .balances import CURRENT, KE, KT, SPEED, R, rms
from .finding import Finding, Said
from .motions import near, number
from .pieces import Pieces

TORQUE = "motor.torque"


def torque(pieces: Pieces, said: Said, suspects: set[str]) -> list[Finding]:
    """A contradiction where the torque is not the motor's, nor what friction in it leaves of that."""
    told = _electric(pieces, said, suspects)
    if said.linear or TORQUE in suspects or not pieces.has(TORQUE) or told is None:
        return []
    (name, most), had = told, pieces.mean(TORQUE)
    sound = np.isfinite(had) & np.isfinite(most)
    if sound.sum() < RULES.data.fewest_pieces or not rms(had[sound]) or not rms(most[sound]):
        return []
    times = rms(had[sound]) / rms(most[sound])
    known = said.given(KT) and (name == CURRENT or said.given(R))
    if times < (RULES.data.gross if known else RULES.data.gross_beside):
        return []
    of = f"{said(name)} makes of it" if name == CURRENT else f"the motor can give with {said(name)}"
    text = f"{said(TORQUE)} is {number(times)} times what {of} ({said.prefix}{KT} = {said.value(KT):g} N.m/A)"
    slips = [f'mN.m read as N.m? Write unit = "mN.m" for {said(TORQUE)}'] * near(times, 1e3, 5.0)
    slips += [
        f'a current in {unit}? Then it is "{said.prefix}{CURRENT}", unit = "{unit}", and no torque'
        for unit, factor in (("A", 1.0), ("mA", 1e3))
        if name != CURRENT and near(times, factor / said.value(KT), 5.0)
    ]
    return [Finding(f"{text}: {'; or '.join(slips) or f'look at the unit of {said(TORQUE)}'}.", True, (TORQUE,))]


def _electric(pieces: Pieces, said: Said, suspects: set[str]) -> tuple[str, np.ndarray] | None:
    """What tells it, and the torque of a current, or the most that a voltage and a speed may make."""
    constant = max(said.ends(KT))
    if pieces.has(CURRENT) and CURRENT not in suspects:
        return CURRENT, constant * pieces.mean(CURRENT)
    for name in ("motor.voltage", "controller.voltage"):
        if pieces.has(name) and name not in suspects and (least := min(said.ends(R))) > 0.0:
            turning = abs(pieces.mean(SPEED)) if pieces.has(SPEED) and SPEED not in suspects else 0.0
            return name, constant * (abs(pieces.mean(name)) + max(said.ends(KE)) * turning) / least
    return None
