"""The effect file of docs/own_effects.md, and others that are wrong in one thing each."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
TOOTH = re.findall(r"```python\n# my_laws/tooth.py\n(.*?)```", (ROOT / "docs/own_effects.md").read_text(), re.S)[0]
ELSEWHERE = TOOTH.replace('"tooth_place", "rad", 0.0', '"tooth_place", "rad", 3.0')
"""Where it is off, no drive of ours comes by: it has no slope there."""

LAST = "    return p.tooth_depth * math.exp"

NOT_TO_BE_LOADED = {  # what is put in the place of what, and words of the one sentence
    "syntax": ("return 2.0 if", "return 2.0 iff", "line 9: .* no Python"),
    "import": ("import math", "import numpy", "line 3: imports numpy; .* standard library"),
    "relative": ("import math", "from . import other", "line 3: imports \\.;"),
    "component": ('component="reducer"', 'component="gearbox"', "'gearbox'. Write .*controller, motor, reducer, load, sensor"),
    "no effect": ("EFFECT =", "LAW =", "no EFFECT = Effect"),
    "left out": ('    source="seen with the housing open",\n', "", "line 17: .*'source'"),
    "empty": ('"seen with the housing open"', '""', "no source"),
    "hook": ('"torque": torque', '"torq": torque', "no hook of the reducer is 'torq': there are active, .*torque"),
    "never on": ('"active": active, ', "", "no hook active"),
    "always off": ("return 2.0 if p.tooth_depth != 0.0 else 0.0", "return 0.0", "active.* is 0 while tooth_depth is not"),
    "never off": (
        LAST,
        "    return 1.0 + p.tooth_depth * math.exp",
        "torque\\(p, x\\).* gives 1 while the effect is off; give 0",
    ),
    "no number": (LAST, "    return 'much' or p.tooth_depth * math.exp", "torque gives 'much'"),
    "parameter": ('"tooth_depth", "N.m"', '"tooth depth", "N.m"', "called 'tooth depth'"),
    "unit": ('"tooth_depth", "N.m"', '"tooth_depth", "Nm"', "tooth_depth: unit 'Nm'"),
    "role": ('motion", AMPLITUDE', 'motion", "size"', "no role .*'size'"),
    "trial": ("trials=(0.1, 0.3)", "trials=(0.1, 3.0)", "tooth_width: trial at 3.0"),
    "its name": ('name="tooth"', 'name="ripple"', "called 'ripple'. Rename it"),
    "a name of the law": ('"tooth_depth"', '"friction_kinetic"', "'friction_kinetic' belongs to the published law"),
    "a name of another": ('"tooth_depth"', '"viscous_damping"', "'viscous_damping' belongs to the effect viscous"),
    "a wrong word": ("x.output_angle", "x.outer_angle", "line 13, in torque: .*'outer_angle'. There are direction, speed, "),
    "no such number": ("p.tooth_place)", "p.place)", "line 13, in torque: .*'place'"),
}

NOT_TO_BE_COMPILED = {
    "a class": (LAST, "    t = Own()\n" + LAST, "torque\\(p, x\\), its hook torque, .*numba.*line \\d+: .*'Own'"),
    "now and then nothing": (LAST, "    if away > 1e3:\n        return None\n" + LAST, "it gives Optional.*Give one number"),
    "a context": (LAST, "    with open('/dev/null'):\n        pass\n" + LAST, "line 14: Unsupported"),
}


def wrong(change: tuple[str, str, str]) -> str:
    """The file with one thing wrong in it."""
    old, new, _ = change
    assert old in TOOTH
    return TOOTH.replace(old, new, 1).replace(
        "def active", "class Own:\n    pass\n\n\ndef active" if "Own" in new else "def active"
    )
