"""Pictures of pages for the documents, by a browser that is there: Chromium or Chrome.

    python -m benchmarks.pictures PAGE.html PICTURE.png [--only '[data-figure=missing]'] [--width 900] [--height 4000]

PAGE may be a text that a command wrote, or a notebook (benchmarks.cells).
Nothing is loaded that the page does not carry. --only: a selector of what is seen; all else is left out.
What is empty at the picture's lower end is cut off.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image, ImageChops

from benchmarks.cells import page_of

OPTIONS = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars")
ROOM = 12  # px left below


def browser() -> str | None:
    """The program, where there is one."""
    return next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


def picture(page: Path, out: Path, only: str = "", width: int = 900, height: int = 4000, cells: str = "") -> Path:
    """A page as it is seen in a window of so many px, as PNG. Raises SystemExit where there is no browser."""
    program = browser()
    if program is None:
        raise SystemExit("There is no Chromium and no Chrome here, which draw the pictures of pages.")
    text = page.read_text(encoding="utf-8") if page.suffix == ".html" else page_of(page, cells)
    if only:
        text = text.replace("</style>", f"main *:not(:is({only}, {only} *, :has({only}))) {{ display: none; }} main {{ padding: 8px; }}</style>", 1)  # fmt: skip
    with TemporaryDirectory() as folder:
        (copy := Path(folder) / "page.html").write_text(text, encoding="utf-8")
        shot = f"--screenshot={out.resolve()}"
        window = (f"--window-size={width},{height}", "--virtual-time-budget=3000", f"--user-data-dir={folder}/kept")
        subprocess.run([program, *OPTIONS, *window, shot, copy.as_uri()], check=True, capture_output=True, timeout=120)
    with Image.open(out) as taken:
        image = taken.convert("RGB")
    if seen := ImageChops.difference(image, Image.new("RGB", image.size, image.getpixel((0, image.height - 1)))).getbbox():
        image = image.crop((0, 0, image.width, min(image.height, seen[3] + ROOM)))
    if page.suffix != ".html":  # few colours
        image = image.quantize(64, dither=Image.Dither.NONE)
    image.save(out, optimize=True)
    return out


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="A picture of a page.")
    parser.add_argument("page", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", default="")
    parser.add_argument("--width", type=int, default=900)
    parser.add_argument("--height", type=int, default=4000)
    parser.add_argument("--cells", default="")
    asked = parser.parse_args()
    print(picture(asked.page, asked.out, asked.only, asked.width, asked.height, asked.cells))
