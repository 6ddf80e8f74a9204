"""What of search and refinement was measured once, and a user may want to turn: defaults with their reasons."""

from __future__ import annotations

from dataclasses import dataclass

from flysim.common.ranges import ranged


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchParams:
    """How the generations are bred and when they end. Fitness is told in multiples of the settled one.

    Attributes:
        promising: from this fitness on a child is polished [settled fitness].
        sharp: from this on there is nothing left to polish [settled fitness].
        saturation: towards this much fitness saturates in sharing [settled fitness]. Measured on a render of `paper`:
            the preserved flies cover 5 to 10 % more of the image than without saturation.
        calm: generations over which the settled flies must have stopped growing in number.
        start: share of the places that settled flies must hold before their number can be said to have stopped growing.
        fold_share: share of mutations that take a new slant half-way: over an edge, onto another face.
        mutation_slant: standard deviation of the other mutations' change of slant, as a share of the steepest one.
    """

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 (how a scenario file reads this record)

    promising: float = 0.1
    sharp: float = 4.0
    saturation: float = 1.5
    calm: int = 2
    start: float = 0.02
    fold_share: float = 0.25
    mutation_slant: float = 0.1

    def __post_init__(self) -> None:
        ranged(
            self,
            promising=(0.0, 1e6),
            sharp=(0.0, 1e9),
            saturation=(1e-6, 1e9),
            calm=(1, 1000),
            start=(0.0, 1.0),
            fold_share=(0.0, 1.0),
            mutation_slant=(0.0, 10.0),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class RefineParams:
    """How survivors are refined to sub-pixel depth at the end, and tested for the ways in which a window can lie.

    Attributes:
        steps: Gauss-Newton steps; most flies need three.
        rival_steps: the same, on another place of the epipolar line before it is called a rival.
        max_step_px: no corner of a window moves further in one step than the image's slope can foretell [px].
        done_px: a step smaller than this is the last; the next would be some ten times smaller [px].
        slope_damping: a window with one edge tells depth, but not its slopes: they are held by this share of what tells
            depth.
        same_match_px: places nearer than this on the epipolar line belong to the same match, not to a rival one [px].
        empty_half: share of a window's mean gradient energy that each of its halves must hold: a half with none is the
            sky beyond a silhouette, which matches itself everywhere.
        sparse: that is not asked where a smaller share than this of the settled flies would pass: edges then stand
            further apart than a window is wide, and emptiness tells of no silhouette.
        noise_allowance: times the swarm's median difference that a good window may have beside its misplacement.
        disparity_std_px: what the spread of a fly is told by [px]. Measured on renders it is 0.02 to 0.05; 0.1 is the
            field's rule and holds for photographs.
    """

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 (how a scenario file reads this record)

    steps: int = 5
    rival_steps: int = 3
    max_step_px: float = 1.5
    done_px: float = 0.02
    slope_damping: float = 0.02
    same_match_px: float = 2.5
    empty_half: float = 0.02
    sparse: float = 0.5
    noise_allowance: float = 1.5
    disparity_std_px: float = 0.1

    def __post_init__(self) -> None:
        ranged(
            self,
            steps=(0, 100),
            rival_steps=(0, 100),
            max_step_px=(1e-3, 100.0),
            done_px=(0.0, 10.0),
            slope_damping=(0.0, 1e3),
            same_match_px=(0.0, 100.0),
            empty_half=(0.0, 1.0),
            sparse=(0.0, 1.0),
            noise_allowance=(0.0, 1e3),
            disparity_std_px=(1e-6, 100.0),
        )
