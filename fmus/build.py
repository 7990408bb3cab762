"""Packs a component into an FMU that runs alone.

    Motor.fmu
    ├── modelDescription.xml, model.png
    ├── binaries/linux64, win64                  see fmus.loader
    ├── documentation/index.html
    ├── documentation/licenses/license.txt       ours, and of what is pythonfmu's
    └── resources
        ├── slavemodule.txt                      names the script
        ├── selflock_<hash>_motor.py             the script that pythonfmu imports: one import
        ├── selflock_<hash>/                     the sources as they are here, and model.py with the start values
        └── pythonfmu/                           as installed

The hash is of all the sources and start values: what one process loads of one FMU never meets the module of another,
nor that of an older build. The same content always makes the same bytes.
"""

from __future__ import annotations

import hashlib
import io
import logging
import os
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import indent, tostring

import pythonfmu

from . import cache, documentation, laws, loader, shown
from .description import describe
from .errors import BuildError
from .slave import Slave

log = logging.getLogger(__name__)

ROOT = Path(__file__).resolve().parent.parent
LICENSE = ROOT / "fmus" / "license.txt"
SHARED = ("fmus/__init__.py", "fmus/effect.py", "fmus/slave.py", "fmus/variable.py")
HOUSE = __name__.partition(".")[0] + "."  # the package whose rooms an FMU carries
FACES = ("Reducer", "Motor", "Controller", "Load", "Sensor")
# pythonfmu's library runs the script at every instantiation, and each time drops one reference too many to the
# script's globals: they would be freed under its feet. So the script takes one more each time it runs.
SCRIPT = """\
from {package}.model import {name}

{name}.script_globals.append(globals())
"""
MODEL = '''\
"""The face of this FMU with its start values."""

from .{module} import {face} as Face


class {name}(Face):
    identity = {key!r}
    laws = {laws!r}
    starts = {starts!r}
'''
EARLIEST = (1980, 1, 1, 0, 0, 0)  # the earliest a zip file knows


def build_all(out: str | Path, only: Iterable[str] | None = None) -> list[Path]:
    """Build every FMU, or those named in `only`, into the folder `out`."""
    names = list(FACES) if only is None else list(only)
    for name in names:
        face_of(name)  # a wrong name is told before anything is written
    return [build(name, out) for name in names]


def build(name: str, out: str | Path, **starts: Any) -> Path:
    """Build one FMU into the folder `out`, or as the file `out` if that ends in .fmu; `starts`: other start values."""
    face = face_of(name)
    path = Path(out) if str(out).endswith(".fmu") else Path(out) / f"{name}.fmu"
    return pack(face, sources_of(face), path, starts)


def built(name: str, **starts: Any) -> Path:
    """The FMU from the user's cache, built if it is not there yet or not as it was built. Safe beside other processes that do the same."""
    face = face_of(name)
    sources = sources_of(face)
    recipe = [
        Path(__file__),
        LICENSE,
        Path(documentation.__file__),
        Path(shown.__file__),
        *sorted(Path(loader.__file__).parent.glob("*.[chp]*")),
    ]
    key = _hash(sources, starts, *(file.read_bytes() for file in recipe if file.is_file()), (loader.compiler() or "").encode())

    def make(path: Path) -> None:
        log.info("building %s.fmu", name)
        pack(face, sources, path, starts)

    return cache.kept(f"{name}_{key}/{name}.fmu", make)


def face_of(name: str) -> type[Slave]:
    """The class behind the name of an FMU, with the effects of the laws in force."""
    if name not in FACES:
        raise BuildError(f"There is no FMU {name!r}. There are {', '.join(FACES)}.")
    return getattr(laws.module(f"{name.lower()}.fmu"), name)


def name_of(face: type[Slave]) -> str:
    """The name of a face's FMU: that of the class, without the Fmu that keeps it apart from a part of the same name."""
    return face.__name__.removesuffix("Fmu")


def sources_of(face: type[Slave]) -> dict[str, bytes]:
    """The files that a face needs to run: what is shared, its own folder and what it names in `needs`."""
    root = laws.root(face.__module__.rsplit(".", 2)[0])
    folder = root / "fmus" / _inside(face).split(".")[1]
    files = [*SHARED, *(f"fmus/{name}" for name in face.needs), *(str(path.relative_to(root)) for path in folder.rglob("*.py"))]
    return {name.replace(os.sep, "/"): (root / name).read_bytes() for name in sorted(set(files))}


def laws_of(sources: dict[str, bytes]) -> str:
    """By what an FMU's sources are known again, whatever its start values."""
    return _hash(sources, {})


