import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))


@pytest.fixture(scope="session")
def native(tmp_path_factory):
    """native("tank"): the path of a C FMU of tests/native, compiled here."""
    import hidden  # noqa: F401  # tests/native is found from there on
    from pack import pack

    folder, made = tmp_path_factory.mktemp("native"), {}

    def path(name):
        if name not in made:
            made[name] = pack(name, folder)
        return made[name]

    return path
