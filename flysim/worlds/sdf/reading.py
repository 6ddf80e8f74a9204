"""What every reader of an element has at hand."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flysim.worlds.sdf.elements import Where
from flysim.worlds.sdf.folder import WorldFolder
from flysim.worlds.sdf.frames import Scope
from flysim.worlds.sdf.skipped import Skipped


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reading:
    """Where an element stands, and what is known there.

    Attributes:
        folder: of the world, which opens files and keeps what is passed over.
        scope: the frames of the model.
        base: folder of the file it stands in.
        where: the element.
        scale: of a model whose saved state has another size; 1 each: its own.
    """

    folder: WorldFolder
    scope: Scope
    base: Path
    where: Where
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)

    @property
    def skipped(self) -> Skipped:
        """What is passed over."""
        return self.folder.skipped

    def note(self, kind: str, detail: str = "") -> None:
        """Counts one more of what is passed over here."""
        self.skipped.note(kind, self.where, detail)