def pack(face: type[Slave], sources: dict[str, bytes], path: Path, starts: dict[str, Any] | None = None) -> Path:
    """Write the FMU of a face, made of `sources` (path below the project -> content), to `path`.

    Sources go in as they are: they import one another relatively, so that they find one another in any package.
    """
    starts = dict(starts or {})
    name, module = name_of(face), _inside(face)
    key = _hash(sources, starts, name.encode())
    package, script = f"selflock_{key}", f"selflock_{key}_{name.lower()}"
    model = _model(face, starts)

    files: dict[str, bytes] = {f"resources/{package}/{file}": text for file, text in sources.items()}
    for folder in {parent for file in sources for parent in Path(file).parents}:
        files.setdefault(f"resources/{package}/{folder.as_posix()}/__init__.py".replace("/./", "/"), b"")
    names = {"package": package, "module": module, "face": face.__name__, "name": name, "key": key, "starts": starts}
    names["laws"] = laws_of(sources)
    files[f"resources/{package}/model.py"] = MODEL.format(**names).encode()
    files[f"resources/{script}.py"] = SCRIPT.format(**names).encode()
    files["resources/slavemodule.txt"] = script.encode()
    for file in sorted(Path(pythonfmu.__file__).parent.glob("*.py")):
        files[f"resources/pythonfmu/{file.name}"] = file.read_bytes()
    files |= loader.binaries(name, package)
    files["documentation/index.html"] = documentation.page(model, key, _hash(sources, {}, name.encode())).encode()
    files["documentation/licenses/license.txt"] = LICENSE.read_bytes()
    files["model.png"] = documentation.icon(name)
    model.guid = _guid(files)
    files["resources/guid.txt"] = model.guid.encode()  # by which the loader knows that a host means this FMU
    xml = describe(model)
    indent(xml)
    files["modelDescription.xml"] = tostring(xml, encoding="UTF-8", xml_declaration=True)
    _write_zip(path, files)
    return path


def _model(face: type[Slave], starts: dict[str, Any]) -> Slave:
    """The slave as it will be in the FMU, tried once: start values that cannot work are refused here."""
    name = name_of(face)
    plain = {row.name: row for row in (*face.inputs, *face.parameters)}
    for key, value in starts.items():
        if key not in plain:
            raise BuildError(f"{name} has no parameter or input {key!r}. It has {', '.join(plain)}.")
        wanted = type(plain[key].start)
        if not isinstance(value, wanted) and not (wanted is float and type(value) is int):
            raise BuildError(f"{name}.{key} = {value!r}: a {plain[key].type} value is needed.")
        starts[key] = wanted(value)
    model = type(name, (face,), {"starts": starts, "__doc__": face.__doc__})(instance_name=name, resources="")
    for key, value in starts.items():
        model._set(model._place[key], value, plain[key].type)
    model.enter_initialization_mode()
    model.exit_initialization_mode()
    if model._fault:
        raise BuildError(f"{name} cannot start with these values: {model._fault}.")
    return model


def _inside(face: type[Slave]) -> str:
    """The module of a face as its FMU has it, such as fmus.motor.fmu."""
    name = face.__module__
    return name.partition(".")[2] if name.startswith((HOUSE, laws.JOINED)) else name


def _hash(sources: dict[str, bytes], starts: dict[str, Any], *more: bytes) -> str:
    content = [part for name, text in sorted(sources.items()) for part in (name.encode(), text)]
    content.append(repr(sorted(starts.items())).encode())
    digest = hashlib.sha256(pythonfmu.__version__.encode())
    for part in (*content, *more):
        digest.update(len(part).to_bytes(8, "big") + part)
    return digest.hexdigest()[:12]


def _guid(files: dict[str, bytes]) -> str:
    digest = hashlib.sha256()
    for name, content in sorted(files.items()):
        digest.update(name.encode() + hashlib.sha256(content).digest())
    text = digest.hexdigest()
    return f"{text[:8]}-{text[8:12]}-{text[12:16]}-{text[16:20]}-{text[20:32]}"


def _write_zip(path: Path, files: dict[str, bytes]) -> None:
    """Write at once or not at all: nobody ever sees half an FMU."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        for name, text in sorted(files.items(), key=lambda item: (item[0] != "modelDescription.xml", item[0])):
            entry = zipfile.ZipInfo(name, EARLIEST)
            entry.compress_type, entry.create_system = zipfile.ZIP_DEFLATED, 3
            entry.external_attr = (0o755 if name.endswith(".so") else 0o644) << 16
            archive.writestr(entry, text)
    try:
        cache.write(path, content.getvalue())
    except OSError as error:
        raise BuildError(f"Cannot write {path}: {error.strerror}.") from error
