"""Systems that break off, run away or cannot be run twice: what is told of them, and that a naming gets by."""

import hidden
import pytest

from selflock.diagnosis import calibrate, name
from selflock.diagnosis.naming.extended import Extended
from selflock.errors import DataError


def bodies(tmp_path, native, rng):
    """The rig of a heated body, and two logs of it."""
    rig = hidden.rig(tmp_path, native("relaxation"))
    logs = [tmp_path / "log.csv", tmp_path / "test.csv"]
    for log in logs:
        hidden.body(rng, 200).to_csv(log, index=False)
    return rig, logs


@pytest.mark.slow
def test_what_cannot_be_reset_is_reset_nowhere(tmp_path, native, rng, monkeypatch):
    """Also not in the heads of the logs, nor in other steps: a reset that spoils memory spoils all that comes after it."""
    every, begun = [], Extended.__init__

    def watched(self, *given):
        begun(self, *given)
        every.append(self)

    def found(self, *given):
        assert not self.effort.runs  # seen before anything is simulated
        self.reusable = False
        return "it cannot be reset"

    monkeypatch.setattr(Extended, "__init__", watched)
    monkeypatch.setattr(Extended, "trust", found)
    rig, logs = bodies(tmp_path, native, rng)
    result = name(rig, logs[:1], test=logs[1:], out=None)
    assert result.verdict == "none" and "it cannot be reset" in result.notes
    assert len(every) > 2 and not any(played.reusable for played in every)


@pytest.mark.slow
@pytest.mark.parametrize("factor, zero, said", [(1000.0, 0.0, "times what"), (1.0, 273.15, "exchanged")])
def test_a_column_in_another_unit_is_told_and_not_named(tmp_path, native, rng, factor, zero, said):
    """No scale and no offset of a path, and no number of a body, makes mK of K."""
    rig, logs = bodies(tmp_path, native, rng)
    for log in logs:
        table = hidden.body(rng, 600)
        table.assign(body=factor * table["body"] + zero).to_csv(log, index=False)
    with pytest.raises(DataError, match=rf"column 'body' \(relaxation.x\) .*{said}"):
        name(rig, logs[:1], test=logs[1:], out=None)
    assert any(said in note for note in calibrate(rig, logs[:1], test=logs[1:], out=None).notes)


LOOP = """
[run]
stop = 10
step = 0.05
[components.body]
fmu = "relaxation.fmu"
start = { rate = 0.5 }
[connections]
"body.u" = { from = "body.x", factor = 30.0 }
"""


def test_a_system_that_runs_away_is_told_as_one(tmp_path, native, rng):
    """A loop of the wrong sign: what is no more than an enormous number breaks off no FMU."""
    rig, logs = bodies(tmp_path, native, rng)
    (tmp_path / "loop.toml").write_text(LOOP)
    rig.write_text(
        '[rig]\nsystem = "loop.toml"\n[columns]\n"body.x" = "body"\n'
        '[calibrate]\n"body.x" = { start = 0.3, low = 0.1, high = 0.5, each_run = true }\n'
    )
    with pytest.raises(DataError, match=r"body.x runs away, to \S+e\+\d+ beside what is measured, .* is a sign wrong"):
        name(rig, logs[:1], test=logs[1:], out=None)
