"""What a column's name says: a quantity, of which shaft, asked for or measured, in which unit. English, German, French and more.

A name is a claim, not a proof: `strength` says how much it is worth, and the numbers have the last word (place.py).
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass

from ..data.signals import canonical

TIME, RUN, INDEX, FLAG = "time", "run", "index", "flag"
ANGLE, SPEED, ACCELERATION, TORQUE, CURRENT, VOLTAGE = "angle", "speed", "acceleration", "torque", "current", "voltage"
DUTY, SUPPLY, TEMPERATURE, POWER, ERROR, OTHER = "duty", "supply", "temperature", "power", "error", "other"
MOTOR, LOAD = "motor", "load"
SETPOINT, ACTUAL = "setpoint", "actual"

_QUANTITIES = {
    TIME: "time zeit temps tiempo tempo tijd timestamp stamp clock zeitstempel uhrzeit datetime date datum elapsed epoch timestep",
    RUN: "run trial experiment versuch messung episode profile test lauf essai",
    INDEX: "index sample samples nr row frame idx seq sequence messpunkt line number",
    FLAG: "enable enabled valid status flag fault freigabe statusword controlword alarm warning richtung brake bremse",
    ANGLE: "angle winkel position pos theta phi angulo angolo lage posizione posicion hoek stellung encoder enc"
    " weg drehwinkel rotorlage displacement way travel hub rotation",
    SPEED: "speed velocity vel omega drehzahl geschwindigkeit vitesse velocidad velocita rpm snelheid winkelgeschwindigkeit"
    " drehgeschwindigkeit thetadot phidot qdot alphadot dtheta dphi dq vitesses tours upm",
    ACCELERATION: "acceleration accel acc beschleunigung qddot ddq qdd jerk",
    TORQUE: "torque moment drehmoment couple tau coppia effort trq tq force kraft fuerza forza moments torques",
    CURRENT: "current strom courant corriente corrente amps ampere amp stroom ia iq iarm imot curr cur isense",
    VOLTAGE: "voltage spannung tension voltaje tensione volt volts ua uq va umot vmot vmotor umotor",
    DUTY: "duty pwm dutycycle tastgrad tastverhaeltnis aussteuerung",
    SUPPLY: "supply bus vbus battery batt dcbus versorgung vbat udc zwischenkreis vdc mains ubat vsupply",
    TEMPERATURE: "temperature temp temperatur tmp thermal temperatura",
    POWER: "power leistung puissance energy energie energia watt watts",
    ERROR: "error err fehler deviation regelabweichung abweichung erreur schleppfehler following lag residual",
    OTHER: "noise vibration vib sound pressure druck humidity imu gyro strain gain kp ki kd ambient coolant",
}
_WEAK = {  # of one letter or two: half a claim
    "t": TIME, "n": SPEED, "w": SPEED, "om": SPEED, "q": ANGLE, "th": ANGLE, "x": ANGLE, "i": CURRENT, "u": VOLTAGE, "v": VOLTAGE,
    "m": TORQUE, "f": TORQUE, "tm": TORQUE, "trial": RUN, "id": RUN, "qd": SPEED, "dx": SPEED, "load": TORQUE, "last": TORQUE,
    "control": DUTY, "duration": TIME, "ts": TIME, "alpha": ANGLE, "psi": ANGLE, "no": INDEX, "step": INDEX, "count": INDEX, "in": VOLTAGE,
}  # fmt: skip
_SIDES = {
    MOTOR: "motor mot input rotor antrieb antriebs eingangs eingang moteur motore mtr worm schnecke hs an drive motors",
    LOAD: "load output out abtrieb last link joint wheel arm ausgang secondary ls gelenk lastseitig charge carga pendulum knee ab"
    " ausgangs abtriebs",
}
_ROLES = {
    SETPOINT: "setpoint setpoints set soll sollwert ref reference target goal cmd command commanded des desired demand consigne sp request req"
    " setpunkt consigna planned setting vorgabe fuehrung wanted",
    ACTUAL: "actual act ist istwert meas measured feedback fb fbk present real mesure mesuree estimate est estimated filtered raw encoder gemessen value",
}
_WHOLE = {  # names of two or three letters that mean one thing together: quantity, side, role
    "qm": (ANGLE, "", ACTUAL), "qg": (ANGLE, "", SETPOINT), "ql": (ANGLE, LOAD, ""), "qr": (ANGLE, "", SETPOINT), "qref": (ANGLE, "", SETPOINT),
    "wm": (SPEED, MOTOR, ""), "wl": (SPEED, LOAD, ""), "thm": (ANGLE, MOTOR, ""), "thl": (ANGLE, LOAD, ""), "im": (CURRENT, MOTOR, ""),
    "um": (VOLTAGE, MOTOR, ""), "vm": (VOLTAGE, MOTOR, ""), "nmot": (SPEED, MOTOR, ""), "mmot": (TORQUE, MOTOR, ""), "taum": (TORQUE, MOTOR, ""),
    "phim": (ANGLE, MOTOR, ""), "phil": (ANGLE, LOAD, ""), "uarm": (VOLTAGE, MOTOR, ""), "vin": (VOLTAGE, "", ""), "xvalue": (TIME, "", ""),
}  # fmt: skip

UNITS = {  # as people write them: as the rig writes them, and of what they are
    **dict.fromkeys(("rpm", "1/min", "u/min", "min-1", "min^-1", "tr/min", "r/min", "rev/min", "upm", "umdr/min", "umdr./min", "1/minute", "rev/minute"), ("rpm", SPEED)),
    **dict.fromkeys(("rad/s", "rads", "rad/sec", "rad s-1", "rad*s-1", "rad.s-1", "rad s^-1", "radians/s", "rad_s", "rad/second"), ("rad/s", SPEED)),
    **dict.fromkeys(("deg/s", "°/s", "dps", "degs", "deg/sec", "grad/s", "degrees/s", "deg/second"), ("deg/s", SPEED)),
    **dict.fromkeys(("rev/s", "rps", "turn/s", "turns/s", "u/s"), ("turn/s", SPEED)),
    **dict.fromkeys(("m/s",), ("m/s", SPEED)), **dict.fromkeys(("mm/s",), ("mm/s", SPEED)),
    **dict.fromkeys(("rad", "radian", "radians"), ("rad", ANGLE)), **dict.fromkeys(("mrad",), ("mrad", ANGLE)),
    **dict.fromkeys(("deg", "°", "degree", "degrees"), ("deg", ANGLE)), **dict.fromkeys(("turn", "turns", "rev", "revs", "revolution"), ("turn", ANGLE)),
    **dict.fromkeys(("mm",), ("mm", ANGLE)), **dict.fromkeys(("µm", "um", "micron"), ("um", ANGLE)),
    **dict.fromkeys(("inc", "incs", "count", "counts", "cnt", "cts", "ticks", "tick", "qc", "pulse", "pulses", "steps", "inkremente"), ("counts", ANGLE)),
    **dict.fromkeys(("nm", "n.m", "n·m", "n*m", "n-m", "newtonmeter"), ("N.m", TORQUE)),
    **dict.fromkeys(("mnm", "mn.m", "mn·m", "mn*m", "mn-m"), ("mN.m", TORQUE)), **dict.fromkeys(("ncm", "n.cm"), ("N.cm", TORQUE)),
    **dict.fromkeys(("n", "newton"), ("N", TORQUE)), **dict.fromkeys(("kn",), ("kN", TORQUE)),
    **dict.fromkeys(("a", "amp", "amps", "ampere", "arms", "apk"), ("A", CURRENT)), **dict.fromkeys(("ma", "milliamp", "milliamps"), ("mA", CURRENT)),
    **dict.fromkeys(("v", "volt", "volts", "vdc"), ("V", VOLTAGE)), **dict.fromkeys(("mv",), ("mV", VOLTAGE)),
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds", "sek", "sekunden", "secondes", "segundos"), ("s", TIME)),
    **dict.fromkeys(("ms", "msec", "millis", "millisecond", "milliseconds", "millisekunden"), ("ms", TIME)),
    **dict.fromkeys(("µs", "us", "usec", "micros", "microseconds"), ("us", TIME)), **dict.fromkeys(("ns", "nsec", "nanoseconds", "nanosec", "nanos"), ("ns", TIME)),
    **dict.fromkeys(("min", "minutes"), ("min", TIME)),
    **dict.fromkeys(("°c", "degc", "c", "celsius", "grad c"), ("degC", TEMPERATURE)), **dict.fromkeys(("k",), ("K", TEMPERATURE)),
    **dict.fromkeys(("w", "kw", "watt"), ("W", POWER)),
    **dict.fromkeys(("%", "percent", "pct", "prozent"), ("%", "")), **dict.fromkeys(("‰", "permille", "per mille", "promille", "per thousand"), ("‰", "")),
    **dict.fromkeys(("rad/s2", "rad/s^2", "rad/s²", "m/s2", "m/s²", "m/s^2", "deg/s2", "deg/s²"), ("", ACCELERATION)),
}  # fmt: skip

_VARIABLES = {  # of a run's results, by the rig's names
    "reducer.input_angle": (ANGLE, MOTOR, ACTUAL), "reducer.input_speed": (SPEED, MOTOR, ACTUAL), "load.angle": (ANGLE, LOAD, ACTUAL),
    "load.speed": (SPEED, LOAD, ACTUAL), "motor.current": (CURRENT, MOTOR, ""), "motor.torque": (TORQUE, MOTOR, ""),
    "reducer.output_torque": (TORQUE, LOAD, ""), "reducer.input_torque": (TORQUE, MOTOR, ""), "motor.voltage": (VOLTAGE, MOTOR, ""), "controller.voltage": (VOLTAGE, MOTOR, ""),
    "controller.angle_setpoint": (ANGLE, "", SETPOINT), "controller.speed_setpoint": (SPEED, "", SETPOINT),
    "motor.duty": (DUTY, MOTOR, ""), "motor.supply_voltage": (SUPPLY, MOTOR, ""), "motor.temperature": (TEMPERATURE, MOTOR, ""),
    "reducer.friction_torque": (OTHER, "", ""), "reducer.normal_force": (OTHER, "", ""), "load.load_torque": (OTHER, "", ""),
}  # fmt: skip

_FILLERS = set(
    "side shaft welle seite value values data signal sensor state states field msg of the control controller ch channel dc mode observation".split()
)
_END = re.compile(
    r"(?P<name>.*[^A-Za-z].*?|.*[a-z])[_ .-]*(?<![a-zA-Z])(?P<unit>mA|mV|mNm|mN_?m|N_?m|Nm|Ncm|kN|RPM|rpm|deg_?/?s|dps|rad_?/?s|rads|Deg|deg|rad|mm|ms|us|ns|µs|pct|percent|1/min|U/min)"
)

_TOKENS: dict[str, list[tuple[str, str]]] = {}
for _kind, _table in (("quantity", _QUANTITIES), ("side", _SIDES), ("role", _ROLES)):
    for _value, _words in _table.items():
        for _word in _words.split():
            _TOKENS.setdefault(_word, []).append((_kind, _value))

_GREEK = str.maketrans(
    {
        "ω": " omega ",
        "Ω": " omega ",
        "θ": " theta ",
        "ϑ": " theta ",
        "φ": " phi ",
        "ϕ": " phi ",
        "τ": " tau ",
        "α": " alpha ",
        "ψ": " psi ",
    }
)


@dataclass(frozen=True)
class Word:
    """What a name says. strength: 3 a run of ours wrote it, 2 a word or a unit says what it is, 1 a letter does, 0 nothing does."""

    header: str
    quantity: str = ""
    side: str = ""
    role: str = ""
    unit: str = ""  # as a rig writes it; "counts" and "%" are no units of a rig
    said: bool = False  # the unit stands in brackets, or in a row of units
    strength: int = 0
    rest: tuple[str, ...] = ()  # what of it is no known word: which of several drives it is of, perhaps


def _of_a_run(name: str) -> tuple[tuple[str, str, str], tuple[str, ...]] | None:
    """Quantity, side and role of a variable as `selflock run` calls it, arm_reducer.input_speed; and of which drive it is."""
    found = re.fullmatch(r"(?:(\w*?)_)?(motor|reducer|load|controller)\.(\w+)", name)
    said = _VARIABLES.get(canonical(f"{found[2]}.{found[3]}")) if found else None
    return (said, (found[1],) if found[1] else ()) if found and said else None


def tokens(name: str) -> list[str]:
    """The words of a name: at spaces, signs, capitals and numbers."""
    text = name.translate(_GREEK)
    text = text.replace("ä", "ae").replace("ö", "oe").replace("ü", "ue").replace("ß", "ss").replace("Ä", "Ae").replace("Ü", "Ue")
    text = "".join(c for c in unicodedata.normalize("NFKD", text) if not unicodedata.combining(c))
    text = re.sub(r"([a-z])([A-Z])", r"\1 \2", text)
    text = re.sub(r"([A-Z]+)([A-Z][a-z])", r"\1 \2", text)
    text = re.sub(r"(?<=[A-Za-z])(?=\d)|(?<=\d)(?=[A-Za-z])", " ", text)
    return [part for token in re.split(r"[^A-Za-z0-9]+", text) if token for part in _parted(token.lower())]


def _parted(word: str) -> list[str]:
    """A word made of known ones, as Motorstrom or Sollwinkel is; else itself."""
    if len(word) < 6 or word in _TOKENS:
        return [word]
    for k in range(len(word) - 3, 2, -1):
        first, second = word[:k], word[k:]
        if first in _TOKENS and (second in _TOKENS or (len(rest := _parted(second)) > 1)):
            return [first, *([second] if second in _TOKENS else rest)]
    return [word]


def read(header: str) -> Word:
    """The claim of a column's name."""
    name, unit, said, quantity_of_unit = str(header).strip(), "", False, ""
    if found := re.fullmatch(r"(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\)|\{([^}]*)\}|\s[/in]+\s([^\s/]{1,5}))\s*", name):
        inside = next(text for text in found.groups()[1:] if text is not None).strip().lower()
        known = UNITS.get(inside) or UNITS.get(inside.strip(". "))
        if known and not inside.isdigit():
            (unit, quantity_of_unit), said, name = known, True, found[1]
    if not unit and (found := re.fullmatch(r"(.+?)(?:\s*/\s*|\s+in\s+|,\s*)(\S+)", name)):  # U / V, n in 1/min, as DIN has it
        known = UNITS.get(found[2].lower().replace("⁻¹", "-1"))
        if known and not re.search(r"(?<![a-z])(rad|deg|m|mm|rev|turns?|u|tr|°)$", found[1].lower()):
            (unit, quantity_of_unit), said, name = known, True, found[1]
    if not unit and (found := re.search(r"(pos|vel)_(estimate|setpoint)$|(input)_(pos|vel)$", name)):  # ODrive's, in turns
        speed = "vel" in found[0]
        return Word(
            header,
            SPEED if speed else ANGLE,
            "",
            ACTUAL if "estimate" in name else SETPOINT,
            "turn/s" if speed else "turn",
            False,
            2,
        )
    if not unit and (found := _END.fullmatch(name)):
        unit, quantity_of_unit = UNITS[
            found["unit"].lower().replace("_", "/") if "s" in found["unit"] else found["unit"].lower().replace("_", "")
        ]
        name = found["name"]
    if run := _of_a_run(name):
        return Word(header, *run[0], unit=unit, said=said, strength=3, rest=run[1])
    words = tokens(name)
    if not unit and (counted := _counted(words)):
        return Word(header, TIME, unit=counted, strength=2)
    if not unit:
        unit, quantity_of_unit, words = _unit_at_end(words)
    whole = _WHOLE.get("".join(words)) if len(words) <= 2 else None
    if whole and not (unit and quantity_of_unit not in ("", whole[0])):
        return Word(header, *whole, unit=unit, said=said, strength=2 if unit else 1)
    quantity, strength, side, role, rest = "", 0, "", "", []
    strong = [value for word in words for kind, value in _TOKENS.get(word, ()) if kind == "quantity"]
    for word in words:
        kinds = dict(_TOKENS.get(word, ()))
        if "side" in kinds and not (
            kinds["side"] == LOAD and word in ("load", "last") and len(words) > 1 and not strong and not unit
        ):
            side = side or kinds["side"]
        if "role" in kinds:
            role = role or kinds["role"]
        if not kinds and word not in _FILLERS and (word not in _WEAK or strong):
            rest.append(word)
    others = [q for q in strong if q not in (CURRENT,)]
    if CURRENT in strong and {ANGLE, SPEED, TORQUE} & set(others) and not (unit and quantity_of_unit == CURRENT):
        strong, role = others, role or ACTUAL  # the current position is where it is now
    if strong:
        quantity, strength = _leading(strong), 2
    if not quantity:
        weak = [word for k, word in enumerate(words) if word in _WEAK and not (word in ("m", "in") and k > 0)]
        if weak:
            quantity, strength = _WEAK[weak[0]], 1
    if any(word in ("dot", "punkt", "deriv") for word in words) and quantity == ANGLE:
        quantity = SPEED
    if "d" in words[:1] and quantity == ANGLE and len(words) > 1:
        quantity = SPEED
    single = [w for w in words if len(w) == 1]
    if not side and len(words) > 1 and quantity:
        side = MOTOR if single[-1:] == ["m"] and words[-1] == "m" else LOAD if words[-1:] == ["l"] else ""
        if side and rest[-1:] == words[-1:]:
            rest.pop()
    if quantity_of_unit and said and quantity_of_unit != quantity and not (quantity == SUPPLY and quantity_of_unit == VOLTAGE):
        if quantity not in (FLAG, ERROR, OTHER, RUN, INDEX):
            quantity, strength = quantity_of_unit, 2
    elif quantity_of_unit and quantity_of_unit == quantity:
        strength = 2
    elif quantity_of_unit and not quantity:
        quantity, strength = quantity_of_unit, 2 if said else 1
    if unit and quantity_of_unit not in ("", quantity) and not (quantity == SUPPLY and quantity_of_unit == VOLTAGE):
        unit, said = "", False
    if quantity == ANGLE and unit == "" and "".join(words) in ("x", "y"):
        strength = 0  # any axis of any diagram
        quantity = ""
    return Word(header, quantity, side, role, unit, said, strength, tuple(rest))


