"""Temporary folders are gone with their process; what a killed one left, the next takes away."""

import os
import subprocess
import sys

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
