"""How sound files are damaged: bytes flipped by chance, and words changed for those that hurt."""

from __future__ import annotations

import re
import zlib
from collections.abc import Sequence

import numpy as np
from hypothesis import strategies as st

WORDS = re.compile(r"[-+]?\d[\d.eE+-]*|[A-Za-z_]\w*|[<>\[\]{}\"'=/,;:]")
NASTY = (
    *("", "nan", "inf", "-inf", "1e999", "-1", "0", "-0.0", "0x10", "1_000", "1e-320", "9" * 400, "2147483648"),
    *("18446744073709551616", "%n%n%s%s", "\x1b[31m", "[bold]x[/y]", "../../../etc/passwd", "/dev/zero", "/dev/stdin"),
    *("true", "null", "\ufeff", "\u202e", "\u0663", "\x00", "\n", " ", "a" * 5000, "[" * 300, "<a>" * 300, "{" * 300),
    *("file:///etc/passwd", "model://", "<!DOCTYPE x>", "&amp;", "&x;", "NaN NaN NaN", "1 2", "1e308 1e308 1e308"),
)


def flipped(data: bytes, rng: np.random.Generator) -> bytes:
    """Some bytes changed, a stretch cut out, doubled or put in, or the end cut off."""
    changed = bytearray(data)
    for _ in range(int(rng.geometric(0.7))):
        at, length = int(rng.integers(0, max(len(changed), 1))), int(rng.integers(1, 64))
        match int(rng.integers(0, 9)):
            case 0 | 1 | 5 | 6 | 7:
                if changed:
                    changed[at] = int(rng.integers(0, 256))
            case 2:
                del changed[at : at + length]
            case 3:
                changed[at:at] = changed[at : at + length] * int(rng.integers(1, 40))
            case 4:
                changed[at:at] = rng.integers(0, 256, length, np.uint8).tobytes()
            case _:
                del changed[at:]
    return bytes(changed)


def rechecked(data: bytes) -> bytes:
    """A damaged PNG with checksums that are right again, so that its decoder meets the damage itself."""
    whole, at = bytearray(data), 8
    while at + 12 <= len(whole):
        length = int.from_bytes(whole[at : at + 4])
        end = min(at + 8 + length, len(whole) - 4)
        whole[at : at + 4] = max(end - at - 8, 0).to_bytes(4)
        whole[end : end + 4] = zlib.crc32(whole[at + 4 : end]).to_bytes(4)
        at = end + 4
    return bytes(whole)


Edit = tuple[float, int, str]
values = st.one_of(
    st.sampled_from(NASTY),
    st.floats(0.0, 3.0).map(lambda number: f"{number:.3g}"),
    st.floats(0.0, 3.0).map(lambda number: f"{number:.3g}"),
    st.integers(-5, 40).map(str),
    st.floats(width=32).map(repr),
    st.integers(-(2**70), 2**70).map(str),
    st.text(max_size=12),
)
# (place among the words as a share, what is done there, a word)
edits = st.lists(st.tuples(st.floats(0.0, 0.999), st.integers(0, 5), values), min_size=1, max_size=2)


def edited(text: str, changes: Sequence[Edit]) -> bytes:
    """A text with some of its words replaced, dropped, doubled, exchanged or put elsewhere."""
    for place, kind, word in changes:
        words = [match.span() for match in WORDS.finditer(text)]
        if not words:
            break
        # Mostly numbers: what has another number is likely to load, and is built and drawn then.
        numbers = [span for span in words if text[span[0]].isdigit()] if kind < 2 else []
        begin, end = (numbers or words)[int(place * len(numbers or words))]
        other = words[int(place * 7919) % len(words)]
        match kind:
            case 0 | 1 | 2:
                text = text[:begin] + word + text[end:]
            case 3:
                text = text[:begin] + text[end:]
            case 4:
                text = text[:begin] + text[slice(*other)] + text[end:]
            case _:
                line = text[text.rfind("\n", 0, begin) + 1 : text.find("\n", end) + 1]
                text = text[:begin] + line + text[begin:]
    return text.encode("utf-8", "surrogatepass")
