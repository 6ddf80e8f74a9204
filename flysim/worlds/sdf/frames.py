"""The frames of a model or a world by name, and where they are: poses given relative to other poses.

Names and defaults as http://sdformat.org/tutorials?tut=pose_frame_semantics has them: what stands in a model is placed
relative to the model, a `<frame>` to what it is attached to, a joint to its child; `inner::name` is a frame of a model
in the model. Poses are found within each model, and then the model's place is found in what it stands in.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from flysim.geometry.frames import Array, inverse
from flysim.plain import shown
from flysim.worlds.sdf.elements import Where, WrittenPose

MODEL, WORLD = "__model__", "world"
MAX_FRAMES = 200_000  # of a world


@dataclass(slots=True, eq=False)
class _Frame:
    """A named place: `T` from it to the frame `base`.

    Of a model, `placed` is the frame in it that the pose places, where that is not the model's own.
    """

    T: Array
    base: str
    where: Where
    forgiven: bool
    inner: Scope | None
    placed: str
    T_scope: Array | None = None  # once it is known


@dataclass(slots=True, eq=False)
class Scope:
    """What can be named in one model, or in the world.

    Attributes:
        name: of the model, as the file has it; empty for the world.
        whole: scoped by '::'; empty for the world.
        unknown: frames that were asked for by the older attribute, and are none.
    """

    name: str = ""
    whole: str = ""
    unknown: list[tuple[str, Where]] = field(default_factory=list)
    _frames: dict[str, _Frame] = field(default_factory=dict)

    def add(
        self, name: str, pose: WrittenPose, default: str, where: Where, *, inner: Scope | None = None, placed: str = ""
    ) -> None:
        """A link, joint, frame or model; the first of a name counts.

        Args:
            name: its own.
            pose: as it is written.
            default: what it is placed in where its pose names nothing.
            where: the element.
            inner: of a model, its own frames.
            placed: of a model, the frame in it that its pose places; empty: the model's own.
        """
        self._frames.setdefault(name, _Frame(pose.T, pose.frame or default, where, pose.forgiven, inner, placed))

    def place(self, name: str, where: Where) -> Array:
        """`[4, 4]` from a frame to this model, or to the world.

        Raises:
            WorldError: there is no such frame, or it is placed by way of itself.
        """
        chain: list[_Frame] = []
        busy: set[int] = set()
        while (found := self._frames.get(name)) is not None and found.T_scope is None:
            if id(found) in busy:
                raise found.where.error(f"its pose is relative to {shown(found.base)}, which is placed by way of it")
            busy.add(id(found))
            chain.append(found)
            name, where = found.base, found.where
        forgiven = bool(chain) and chain[-1].forgiven
        T = self._elsewhere(name, where, forgiven=forgiven) if found is None else found.T_scope
        assert T is not None
        for one in reversed(chain):
            T = T @ one.T
            if one.placed and one.inner is not None:
                T = T @ inverse(one.inner.place(one.placed, one.where))
            one.T_scope = T
        return T

    def place_written(self, pose: WrittenPose, default: str, where: Where) -> Array:
        """`[4, 4]` from what a pose places, such as a visual, to the frame `default`, its link."""
        if pose.frame in ("", default):
            return pose.T
        if pose.forgiven and not self.has(pose.frame):
            self.unknown.append((pose.frame, where))
            return pose.T
        return inverse(self.place(default, where)) @ self.place(pose.frame, where) @ pose.T

    def has(self, name: str) -> bool:
        """Whether there is a frame of that name."""
        first, _, rest = name.partition("::")
        if rest:
            found = self._frames.get(first)
            return found is not None and found.inner is not None and found.inner.has(rest)
        return name in self._frames or name in self._selves

    @property
    def _selves(self) -> tuple[str, ...]:
        """Names of the scope's own origin; a model's own name is a habit of older files."""
        return (MODEL, self.name) if self.name else (WORLD, MODEL)

    def _elsewhere(self, name: str, where: Where, *, forgiven: bool) -> Array:
        """What is no frame of this scope's own: itself, or one of a model in it."""
        first, _, rest = name.partition("::")
        found = self._frames.get(first)
        if rest and found is not None and found.inner is not None:
            return self.place(first, where) @ found.inner.place(rest, where)
        if name in self._selves:
            return np.eye(4)
        if forgiven:
            self.unknown.append((name, where))
            return np.eye(4)
        raise where.error(f"its pose is relative to {shown(name)}, and there is no such frame: correct the name")
