"""A user's effect file, named by the contest: a damaged tooth, hidden in a plant that has it by another formula."""

import shutil
import subprocess
import sys

import pytest

from selflock.diagnosis import diagnose

from ..fmus.own_effects import ELSEWHERE
from .plant import bench, score
from .plant.outside import OF_A_USER

pytestmark = [pytest.mark.slow, pytest.mark.in_turn(0)]  # the laws are compiled with the effect among them
SEED = 2


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory):
    """The case, what is answered, the folder that it was written to, and what was told meanwhile."""
    folder = tmp_path_factory.mktemp("tooth")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bench, "DRAWS", OF_A_USER)
        case = bench.hide(["reducer.tooth"], seed=SEED, target=5.0)
    rig, train, test = case.write(folder)
    (folder / "my_laws").mkdir()
    (folder / "my_laws" / "tooth.py").write_text(ELSEWHERE)
    rig.write_text(rig.read_text().replace("[rig]", '[rig]\neffects = "my_laws"', 1))
    told = []
    tell = lambda what, share: told.append(what)
    result = diagnose(rig, [train], test=[test], out=folder / "out", seed=SEED, progress=tell, allow_code=True)
    shutil.rmtree(folder / "my_laws")
    return case, result, folder / "out", told


def test_it_is_named_where_it_is_and_closes_the_error(diagnosed):
    case, result, _, told = diagnosed
    assert told[:2] == ["reading", "the rig's effects, compiled with ours"]
    assert score.answers(score.plain(result)) == ["reducer.tooth"], result.summary()
    assert result.gain.after < 0.5 * result.gain.before
    numbers = {name: row["value"] for name, row in score.plain(result)["causes"][0]["parameters"].items()}
    truth = case.truth
    assert numbers["reducer.tooth_place"] == pytest.approx(truth.tooth_place + 0.5 * truth.tooth_length, abs=0.02)
    assert numbers["reducer.tooth_depth"] == pytest.approx(truth.tooth, rel=0.15)


def test_report_and_fmu_have_it_and_the_fmu_runs_without_its_folder(diagnosed):
    _, result, out, _ = diagnosed
    assert "exp(-((angle - place) / width)^2)" in (out / "report.html").read_text()
    assert result.extension["fmu"] == pytest.approx(result.extension["promised"], rel=1e-6)
    numbers = score.plain(result)["causes"][0]["parameters"]
    depth, place = (numbers[f"reducer.tooth_{name}"]["value"] for name in ("depth", "place"))
    ask = (
        "import sys; sys.modules['selflock'] = None; from fmpy import simulate_fmu; "
        f"out = simulate_fmu({str(out / 'reducer.fmu')!r}, stop_time=0.01, output_interval=0.01, start_values={{'output_angle': "
        f"{place!r}, 'imposed_angle': {place!r} * 50.0}}, output=['motor_torque_required']); print(out['motor_torque_required'][0])"
    )
    told = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, cwd=out.parent)
    assert told.returncode == 0, told.stderr
    assert float(told.stdout) == pytest.approx(depth, rel=1e-6)
