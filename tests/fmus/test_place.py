"""Files that are there whole or not at all."""

import resource

import pytest

from selflock.fmus.errors import SelflockError
from selflock.fmus.place import claim, claimed, whole


def test_a_file_is_there_whole_or_as_it_was(tmp_path):
    path = tmp_path / "x.html"
    path.write_text("before")
    with pytest.raises(KeyboardInterrupt), whole(path) as new:
        new.write_text("half")
        raise KeyboardInterrupt
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        with pytest.raises(OSError) as told, whole(path) as new:
            new.write_text("a" * 10_000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert told.value.filename == str(path) and "too large" in told.value.strerror
    assert path.read_text() == "before" and list(tmp_path.iterdir()) == [path]
    with whole(path) as new:
        new.write_text("after")
    assert path.read_text() == "after" and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("there", ["nothing", "empty", "ours"])
def test_a_folder_is_left_as_it_was_where_the_work_is_refused(there, tmp_path):
    folder = tmp_path / "out" / "replay"
    if there != "nothing":
        folder.mkdir(parents=True)
    if there == "ours":
        claim(folder, "replay", "replay.json")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(SelflockError), claimed(folder, "replay", "replay.json") as made:
        assert (made / ".selflock").exists()
        raise SelflockError("a log that is none")
    assert sorted(tmp_path.rglob("*")) == before
    with pytest.raises(SelflockError), claimed(folder, "replay", "replay.json") as made:
        (made / "kept.csv").write_text("1")
        raise SelflockError("told late")
    assert (folder / "kept.csv").exists()  # what was written is kept
    with claimed(None, "replay", "replay.json") as made:
        assert made is None
