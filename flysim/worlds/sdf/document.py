"""The bytes of an SDF file as XML elements: gzip undone, what Gazebo forgives mended, and nothing without a bound."""

from __future__ import annotations

import codecs
import gzip
import io
import re
import zlib
from typing import TYPE_CHECKING
from xml.etree.ElementTree import TreeBuilder

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import ParseError, XMLParser, iterparse

from flysim.worlds.sdf.elements import Where

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

MAX_ATTRIBUTES = 1_000_000
MAX_DEPTH = 64  # nested XML elements
MAX_PREFIXES = 32  # that a file may use without declaring them

_COMMENT = re.compile(rb"<!--.*?-->", re.DOTALL)
_PREFIX = re.compile(rb"[<\s/]([A-Za-z_][\w.-]{0,80}):[A-Za-z_]")
_ROOT = re.compile(rb"<[A-Za-z_][\w:.-]*")


def unpacked(data: bytes, max_bytes: int, where: Where) -> bytes:
    """The bytes of a file that may be gzipped."""
    if not data.startswith(b"\x1f\x8b"):
        return data
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(data)) as stream:
            plain = stream.read(max_bytes + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise where.error(f"is damaged gzip ({error}): pack it again") from None
    if len(plain) > max_bytes:
        raise where.error(f"unpacks to more than {max_bytes / 2**20:.0f} MB: make it smaller")
    if not plain:
        raise where.error("is empty once unpacked: write it again")
    return plain


def parse_xml(data: bytes, max_elements: int, where: Where) -> tuple[Element, int]:
    """The root element and how many there are. UTF-8, or UTF-16 with its mark, so that the counts below hold.

    Mended, as Gazebo reads it: byte order marks and space before the first line, `--` in comments, and prefixes such
    as `gz:` that the file does not declare.
    """
    data = _plain_utf8(data, where)
    # A "<" begins each element and a "=" is in each attribute: memory is bounded before anything is parsed.
    if data.count(b"<") > 2 * max_elements + 16 or data.count(b"=") > MAX_ATTRIBUTES:
        raise where.error(f"has more than {max_elements} XML elements, or too many attributes: split it")
    problem = ""
    for mend in (None, mended):  # most files need no mending, which looks at every byte
        try:
            return _parsed(data if mend is None else mend(data), max_elements, where)
        except ParseError as error:
            problem = str(error)
    raise where.error(f"is not well-formed UTF-8 XML ({problem}): correct it")


def _parsed(data: bytes, max_elements: int, where: Where) -> tuple[Element, int]:
    root: Element | None = None
    count = depth = 0
    try:
        # The parser is made here: iterparse's own takes the encoding that the file declares.
        parser = XMLParser(target=TreeBuilder(), encoding="utf-8", forbid_dtd=True)
        for event, element in iterparse(io.BytesIO(data), events=("start", "end"), parser=parser):
            if event == "end":
                depth -= 1
                continue
            root = element if root is None else root
            count, depth = count + 1, depth + 1
            if depth > MAX_DEPTH:
                raise where.error(f"has XML elements nested deeper than {MAX_DEPTH}: flatten it")
    except DefusedXmlException:
        raise where.error("declares a DTD or entities, which are not read: remove the <!DOCTYPE ...>") from None
    if root is None or count > max_elements:
        raise where.error(f"has {count} XML elements, 1 to {max_elements} are read: split it")
    return root, count


def _plain_utf8(data: bytes, where: Where) -> bytes:
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        try:
            data = data.decode("utf-16").encode("utf-8")
        except UnicodeError:
            raise where.error("is damaged UTF-16: save it as UTF-8 text") from None
    start = 0
    while data.startswith((codecs.BOM_UTF8, b" ", b"\t", b"\r", b"\n"), start):
        start += 3 if data.startswith(codecs.BOM_UTF8, start) else 1
    return data[start:]


def mended(data: bytes) -> bytes:
    """Comments made blank, and each undeclared prefix declared in the first tag."""
    data = _COMMENT.sub(lambda found: re.sub(rb"[^\r\n]", b" ", found[0]), data)
    root = _ROOT.search(data)
    if root is None:
        return data
    head = data[root.start() : data.find(b">", root.end()) + 1]
    declared = set(re.findall(rb"xmlns:([\w.-]+)\s*=", head)) | {b"xml", b"xmlns"}
    used: dict[bytes, None] = {}
    for found in _PREFIX.finditer(data):
        if found[1] not in declared:
            used[found[1]] = None
            if len(used) > MAX_PREFIXES:
                return data
    added = b"".join(b' xmlns:%s="urn:undeclared:%s"' % (name, name) for name in used)
    return data[: root.end()] + added + data[root.end() :]
