"""Steps of our FMUs' laws as C calls them (fmus/loader/door.c): compiled together with the laws, by compiled.compiled_loops.

p, s, u: addresses of the parameters' numbers, the state's and the inputs; h: the step, s; to, out: addresses of where the next
state and the outputs go. 1: done.
"""

from selflock.fmus.controller import pd
from selflock.fmus.load import load
from selflock.fmus.motor import dc
from selflock.fmus.reducer import shaft
from selflock.fmus.sensor import sensor
from selflock.master.addresses import load as real
from selflock.master.addresses import put, tuple_at


def _told(made, to, out):
    state, values = made
    put(to, state)
    put(out, values)
    return 1


def controller(p, s, u, h, to, out):
    given = real(u), real(u + 8), real(u + 16), real(u + 24), real(u + 32), real(u + 40)
    return _told(pd.advance(tuple_at(p, pd.Parameters), tuple_at(s, pd.State), *given, h), to, out)


def load_(p, s, u, h, to, out):
    return _told(load.advance(tuple_at(p, load.Parameters), tuple_at(s, load.State), real(u), h), to, out)


def motor(p, s, u, h, to, out):
    return _told(dc.advance(tuple_at(p, dc.Parameters), tuple_at(s, dc.State), real(u), real(u + 8), h), to, out)


def reducer_dynamic(p, s, u, h, to, out):
    given = real(u), real(u + 24), real(u + 32)
    return _told(shaft.advance(tuple_at(p, shaft.Parameters), tuple_at(s, shaft.State), *given, h), to, out)


def reducer_kinematic(p, s, u, h, to, out):
    given = real(u + 8), real(u + 16), real(u + 24), real(u + 32)
    return _told(shaft.impose(tuple_at(p, shaft.Parameters), tuple_at(s, shaft.State), *given, h), to, out)


def sensor_(p, s, u, h, to, out):
    return _told(sensor.advance(tuple_at(p, sensor.Parameters), tuple_at(s, sensor.State), real(u), h), to, out)