def _counted(words: list[str]) -> str:
    """The unit of a time that is called by it and by no quantity: millis, ms_today, Sekunden."""
    unit, quantity = UNITS.get(words[0], ("", "")) if words and len(words[0]) > 1 else ("", "")
    others = any(kind == "quantity" for word in words[1:] for kind, _ in _TOKENS.get(word, ()))
    return unit if quantity == TIME and words[0] != "min" and not others else ""


def _leading(found: list[str]) -> str:
    """What a name with several quantities is of: the error of an angle is an error, the supply's voltage the supply."""
    for first in (FLAG, TIME, ERROR, OTHER, TEMPERATURE, POWER, ACCELERATION, DUTY, SUPPLY):
        if first in found and not (first == TIME and len(set(found)) > 1):
            return first
    for last in (SPEED, TORQUE, CURRENT, VOLTAGE, ANGLE):  # the position encoder's speed is a speed
        if last in found:
            return last
    return found[0]


def _unit_at_end(words: list[str]) -> tuple[str, str, list[str]]:
    """A unit as the last words of a name: speed_rpm, angle_deg, omega_rad_s, i_mA."""
    for count in (3, 2, 1):
        if len(words) <= count:
            continue
        end = words[-count:]
        text = {3: "/".join((end[0], end[-1])) if count == 3 and end[1] == "per" else "", 2: "/".join(end), 1: end[-1]}[count]
        known = UNITS.get(text)
        if known and (len(text) > 1 or text in ("s", "v", "a", "n")):
            quantity = known[1]
            before = {value for word in words[:-count] for kind, value in _TOKENS.get(word, ()) if kind == "quantity"}
            before |= {_WEAK[word] for word in words[:-count] if word in _WEAK}
            if before and quantity and quantity not in before and not (quantity == VOLTAGE and SUPPLY in before):
                continue  # u_a is no voltage in amperes
            if not before and len(text) == 1:
                continue
            return known[0], quantity, words[:-count]
    return "", "", words
