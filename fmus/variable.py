"""One record for a variable: what the faces of FMUs, the parts that the master couples and the vehicle tell of a number.

    Variable("resistance", "Ohm", 0.5, "of the winding", minimum=0.0, causality="parameter")

The fields are those of an FMI 2.0 ScalarVariable. What can be seen from others need not be said: the type from the
start value, the variability from type and causality.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any

CAUSALITIES = ("parameter", "input", "output", "local", "calculatedParameter", "independent")
TYPES = ((bool, "Boolean"), (int, "Integer"), (float, "Real"), (str, "String"))  # a bool is an int to Python: it comes first
INTEGERS = -(2**31), 2**31 - 1  # FMI 2.0's fmi2Integer is a C int
BEYOND = f"is beyond an Integer's 32 bits, {INTEGERS[0]} to {INTEGERS[1]}"
WHOLE = {f"Int{bits}": (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) for bits in (8, 16, 32, 64)}
WHOLE |= {f"UInt{bits}": (0, 2**bits - 1) for bits in (8, 16, 32, 64)}
"""FMI 3.0's types of whole numbers: the least and the greatest."""
WANTED = {"Real": "a number", "Integer": "a whole number", "Boolean": "true or false"}


@dataclass(frozen=True)
class Variable:
    """A variable of a part, and the values that it takes."""

    name: str
    unit: str = ""  # FMI name of the unit, such as "N.m"; "" means not declared or dimensionless
    start: Any = None  # an effect's parameter: what switches the effect off
    description: str = ""
    minimum: float | None = None  # inclusive
    maximum: float | None = None
    nominal: float | None = None
    depends_on: tuple[str, ...] | None = None  # outputs: inputs that act on it without a step; None: not told
    causality: str = "local"  # parameter | input | output | local; in the tables of a face known from the table
    type: str = ""  # Real | Integer | Boolean | String; "": that of the start value, Real where there is none
    variability: str = ""  # "": parameters are fixed, other numbers continuous, all else discrete; "tunable" is to be said
    initial: str = ""  # outputs, local: "exact" or "approx" where a start value may be given; else computed, or not told
    derivative_of: str = ""  # outputs: the output whose time derivative this is, so that a master can carry that one on
    sized: str = ""  # FMI 3.0's type where `type` does not say it: Int64, UInt8, Float32, Binary (a String of hex digits), Clock

    def __post_init__(self) -> None:
        if self.unit in CAUSALITIES:
            raise ValueError(
                f"Variable({self.name!r}, {self.unit!r}, …): {self.unit!r} is no unit. The order is name, unit, start, description; "
                f'write causality="{self.unit}" by its name.'
            )
        if not self.type:
            type_ = next((name for kind, name in TYPES if isinstance(self.start, kind)), "Real")
            object.__setattr__(self, "type", type_)
        if not self.variability:
            changing = "continuous" if self.type == "Real" else "discrete"
            object.__setattr__(self, "variability", "fixed" if self.causality == "parameter" else changing)

    @property
    def low(self) -> float:
        """The least value; -inf where none is told."""
        return -inf if self.minimum is None else self.minimum

    @property
    def high(self) -> float:
        """The greatest value; inf where none is told."""
        return inf if self.maximum is None else self.maximum

    @property
    def integers(self) -> tuple[int, int]:
        """The least and the greatest whole number that its type holds."""
        return WHOLE.get(self.sized, INTEGERS)

    @property
    def beyond(self) -> str:
        """What is wrong with a whole number that its type does not hold."""
        return f"is beyond an {self.sized}, {self.integers[0]} to {self.integers[1]}" if self.sized in WHOLE else BEYOND

    def unfit(self, value: float) -> str:
        """What is wrong with a number, such as "is not a finite number"; "" when it is fit."""
        if value - value != 0.0:
            return "is not a finite number"
        if self.low <= value <= self.high:
            return ""
        unit = f" {self.unit}" if self.unit else ""
        bounds = (("least", self.minimum), ("most", self.maximum))
        limits = " and ".join(f"at {end} {bound:.9g}{unit}" for end, bound in bounds if bound is not None)
        return f"is outside its range: it must be {limits}"

    def taken(self, value: Any) -> Any:
        """`value`, which may be text, as the type wants it. Raises ValueError with what is wrong with it, as `unfit` does."""
        if self.type == "String":
            return str(value)
        try:
            if self.type == "Boolean":
                return {"true": True, "1": True, "false": False, "0": False}[str(value).strip().lower().removesuffix(".0")]
            if isinstance(value, bool):
                raise ValueError
            number = float(value)
            if self.type == "Integer" and number - number == 0.0:
                if number != int(number):
                    raise ValueError
                number = int(value) if isinstance(value, int) or str(value).strip().lstrip("+-").isdecimal() else int(number)
                if not self.integers[0] <= number <= self.integers[1]:
                    raise OverflowError
        except OverflowError:
            raise ValueError(self.beyond if self.type == "Integer" else "is not a finite number") from None
        except (KeyError, ValueError, TypeError):
            raise ValueError(f"is not {WANTED[self.type]}") from None
        wrong = self.unfit(number)
        if wrong:
            raise ValueError(wrong)
        return number
