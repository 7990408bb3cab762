"""XML documents of strangers: what keeps a parser from reading them is mended where it is clear, and told.

Source: XML 1.0 (W3C, 5th edition), 2.8 and 4.3.3: a declaration stands first, and a document that names no encoding is
UTF-8, or UTF-16 by its byte order mark.
"""

from __future__ import annotations

import re

from lxml import etree

PARSER = {"resolve_entities": False, "no_network": True, "load_dtd": False, "remove_comments": True, "remove_pis": True}
MARKS = (b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff")
DECLARED = re.compile(rb"<\?xml[^>]*?encoding\s*=\s*['\"]([A-Za-z0-9._-]+)")


def sound(content: bytes) -> tuple[bytes, list[str]]:
    """A document that a parser takes, as far as its first bytes and its encoding go, and what was mended in it."""
    notes = []
    if content[:1].isspace() and content.lstrip().startswith(b"<?xml"):
        content = content.lstrip()
        notes.append("there is a blank in front of its XML declaration; it is left out")
    declared = DECLARED.match(content.removeprefix(MARKS[0]))
    if content.startswith(MARKS[1:]) or declared and declared[1].lower() not in (b"utf-8", b"utf8", b"us-ascii"):
        return content, notes
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        text = content.decode("cp1252", "replace")
        content = re.sub(r"(<\?xml[^>]*?encoding\s*=\s*['\"])[^'\"]*", r"\1UTF-8", text, count=1).encode("utf-8")
        notes.append("it is not the UTF-8 that it should be; it is read as Windows-1252")
    return content, notes


def root_of(content: bytes) -> tuple[etree._Element, list[str]]:
    """The root of a document without comments, and what was mended. Raises etree.XMLSyntaxError."""
    content, notes = sound(content)
    return etree.fromstring(content, etree.XMLParser(**PARSER)), notes
