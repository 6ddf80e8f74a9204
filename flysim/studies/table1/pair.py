"""The one pair of a study: what the robot sees at the first stop of a scenario, rendered once."""

from __future__ import annotations

from dataclasses import dataclass

from flysim.geometry.rig import ImagePair
from flysim.products.frame import Frame
from flysim.render.choose import RendererName
from flysim.render.studio import drawn
from flysim.runs.robot_of import robot_of
from flysim.runs.scenario import read_scenario
from flysim.sources.simulated import stop_here
from flysim.truth.stop import Stop
from flysim.worlds.model import World
from flysim.worlds.sdf.reader import read_world

SCENARIO = "paper_a"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rendered:
    """A pair and the truth behind it.

    Attributes:
        scenario: whose first stop it is.
        renderer: "gl" or "tiny".
        world: what stands there; for the truth's side alone.
        frame: the pair, which is all that an engine may see.
        stop: where it was taken, with true depth and the body of each pixel.
    """

    scenario: str
    renderer: str
    world: World
    frame: Frame
    stop: Stop

    @property
    def pair(self) -> ImagePair:
        """All that an engine may see."""
        return self.frame.pair


def render_pair(scenario: str = SCENARIO, renderer: RendererName = "auto") -> Rendered:
    """Sets the robot down at the first stop of a scenario and looks.

    Args:
        scenario: a name or a path.
        renderer: "gl", "tiny", or "auto": gl where an OpenGL context opens.

    Raises:
        FlysimError: a mistake in the scenario, its world or robot, or `gl` where no context opens.
    """
    plan = read_scenario(scenario)
    world, robot = read_world(plan.world_path, plan.model_folders), robot_of(plan)
    here = plan.stops[0].pose
    with drawn(world, robot, here, renderer) as (simulation, eyes):
        frame, stop = stop_here(simulation, eyes, commanded=here)
    return Rendered(scenario=plan.name, renderer=eyes.name, world=world, frame=frame, stop=stop)
