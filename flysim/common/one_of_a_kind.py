"""What owns something outside of Python, of which there is one, refuses to be copied or pickled."""

from __future__ import annotations

from typing import ClassVar, NoReturn, SupportsIndex


class OneOfAKind:
    """A copy would share what it owns: two would drive one robot, and the first to be closed would close both."""

    instead: ClassVar[str] = "make another one"

    def __reduce_ex__(self, protocol: SupportsIndex) -> NoReturn:
        """What `copy.copy`, `copy.deepcopy` and `pickle` ask for.

        Raises:
            TypeError: always, as Python does for a lock or an open file.
        """
        raise TypeError(f"a {type(self).__name__} cannot be copied or pickled: {self.instead}")
