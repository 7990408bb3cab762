"""Progress: a bar on a terminal alone, elsewhere plain lines, few, with what is known and no guess that is none."""

import io
import os
import pty
import subprocess
import sys
import threading
from threading import Event

import pytest

from selflock.diagnosis import diagnose
from selflock.diagnosis.progress import Doing, lasting, shown, spoken
from selflock.diagnosis.rules import RULES

from .residuals.test_experiment import inverse

EVERY = RULES.pipeline.told_every


def doing(*told):
    """What was told of (what, share) at these seconds."""
    found = Doing("begin", 0.0, 0.0, 0.0, 0.0)
    for what, share, now in told:
        found = found.next(what, share, now)
    return found


@pytest.mark.parametrize("told, now, line", [
    ((), 12.0, "12 s: begin"),
    ((("fit of the nominal drive", 0.0, 5.0),), 95.0, "1 min 35 s: fit of the nominal drive"),  # nothing counts it
    ((("cause 1: fits", 0.0, 20.0), ("cause 1: fits (best as yet: load tilt)", 0.25, 40.0)), 50.0,
     "50 s: cause 1: fits (best as yet: load tilt), 25 % done, about 50 s left of this"),
    ((("cause 1: fits", 0.0, 20.0), ("cause 1: fits", 0.5, 20.0 + 0.9 * EVERY)), 40.0, "40 s: cause 1: fits, 50 % done"),  # too soon
    ((("cause 1: fits", 0.0, 20.0), ("cause 1: fits", 0.5, 40.0)), 61.0, "1 min 1 s: cause 1: fits, 50 % done"),  # slower than guessed
    ((("cause 1: fits", 0.0, 20.0), ("cause 1: fits", 1.0, 40.0)), 50.0, "50 s: cause 1: fits, 100 % done"),
    ((("cause 1: fits", 0.9, 20.0), ("cause 1: chance", 0.0, 40.0)), 70.0, "1 min 10 s: cause 1: chance"),
    ((("replay of each component", 0.1, 0.0), ("what remains", 0.7, 30.0)), 40.0, "40 s: what remains"),  # shares of no count
])  # fmt: skip
def test_a_line_says_what_is_done_and_guesses_only_from_what_was_counted(told, now, line):
    assert doing(*told).line(0.0, now) == line


def test_durations_are_words():
    assert [lasting(s) for s in (0.4, 59.6, 119.7, 3723.0)] == ["0 s", "1 min 0 s", "2 min 0 s", "62 min 3 s"]


class Heard(io.StringIO):
    """A stream that says when a line with this word was written."""

    def __init__(self, word):
        super().__init__()
        self.word, self.heard = word, Event()

    def write(self, text):
        written = super().write(text)
        if text == "\n" and self.word in self.getvalue():
            self.heard.set()
        return written


def test_lines_come_while_nothing_is_told_and_none_behind_the_end():
    stream = Heard("fits")
    with spoken(stream, clock=lambda: 3.0, every=1e-3) as tell:
        tell("cause 1: \x1b[2J\u202efits", 0.5)
        assert stream.heard.wait(60.0)
    said = stream.getvalue()
    assert said.splitlines()[-1] == "0 s: cause 1: \\x1b[2J\\u202efits" and "\x1b" not in said
    assert not [thread for thread in threading.enumerate() if thread.name == "progress"]


def test_a_reader_that_went_away_stops_nothing():
    class Gone(io.StringIO):
        asked = Event()

        def write(self, text):
            self.asked.set()
            raise BrokenPipeError

    with spoken(Gone(), every=1e-3) as tell:
        assert Gone.asked.wait(60.0)
        tell("fits", 0.5)
    with spoken(None, every=1e-3) as tell:
        tell("fits", 0.5)


@pytest.mark.slow
def test_a_function_is_told_the_causes_found_and_the_best_as_yet(tmp_path, rng):
    inverse(tmp_path, rng, friction=0.04, noise=2e-3)
    told = []
    result = diagnose(tmp_path / "rig.toml", [tmp_path / "log.csv"], out=None, progress=lambda *both: told.append(both))
    stages = [what.partition(" (")[0] for what, _ in told]
    first = ["reading", "fit of the nominal drive", "cause 1: first look", "cause 1: fits", "cause 1: chance"]
    assert list(dict.fromkeys(stages))[:5] == first
    fits = [both for both in told if both[0].startswith("cause 1: fits")]
    assert fits[0] == ("cause 1: fits", 0.0) and [share for _, share in fits] == sorted(share for _, share in fits)
    assert any("best as yet: " in what for what, _ in fits)
    assert any(what.startswith(f"gain (found: {result.causes[0].label.removeprefix('parameter ')}") for what, _ in told)


def test_nothing_is_said_unless_it_is_asked_for(capfd):
    with shown(False) as tell:
        tell("fits", 0.5)
    assert capfd.readouterr() == ("", "")


SHOWN = """
import sys
from threading import Event
from selflock.diagnosis import progress

spoken, heard = progress.spoken, Event()

class Through:
    def write(self, text):
        sys.stderr.write(text)
        heard.set()
    def flush(self):
        sys.stderr.flush()

def soon(stream):
    assert stream is sys.stderr
    return spoken(Through(), every=1e-3)

progress.spoken = soon
with progress.shown(True) as tell:
    tell("cause 1: fits", 0.5)
    assert "lines" not in sys.argv or heard.wait(60.0)
"""


@pytest.mark.slow
def test_without_a_terminal_lines_go_to_stderr_and_stdout_is_the_answers_alone():
    """Even where colours are forced."""
    environment = os.environ | {"FORCE_COLOR": "1"}
    done = subprocess.run([sys.executable, "-c", SHOWN, "lines"], capture_output=True, text=True, env=environment, timeout=120)
    assert done.stdout == "" and "\x1b" not in done.stderr, done
    assert done.returncode == 0 and set(done.stderr.splitlines()) <= {"0 s: begin", "0 s: cause 1: fits"} and done.stderr, done


@pytest.mark.parametrize("screen", ["stdout", "stderr"])
@pytest.mark.slow
def test_a_terminal_shows_a_bar_whichever_stream_it_is(screen):
    ours, theirs = pty.openpty()
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | {screen: theirs}
    environment = {k: v for k, v in os.environ.items() if k not in ("FORCE_COLOR", "NO_COLOR")} | {"TERM": "xterm"}
    process = subprocess.Popen([sys.executable, "-c", SHOWN], env=environment, text=True, **streams)
    said = process.communicate(timeout=120)
    os.close(theirs)
    seen = b""
    try:
        while piece := os.read(ours, 4096):
            seen += piece
    except OSError:  # the other side is closed
        pass
    os.close(ours)
    assert b"cause 1: fits" in seen and b"\x1b" in seen
    assert said[screen == "stdout"] == ""
