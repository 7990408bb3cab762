"""The vehicle's bodies and joints in pymunk, and the arrays that the compiled forces work on."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pymunk
import pymunk.batch
from pymunk._chipmunk_cffi import lib

from ..master import addresses
from ..master.errors import DescriptionError
from . import ground, kernel, munk
from .tables import OUTPUTS, SIDES

_ALL = pymunk.batch.BodyFields
_FIELDS = _ALL.POSITION | _ALL.ANGLE | _ALL.VELOCITY | _ALL.ANGULAR_VELOCITY | _ALL.FORCE | _ALL.TORQUE
_BATCH_AT = (0, 24, 48, 16, 40, 64)  # bytes of position, velocity, force, angle, angular velocity, torque in a row of the batch
FASTEST = 1e3  # m/s, beyond which a body has run away
MOST_STEPS = 2000  # inner steps of one macro step
MOST_WORK = 1_250_000  # of one macro step, in visits (`work`), some 27 ns each: more would keep a caller waiting
MOST_SETTLING = 400_000_000  # of the time that the robot is given before the start, in the same: some 10 s
STEADY = 2.25  # of dt^2 k/m + dt c/m across the track. Of a free mass dt^2 k/m + 2 dt c/m < 4; of pinned ones it was seen to hold
# from 0.3 to 2 of the one and 0.5 to 2 of the other, of segments of 7.5 to 45 g; along the track nothing was seen up to 3.5 and 6
RAMP = 3.0  # pitches over which a rail comes out to its height
_BELLY = 7  # points of the chassis' underside that can touch the ground


class Geometry:
    """Lengths that follow from the parameters."""

    def __init__(self, v: dict[str, Any]):
        runs = v["segments"] - v["teeth"]
        if v["segments"] % 2 or v["teeth"] % 2 or runs < 4:
            raise DescriptionError("segments and teeth must be even numbers, segments at least 4 more than teeth.")
        self.length = v["holder_length"]
        self.pitch = 2.0 * self.length / runs
        half = math.pi / v["teeth"]
        self.pitch_radius = self.pitch / (2.0 * math.sin(half))  # circle of the pins
        self.center_radius = self.pitch / (2.0 * math.tan(half))  # circle of the segments' centres
        self.belt_radius = self.pitch * v["teeth"] / (2.0 * math.pi)  # travel of the track per angle of the sprocket
        # the guide presses into the arcs by what turns the tension round a tooth's angle
        self.guide_radius = self.center_radius + v["track_tension"] * 2.0 * math.sin(half) / v["guide_stiffness"]

    def pins(self, v: dict[str, Any]) -> np.ndarray:
        """The track's pins in the holder's frame, counter-clockwise from under the hinge."""
        n, arc = (v["segments"] - v["teeth"]) // 2, v["teeth"] // 2
        r, step = self.pitch_radius, 2.0 * math.pi / v["teeth"]
        points = [(i * self.pitch, -r) for i in range(n)]
        points += [(self.length + r * math.sin(i * step), -r * math.cos(i * step)) for i in range(arc)]
        points += [(self.length - i * self.pitch, r) for i in range(n)]
        points += [(-r * math.sin(i * step), r * math.cos(i * step)) for i in range(arc)]
        return np.array(points)


def work(v: dict[str, Any], points: int) -> int:
    """How much an inner step is to do, in visits of a joint by pymunk's solver; forces and positions counted in such.

    points: of the ground. Measured with 12 to 400 segments, 1 to 200 iterations and 2 to 9000 points, within a third.
    """
    own = 150 + 2 * v["segments"] + v["iterations"] if v["track"] == "belt" else v["segments"] * (v["iterations"] + 7)
    return own + points // 5


def inner_step(v: dict[str, Any]) -> float:
    """The inner step, s: `inner_step`, or what springs and dampers across a segment ask for where that is shorter.

    There guide and ground press on it, with all its feet and at the depth where eq 24 ends. Forces are held over a step (symplectic
    Euler method), so that one of them that is too stiff for it makes the segment swing ever more.
    """
    if v["track"] == "belt":
        return v["inner_step"]
    mass, depth = SIDES * v["segment_mass"], v["ground_depth"]
    slope = v["ground_stiffness"] * v["ground_exponent"] * depth ** (v["ground_exponent"] - 1.0)
    k = (v["guide_stiffness"] + kernel.FEET * slope) / mass
    c = (v["guide_damping"] + kernel.FEET * v["ground_damping"]) / mass
    return min(v["inner_step"], 2.0 * STEADY / (c + math.sqrt(c * c + 4.0 * STEADY * k)))


def with_(v: dict[str, Any]) -> str:
    return f"with {v['segments']} segments and {v['iterations']} iterations"


class Model:
    """A built vehicle: `space`, `bodies` (chassis, holders, segments), `joints` and the arrays of the kernel."""

    def __init__(self, values: dict[str, Any], direct: bool = True):
        v = self.values = values
        if v["track"] not in ("segmented", "belt"):
            raise DescriptionError(f"track = {v['track']!r} is not known. Write segmented or belt.")
        self.gx, self.gy = ground.profile(v["ground"])
        self.inner = inner_step(v)
        most = MOST_SETTLING // work(v, len(self.gx))
        if v["settling_time"] > most * min(self.inner, 1e-3):
            told, longer = self.asked()
            raise DescriptionError(
                f"settling_time = {v['settling_time']:g} s takes more than {most} inner steps of {told}, "
                f"and no more are made {with_(v)}; give the robot less time to settle, {longer}, fewer segments or "
                "iterations."
            )
        self.geometry = Geometry(v)
        self.belt = v["track"] == "belt"
        self.constants = np.zeros(1, kernel.CONSTANTS)
        self._fill()
        self._make_bodies()

        count = v["segments"]
        self.inputs = np.zeros(7)
        self.state = np.zeros(4)
        self.zero = np.zeros(2)
        self.bristle = np.zeros((2, kernel.FEET * count))
        self.scrape = np.zeros(_BELLY)
        self.told = np.zeros((3, 4))
        self.outputs = np.zeros(len(OUTPUTS))
        reach = 0.5 * v["wheelbase"]
        self.belly = np.column_stack([np.linspace(-reach, reach, _BELLY), np.full(_BELLY, v["belly_height"] + v["shoe_height"])])
        self.belly -= (v["chassis_center_x"], v["chassis_center_y"])

        layout = munk.layout() if direct else None
        self.layout = layout
        self.step_address, self.space_address = munk.space_step(), munk.address(self.space._space)
        if layout:
            self.at = np.array(layout[:6], np.int64)
            self.body = np.array([munk.address(b._body) for b in self.bodies], np.int64)
        else:
            rows = len(self.bodies)
            self._rows = np.zeros((rows + 8, 9))  # slack beyond the exact size: the batch grows its arrays by itself otherwise
            self._batch = pymunk.batch.Buffer()
            self._batch.set_float_buf(self._rows)
            self.at = np.array(_BATCH_AT, np.int64)
            self.body = self._rows.ctypes.data + 72 * np.arange(rows, dtype=np.int64)
            self._fetch()
        self.most_steps = min(MOST_STEPS, MOST_WORK // work(v, len(self.gx)))  # inner steps of a macro step
        self.arrays = (
            self.constants,
            self.gx,
            self.gy,
            self.belly,
            self.inputs,
            self.state,
            self.body,
            self.at,
            self.bristle,
            self.scrape,
            self.told,
            self.zero,
            self.outputs,
        )
        described = addresses.described(self.arrays)
        self.head = np.array([0.0, 0.0, self.inner, self.most_steps * self.inner, FASTEST, 0.0, *[0.0] * len(described)])
        places = self.head.view(np.int64)
        places[:2], places[kernel.HEAD // 8 :] = (self.step_address, self.space_address), described
        self.sized = self.head[kernel.SIZE // 8 :][:1]  # s, of the macro steps that dt is made for

    def _fill(self) -> None:
        v, g, c = self.values, self.geometry, self.constants
        for name in (
            "gravity",
            "ground_stiffness",
            "ground_exponent",
            "ground_damping",
            "ground_depth",
            "ground_friction",
            "bristle_stiffness",
            "bristle_damping",
            "guide_stiffness",
            "guide_damping",
            "tooth_stiffness",
            "tooth_damping",
            "holder_length",
            "rail_height",
        ):
            c[name] = v[name]
        c["sides"], c["driven"], c["belt"] = SIDES, v["driven_sprockets"], self.belt
        c["ground_top"], c["shoe"], c["foot_pitch"] = max(self.gy), v["shoe_height"], g.pitch / kernel.FEET
        c["guide_radius"], c["belt_radius"], c["tooth_angle"] = g.guide_radius, g.belt_radius, 2.0 * math.pi / v["teeth"]
        c["level"] = min(self.gy) == max(self.gy)
        c["foot_back"] = math.hypot(g.center_radius, g.pitch / kernel.FEET) - g.center_radius
        c["rail_ramp"] = RAMP * g.pitch
        track = v["segments"] * v["segment_mass"]
        spin = 0.5 * v["sprocket_mass"] * g.pitch_radius**2 + (track * g.belt_radius**2 if self.belt else 0.0)
        c["sprocket_inertia"] = SIDES * spin
        c["segment_weight"] = 0.0 if self.belt else SIDES * v["segment_mass"] * v["gravity"]
        c["front_hinge_x"] = 0.5 * v["wheelbase"] - v["chassis_center_x"]
        c["rear_hinge_x"] = -0.5 * v["wheelbase"] - v["chassis_center_x"]
        c["hinge_y"] = -v["chassis_center_y"]

    def _holder(self) -> tuple[float, float, float]:
        """Mass, centre of mass in front of the hinge and inertia about it, of both sides' holders with what is fixed to them."""
        v, g = self.values, self.geometry
        pieces = [  # mass, distance, inertia about its own centre
            (v["holder_mass"], v["holder_center"], v["holder_mass"] * g.length**2 / 12.0),
            (v["idler_mass"], g.length, 0.5 * v["idler_mass"] * g.pitch_radius**2),
            (v["sprocket_mass"], 0.0, 0.0),  # its spin is a state of its own
        ]
        if self.belt:
            mass = v["segments"] * v["segment_mass"]
            pins = g.pins(v) - (0.5 * g.length, 0.0)
            pieces.append((mass, 0.5 * g.length, mass * float(np.mean(np.sum(pins**2, axis=1)))))
        mass = sum(m for m, _, _ in pieces)
        center = sum(m * x for m, x, _ in pieces) / mass
        inertia = sum(i + m * (x - center) ** 2 for m, x, i in pieces)
        return SIDES * mass, center, SIDES * inertia

    def _make_bodies(self) -> None:
        v, g = self.values, self.geometry
        space = self.space = pymunk.Space()
        space.gravity, space.iterations = (0.0, -v["gravity"]), v["iterations"]
        mass, center, inertia = self._holder()
        self.constants["holder_center"], self.constants["holder_weight"] = center, mass * v["gravity"]

        half = 0.5 * v["wheelbase"]
        angles = (v["front_start_angle"], v["rear_start_angle"])
        pins = [
            np.array([(s * half + x * math.cos(a) - y * math.sin(a), x * math.sin(a) + y * math.cos(a)) for x, y in g.pins(v)])
            for s, a in zip((1.0, -1.0), angles)
        ]
        origin, pitch = self._place(np.vstack(pins))
        turn = np.array([[math.cos(pitch), math.sin(pitch)], [-math.sin(pitch), math.cos(pitch)]])

        def world(point):
            return tuple(origin + np.asarray(point, float) @ turn)

        chassis = pymunk.Body(v["chassis_mass"], v["chassis_inertia"])
        chassis.position, chassis.angle = world((v["chassis_center_x"], v["chassis_center_y"])), pitch
        self.bodies, self.joints = [chassis], []
        for s, a in zip((1.0, -1.0), angles):
            holder = pymunk.Body(mass, inertia)
            holder.position = world((s * half + center * math.cos(a), center * math.sin(a)))
            holder.angle = pitch + a
            self.bodies.append(holder)
            self.joints.append(
                pymunk.PivotJoint(chassis, holder, (s * half - v["chassis_center_x"], -v["chassis_center_y"]), (-center, 0.0))
            )
        if not self.belt:
            m = SIDES * v["segment_mass"]
            for points in pins:
                links = []
                for start, end in zip(points, np.roll(points, -1, axis=0)):
                    link = pymunk.Body(m, m * (g.pitch**2 + v["shoe_height"] ** 2) / 12.0)
                    link.position = world(0.5 * (start + end))
                    link.angle = pitch + math.atan2(end[1] - start[1], end[0] - start[0])
                    links.append(link)
                self.joints += [
                    pymunk.PivotJoint(one, other, (0.5 * g.pitch, 0.0), (-0.5 * g.pitch, 0.0))
                    for one, other in zip(links, links[1:] + links[:1])
                ]
                self.bodies += links
        space.add(*self.bodies, *self.joints)

    def _place(self, pins: np.ndarray) -> tuple[np.ndarray, float]:
        """Where the middle between the hinges goes and the pitch, so that the tracks just touch the ground."""
        v, half = self.values, 0.5 * self.values["wheelbase"]
        travel = 0.0 if v["driven_sprockets"] else -v["sprocket_speed"] * self.geometry.belt_radius * v["settling_time"]
        x0 = v["start_x"] - travel  # it rolls while it settles
        low, high = ground.height(self.gx, self.gy, x0 - half), ground.height(self.gx, self.gy, x0 + half)
        pitch = math.atan2(high - low, 2.0 * half)
        c, s = math.cos(pitch), math.sin(pitch)
        x0 += travel * (1.0 - c)
        points = np.column_stack([x0 + pins[:, 0] * c - pins[:, 1] * s, pins[:, 0] * s + pins[:, 1] * c])
        reach, shoe = self.geometry.pitch_radius, v["shoe_height"]

        def gap(y):
            return min(kernel.clearance(self.gx, self.gy, px, py + y, 3.0 * reach)[0] for px, py in points) - shoe

        y = max(low, high) + 4.0 * (reach + v["holder_length"])
        for _ in range(60):  # down by the distance that is left: never through, and soon there
            distance = min(gap(y), 0.25)
            y -= distance
            if abs(distance) < 1e-6:
                break
        return np.array([x0, y]), pitch

    def too_long(self, size: float) -> str:
        """Why a macro step has too many inner steps, and what to do, as a sentence; "" where it has not."""
        inner, most = self.inner, self.most_steps
        if size <= most * inner:
            return ""
        told, longer = self.asked()
        return (
            f"a step of {size:.9g} s takes {size / inner:.3g} inner steps of {told}, and {most} at most "
            f"are made {with_(self.values)}; try a step of {most * inner:.9g} s or less, {longer}, fewer segments or "
            "iterations"
        )

    def asked(self) -> tuple[str, str]:
        """The inner step and who asks for it; and what makes it longer."""
        if self.inner == self.values["inner_step"]:
            return f"inner_step = {self.inner:.9g} s", "a longer inner_step"
        return f"what a segment's springs ask for, {self.inner:.9g} s", "heavier segments or softer guides and contacts"

    def advance(self, size: float) -> bool:
        """One macro step: as many equal inner steps as keep each within the inner step. False when inputs or bodies are not sound."""
        if self.too_long(size):
            return False
        steps = max(1, math.ceil(size / self.inner - 1e-9))
        if size != self.sized[0]:
            self.sized[0], self.constants["dt"] = size, size / steps
        if self.layout:
            return kernel.advance(steps, self.step_address, self.space_address, FASTEST, *self.arrays)
        if not np.isfinite(self.inputs).all():
            return False
        for _ in range(steps):
            kernel.only_forces(*self.arrays)
            pymunk.batch.set_space_bodies(self.space, _FIELDS, self._batch)
            self.space.step(size / steps)
            self._fetch()
        self.tell()
        return kernel.sound(self.body, self.at, FASTEST)

    def _fetch(self) -> None:
        self._batch.clear()
        pymunk.batch.get_space_bodies(self.space, _FIELDS, self._batch)

    def settle(self, time: float) -> None:
        """Lets the robot come to rest on the ground with its drives held where they are, sprockets turning as they will."""
        v, c, driven = self.values, self.constants, float(self.constants["driven"][0])
        speed = 0.0 if driven else self.inputs[kernel.SPROCKET_SPEED]
        saved = self.inputs.copy()
        self.inputs[:] = 0.0
        self.inputs[kernel.SPROCKET_SPEED] = speed
        self.inputs[kernel.FRONT_HOLD], self.inputs[kernel.REAR_HOLD] = v["front_start_angle"], v["rear_start_angle"]
        hold = SIDES * v["holding_stiffness"]
        c["driven"], c["hold_stiffness"], c["hold_damping"] = 0.0, hold, 2e-3 * hold
        for track in range(2):  # the teeth stand where the segments are
            self.state[track] = (v["front_start_angle"], v["rear_start_angle"])[track] + 0.5 * float(c["tooth_angle"][0])
        steps = round(time / 1e-3)
        for _ in range(steps):
            self.advance(1e-3)
        c["driven"], c["hold_stiffness"], c["hold_damping"] = driven, 0.0, 0.0
        self.inputs[:] = saved
        angle = self.bodies[0].angle
        if driven:
            self.state[:2] += angle
            self.state[2:] = self.bodies[0].angular_velocity
        self.zero[:] = self.state[:2] - (angle if driven else 0.0)

    def tell(self) -> np.ndarray:
        """The outputs as they are now."""
        kernel.outputs(self.constants, self.state, self.zero, self.body, self.at, self.told, self.outputs)
        return self.outputs

    def positions(self) -> np.ndarray:
        """x, y and angle of every body, in the order of `bodies`."""
        return np.array([(*body.position, body.angle) for body in self.bodies])

    def sound(self) -> bool:
        """Whether every body's position and speed are finite and sane."""
        return kernel.sound(self.body, self.at, FASTEST)

    @property
    def exact(self) -> bool:
        """Whether a saved state continues bit for bit: only where the joints' warm start can be read."""
        return self.layout is not None

    def save(self) -> tuple:
        """Everything that decides what comes next, the joints' warm start among it."""
        return (
            np.concatenate(self._memory()),
            [a.copy() for a in self._own()],
            float(lib.cpSpaceGetCurrentTimeStep(self.space._space)),
        )

    def restore(self, saved: tuple) -> None:
        memory, own, dt = saved
        place = 0
        for part in self._memory():
            part[:] = memory[place : place + len(part)]
            place += len(part)
        for mine, theirs in zip(self._own(), own):
            mine[:] = theirs
        lib.cpSpaceSetCurrentTimeStep(self.space._space, dt)

    def _memory(self) -> list[np.ndarray]:
        """Views of pymunk's memory: the state of every body, and the impulse from which a joint's next step starts."""
        lay = self.layout
        assert lay is not None  # asked for only where `exact`
        state = ((lay.position, 2), (lay.velocity, 2), (lay.angle, 1), (lay.angular_velocity, 1), (lay.transform, 6))
        views = [munk.doubles(body._body, offset, count) for body in self.bodies for offset, count in state]
        return views + [munk.doubles(joint._constraint, lay.impulse, 2) for joint in self.joints]

    def _own(self) -> tuple[np.ndarray, ...]:
        return self.inputs, self.state, self.zero, self.bristle, self.scrape, self.told
