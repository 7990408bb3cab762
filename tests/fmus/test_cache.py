"""The cache is the user's alone, and what is in it is as it was made."""

import hashlib
import os
import pickle
import stat
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

import pytest

from selflock.fmus import cache
from selflock.fmus.build import built


@pytest.fixture
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("SELFLOCK_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


FILES = {"__init__.py": b"", "law.py": b"x = 1\n", "effects/one.py": b"y = 2\n"}


def test_it_is_made_for_its_user_alone(home):
    old = os.umask(0)
    try:
        assert cache.folder() == home
    finally:
        os.umask(old)
    assert stat.S_IMODE(home.stat().st_mode) == 0o700


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o1777, 0o702])
def test_a_folder_that_others_can_write_to_is_not_used(home, mode, caplog):
    home.mkdir()
    home.chmod(mode)
    (home / "planted").touch()
    made = cache.folder()
    assert made != home and stat.S_IMODE(made.stat().st_mode) == 0o700 and cache.folder() == made
    assert "chmod 700" in caplog.text and not list(made.iterdir())


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
def test_a_folder_or_link_of_another_user_is_not_used(home, tmp_path):
    home.mkdir(mode=0o700)
    os.chown(home, 65534, 65534)
    assert cache.folder() != home
    home.rmdir()
    (tmp_path / "mine").mkdir(mode=0o700)
    home.symlink_to(tmp_path / "mine")
    assert cache.folder() == home
    os.lchown(home, 65534, 65534)
    assert cache.folder() != home


def test_where_no_cache_can_be_the_folder_is_unpredictable_and_goes_with_the_process(tmp_path):
    code = "from selflock.fmus import cache; f = cache.folder(); (f / 'x').touch(); print(f)"
    (tmp_path / "file").touch()
    made = []
    for _ in range(2):
        environment = {**os.environ, "SELFLOCK_CACHE": str(tmp_path / "file" / "cache")}
        made.append(
            Path(
                subprocess.run(
                    [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
                ).stdout.strip()
            )
        )
    assert made[0] != made[1] and not any(path.exists() for path in made)


def planted(folder):
    (folder / "law.cpython-311-x86_64-linux-gnu.so").write_bytes(b"native code")


def linked(folder):
    (folder / "law.py").unlink()
    (folder / "law.py").symlink_to("/etc/passwd")


HARM = {
    "changed": lambda folder: (folder / "law.py").write_bytes(b"x = 2\n"),
    "cut off": lambda folder: (folder / "effects" / "one.py").write_bytes(b""),
    "missing": lambda folder: (folder / "law.py").unlink(),
    "planted": planted,
    "linked": linked,
    "a file": lambda folder: (cache._away(folder), folder.write_bytes(b"")),
    "open": lambda folder: folder.chmod(0o777),
}


@pytest.mark.parametrize("harm", HARM)
def test_a_copy_that_is_off_is_made_again(home, harm):
    folder = cache.copied("laws", FILES)
    inode = folder.stat().st_ino
    (folder / "__pycache__").mkdir()
    assert cache.copied("laws", FILES) == folder and folder.stat().st_ino == inode
    HARM[harm](folder)
    assert cache.copied("laws", FILES) == folder
    assert {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()} == FILES
    assert [p.name for p in home.iterdir()] == ["laws"]


@pytest.mark.slow
@pytest.mark.alike
@pytest.mark.parametrize("harm", ["flip", "cut", "gone", "folder", "seal", "open"])
def test_an_fmu_that_is_off_is_built_again(home, harm):
    path = built("Sensor")
    good = path.read_bytes()
    if harm == "flip":
        path.write_bytes(good[:500] + bytes([good[500] ^ 1]) + good[501:])
    elif harm == "cut":
        path.write_bytes(good[:100])
    elif harm in ("gone", "folder"):
        path.unlink()
        if harm == "folder":
            path.mkdir()
    elif harm == "open":
        path.chmod(0o666)
    else:
        Path(f"{path}.sha256").write_bytes(b"\xff")
    assert built("Sensor") == path and path.read_bytes() == good and stat.S_IMODE(path.stat().st_mode) == 0o644
    assert Path(f"{path}.sha256").read_text() == hashlib.sha256(good).hexdigest()


USE = """
from numba import njit
from selflock.fmus.cache import sealed
import sys
sys.path.insert(0, {folder!r})
import small
print(sealed(njit(small.twice, cache=True))(21.0))
"""


@pytest.mark.in_turn
@pytest.mark.slow
@pytest.mark.parametrize("harm", ["flip", "cut", "empty"])
def test_what_numba_kept_is_checked_before_it_is_loaded(tmp_path, harm):
    pytest.importorskip("numba")
    (tmp_path / "small.py").write_text("def twice(x):\n    return 2.0 * x\n")

    def run():
        done = subprocess.run([sys.executable, "-c", USE.format(folder=str(tmp_path))], capture_output=True, text=True)
        assert done.returncode == 0 and done.stdout == "42.0\n", done.stderr

    run()
    kept = [p for p in (tmp_path / "__pycache__").iterdir() if p.suffix in (".nbc", ".nbi")]
    assert len(kept) == 2
    for path in kept:
        good = path.read_bytes()
        middle = len(good) // 2
        path.write_bytes(
            {"flip": good[:middle] + bytes([good[middle] ^ 8]) + good[middle + 1 :], "cut": good[:middle], "empty": b""}[harm]
        )
        run()


def test_what_another_numba_kept_is_compiled_again():
    """It is whole, so that its seal fits, and names modules that are not there any more."""
    told = pickle.dumps(SimpleNamespace).replace(b"types", b"olden")

    class Kept:
        def _load_data(self, name):
            return pickle.loads(told)

        def _data_path(self, name):
            return name

    with pytest.raises(ModuleNotFoundError):
        Kept()._load_data("")
    with pytest.raises(OSError, match="held.nbc"), TemporaryDirectory() as folder:
        (path := Path(folder) / "held.nbc").write_bytes(told)
        Path(f"{path}.sha256").write_text(hashlib.sha256(told).hexdigest())
        cache._sealed(Kept)()._load_data(str(path))
