"""What a reader passed over, as sentences: one a kind, with the names of what it was."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from flysim.plain import plain, shortened
from flysim.worlds.sdf.elements import Unread, Where

MAX_KINDS, OTHER_KINDS = 50, "other things are not read"
NAMED = 6  # of a kind
LONGEST = 140  # characters of a name with what is wrong with it


@dataclass(slots=True)
class Skipped:
    """Counts what was passed over, by kind; of at most `MAX_KINDS` kinds, `NAMED` names of each."""

    _first: dict[str, Where] = field(default_factory=dict)  # of each kind, the place
    _names: dict[str, dict[str, None]] = field(default_factory=dict)
    _counts: Counter[str] = field(default_factory=Counter)
    _unnamed: Counter[str] = field(default_factory=Counter)

    def note(self, kind: str, where: Where, detail: str = "") -> None:
        """Counts one more of a kind, such as 'joint' or 'plugin'."""
        if kind not in self._first and len(self._first) >= MAX_KINDS:
            kind, detail = OTHER_KINDS, ""
        self._first.setdefault(kind, where)
        names = self._names.setdefault(kind, {})
        quoted = f"'{plain(shortened(detail, LONGEST))}'" if detail else ""
        if quoted and quoted not in names:
            if len(names) < NAMED:
                names[quoted] = None
            else:
                self._unnamed[kind] += 1
        self._counts[kind] += 1

    def leave_out(self, what: Unread, where: Where) -> None:
        """Counts one part that cannot be read."""
        self.note(what.kind, where, what.detail)

    def sentences(self) -> tuple[str, ...]:
        """One a kind, in the order of first sight."""
        return tuple(self._sentence(kind) for kind in self._first)

    def _sentence(self, kind: str) -> str:
        count, names, at = self._counts[kind], list(self._names[kind]), f"in {self._first[kind]}"
        if count == 1:
            return f"{kind}: {' '.join([*names, at])}."
        if len(names) < 2:
            return f"{kind}: {count}, the first {' '.join([*names, at])}."
        more = f" and {self._unnamed[kind]} more" if self._unnamed[kind] else ""
        return f"{kind}: {count}: {', '.join(names)}{more}, the first {at}."
