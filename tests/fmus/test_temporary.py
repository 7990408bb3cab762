"""Temporary folders are gone with their process; what a killed one left, the next takes away."""

import os
import subprocess
import sys
from itertools import count

from selflock.fmus import temporary


def test_what_was_left_is_taken_away_and_what_lives_stays(tmp_path):
    code = (
        "import sys; from selflock.fmus import temporary; a = temporary.folder(base=sys.argv[1]); (a / 'x').mkdir(); print(a, flush=True); "
        "sys.stdin.read() or sys.exit(0)"
    )

    def start():
        process = subprocess.Popen(
            [sys.executable, "-c", code, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        return process, process.stdout.readline().strip()

    (killed, left), (alive, kept) = start(), start()
    killed.kill()
    killed.communicate()
    others = tmp_path / "selflock_of_another_version"
    others.mkdir()
    linked = tmp_path / "selflock_link"
    linked.symlink_to(tmp_path / "elsewhere")
    os.utime(os.path.join(left, temporary.LOCK), (0, 0))
    temporary._sweep.cache_clear()
    mine = temporary.folder(base=str(tmp_path))
    assert not os.path.exists(left) and os.path.isdir(kept) and others.is_dir() and linked.is_symlink() and mine.is_dir()
    alive.communicate("")
    assert not os.path.exists(kept)
    temporary.remove(mine)


def test_ctrl_c_at_any_line_of_the_making_leaves_nothing(tmp_path, monkeypatch):
    """As if the signal came before each line in turn, until all lines are done."""
    monkeypatch.setattr(temporary, "_made", [])
    temporary._sweep(str(tmp_path))

    for line in count(1):
        lines = count(1)

        def interrupt(frame, event, _):
            if frame.f_code is not temporary.folder.__code__:
                return None
            if event == "line" and next(lines) == line:
                raise KeyboardInterrupt
            return interrupt

        before = sys.gettrace()
        try:
            sys.settrace(interrupt)
            made = temporary.folder(base=str(tmp_path))
        except KeyboardInterrupt:
            made = None
        finally:
            sys.settrace(before)
        temporary.clear()
        assert not list(tmp_path.iterdir())
        if made is not None:
            break
    assert line > 5
