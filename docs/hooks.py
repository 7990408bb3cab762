"""The site's pages that lie elsewhere in the project, and links that leave docs/.

README.md is the first page and CHANGELOG.md another. A link to a source file has no page to go to: its words stay.
"""

import posixpath
import re
from pathlib import Path

from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parent.parent
ELSEWHERE = {"index.md": "README.md", "changes.md": "CHANGELOG.md"}
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")


def on_files(files, config):
    for name, source in ELSEWHERE.items():
        files.append(File.generated(config, name, content=(ROOT / source).read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown, page, config, files):
    name = page.file.src_uri
    place = posixpath.dirname(ELSEWHERE.get(name, "docs/" + name))  # of the text in the project
    here = posixpath.dirname(name)
    moved = {source: target for target, source in ELSEWHERE.items()}

    def turned(match):
        image, words, address = match.groups()
        path, hash_, anchor = address.partition("#")
        if not path or ":" in path:
            return match[0]
        project = posixpath.normpath(posixpath.join(place, path))
        target = moved.get(project) or (project.removeprefix("docs/") if project.startswith("docs/") else None)
        if target is None or files.get_file_from_path(target) is None:
            return words
        return f"{image}[{words}]({posixpath.relpath(target, here or '.')}{hash_}{anchor})"

    return LINK.sub(turned, markdown)
