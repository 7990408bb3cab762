"""A rig from a raw log: when columns are taken for one motion, one of another, or for what drives it."""

from __future__ import annotations

from dataclasses import dataclass

from .rule import rule

TIME = "a limit of time; not studied"
DRAWN = "developed on drives of closed forms drawn at random (ratios of 3.7 to 160, names and units of many habits), and the four measured ones; not judged by them"


@dataclass(frozen=True)
class BeginRules:
    rows: int = rule(1 << 19, "rows of all logs together that are looked at", TIME)
    columns: int = rule(400, "columns that are looked at", TIME)
    looked_at: int = rule(1 << 17, "rows by which a column's steps and its lead are told", TIME)
    pieces: int = rule(400, "pieces of all runs, over which columns are held against each other", TIME)
    shortest: int = rule(5, "rows of a piece, at least", "theory: fewer are no mean")
    fewest: int = rule(
        12, "pieces without which nothing is said of two columns", "theory: a chance of 2 in 2^12 that signs agree by accident"
    )
    slowest_rows: float = rule(
        10.0,
        "s up to which rows of a drive may be apart, so that a time whose unit nobody says may be in the next larger one: a note says so",
        "a remark alone, which decides nothing",
    )
    shortest_motion: float = rule(
        0.5,
        "s below which a log lasts too short by a unit that its steps alone tell, if they are no whole numbers: then they are s",
        "theory: who counts ms has whole ones, and a computer's clock in s has digits; a note tells both",
    )
    motion: float = rule(
        0.25,
        "share of a column's power over some rows that goes on over four times as many, from which on it is a motion",
        "theory: of noise it is 0",
    )
    moves_on: float = rule(
        0.95,
        "share of its way up and down that most motions keep over a piece; else parts of a long run are looked at in shorter pieces",
        "theory: of whole motions in a piece nothing is left",
    )
    closer: int = rule(8, "such parts of a run, those with most motion", TIME)
    astray: float = rule(
        10.0, "median distances from what most pieces say beyond which a piece is left out", "theory: of normal noise one in 1e10"
    )
    few_astray: float = rule(0.2, "share of the pieces that may be left out so", "theory: a fifth; more is no slip of an encoder")
    kinematic: float = rule(
        0.995, "correlation from which on one column is the integral of another, whatever they are called", DRAWN
    )
    only_numbers: float = rule(0.999, "the same where neither has a name: a voltage or a current is less close to a speed", DRAWN)
    borne_out: float = rule(0.9, "the same where their names say so", DRAWN)
    same: float = rule(
        0.98, "correlation from which on two channels are one motion, by whose factor a unit or a ratio is told", DRAWN
    )
    one_shaft: tuple[float, float] = rule(
        (0.85, 1.18),
        "factors between which two channels in SI are of one shaft",
        "theory: no gear is made for them; sensors are off by less",
    )
    other_shaft: float = rule(0.7, "factor below which they are of two", "theory: few gears are below 1.4")
    motor_speed: float = rule(
        30.0,
        "rad/s above which an only shaft is taken for the motor's, which is said to be unsure",
        "theory: 290 rpm; few loads behind a gear turn faster",
    )
    fits: float = rule(
        0.4,
        "share of a voltage or a torque that its law may leave, to be told by it",
        "theory: it explains more than 80 % of the power",
    )
