"""XML documents of strangers: what keeps a parser from reading them is mended where it is clear, and told.

Source: XML 1.0 (W3C, 5th edition), 2.2, 2.8, 4.1 and 4.3.3: which characters there may be, a declaration stands first, a &
begins an entity, and a document that names no encoding is UTF-8, or UTF-16 by its byte order mark.
"""

from __future__ import annotations

import codecs
import re

from lxml import etree

from .errors import DescriptionError

PARSER = {"resolve_entities": False, "no_network": True, "load_dtd": False, "remove_comments": True, "remove_pis": True}
MARKS = (b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff")
ENCODINGS = ("utf-8", "utf-16", "cp", "iso8859", "koi8", "mac", "shift_jis", "euc", "gb", "big5")  # of texts
TYPED = "declares a document type (<!DOCTYPE …>), which has no place in it; it may hold entities."
FORBIDDEN = re.compile(rb"[\x00-\x08\x0b\x0c\x0e-\x1f]")
BARE = re.compile(rb"&(?!(?:#\d+|#x[0-9A-Fa-f]+|amp|lt|gt|quot|apos);)")
DECLARED = re.compile(rb"<\?xml[^>]*?encoding\s*=\s*['\"]([A-Za-z0-9._-]+)")


def sound(content: bytes) -> tuple[bytes, list[str]]:
    """A document that a parser takes, as far as its first bytes and its encoding go, and what was mended in it."""
    notes = []
    if content[:1].isspace() and content.lstrip().startswith(b"<?xml"):
        content = content.lstrip()
        notes.append("there is a blank in front of its XML declaration; it is left out")
    declared = DECLARED.match(content.removeprefix(MARKS[0]))
    name = declared[1].decode() if declared else "utf-8"
    known = _encoding(name)
    if content.startswith(MARKS[1:]) or known == "iso8859-1":  # which parsers know
        return content, notes
    if not known or known.startswith("utf-16") and declared:  # whose declaration no pattern of single bytes would have found
        known = ""
        notes.append(f"it is not in the encoding {name!r} that it names; it is read as UTF-8 or Windows-1252")
    try:
        text = content.decode(known or "utf-8")
        if known == "utf-8" and name.lower() in ("utf-8", "utf8"):
            return content, notes
    except UnicodeDecodeError:
        said = "UTF-8" if known in ("", "utf-8") else name
        text = content.decode("cp1252", "replace")
        notes.append(f"it is not the {said} that it should be; it is read as Windows-1252")
    return re.sub(r"(<\?xml[^>]*?encoding\s*=\s*['\"])[^'\"]*", r"\1UTF-8", text, count=1).encode("utf-8"), notes


def _encoding(name: str) -> str:
    """Python's name of an encoding, ASCII being UTF-8; "" of what is none."""
    try:
        known = codecs.lookup(name).name
    except LookupError:
        return ""
    return "utf-8" if known == "ascii" else known if known.startswith(ENCODINGS) else ""


def legible(content: bytes) -> tuple[bytes, list[str]]:
    """A document without what no document may hold, for one that a parser refuses, and what was mended in it."""
    notes: list[str] = []
    if content.startswith(MARKS[1:]):
        return content, notes
    for pattern, instead, said in (
        (FORBIDDEN, b"", "it holds control characters, which are left out"),
        (BARE, b"&amp;", "it holds a & that begins no entity; it is taken as that sign"),
    ):
        content, count = pattern.subn(instead, content)
        notes += [said] * bool(count)
    return content, notes


def root_of(content: bytes) -> tuple[etree._Element, list[str]]:
    """The root of a document without comments, and what was mended. Raises etree.XMLSyntaxError, DescriptionError."""
    content, notes = sound(content)
    try:
        return without_type(etree.fromstring(content, etree.XMLParser(**PARSER))), notes
    except etree.XMLSyntaxError:
        content, more = legible(content)
        if not more:
            raise
        return without_type(etree.fromstring(content, etree.XMLParser(**PARSER))), notes + more


def without_type(root: etree._Element) -> etree._Element:
    """The root of a document that declares no document type."""
    if root.getroottree().docinfo.internalDTD is not None:
        raise DescriptionError(f"it {TYPED}")
    return root
